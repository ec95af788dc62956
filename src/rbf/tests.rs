//! The encoder and the sum against analytic fields, finite differences and brute force.

mod drawn;
mod fits;
mod parts;
mod resumed;

use std::ops::ControlFlow;
use std::sync::mpsc;
use std::time::Duration;

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector, Matrix3};

use super::cluster::{Cluster, split_into};
use super::encode::resume_within;
use super::refine::derivatives;
use super::solve::{Column, least_squares as held_squares};
use super::*;
use crate::core::{Ticket, assert_stops};

const GOAL: Goal =
    Goal { basis: Basis::Ellipsoid, max_error: 0.01, mean_error: f64::INFINITY, functions: 200 };

/// Numbers in 0 to 1, always the same.
fn random() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn lattice(side: usize) -> impl Iterator<Item = DVec3> {
    let at = move |i: usize| [i % side, i / side % side, i / (side * side)].map(|n| n as f64);
    (0..side.pow(3)).map(move |i| DVec3::from(at(i)))
}

fn some_function(next: &mut impl FnMut() -> f64) -> Function {
    let mut centred = || next() - 0.5;
    Function {
        centre: DVec3::new(centred(), centred(), centred()) * 8.0 + 5.0,
        shape: DMat3::from_cols_array(&[
            0.5 + centred().abs(),
            0.0,
            0.0,
            centred() * 0.4,
            0.4 + centred().abs(),
            0.0,
            centred() * 0.4,
            centred() * 0.4,
            0.6 + centred().abs(),
        ]),
        weight: centred() * 10.0,
    }
}

fn encoded(points: &Points, goal: Goal) -> Encoding {
    encode(points, goal, &Ticket::new(), |_| ControlFlow::Continue(())).expect("there are samples")
}

/// A field that no few functions are: three waves and a ridge.
fn rough(at: DVec3) -> f64 {
    let waves = (at.x * 0.9).sin() * (at.y * 0.7).cos() + (at.z * 0.8 + at.x * 0.3).sin();
    waves + (-0.5 * (at.x - at.y).powi(2)).exp()
}

/// Of weights that are free.
fn least_squares(columns: &[Column], residual: &[f64], roots: &[f64], damping: f64) -> Vec<f64> {
    held_squares(columns, residual, roots, damping, (&[], 0.0))
}

fn errors_of(encoding: &Encoding, points: &Points) -> Errors {
    encoding.errors(points, &Ticket::new()).expect("nobody stops it")
}
