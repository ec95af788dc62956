//! What stands for a field while the view moves, where that is another field.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::plan::SlabField;
use voxsplat::scene::{Lighting, SampleSource, framing_camera, opening};
use voxsplat::task::draw::Rung;
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
use voxsplat::volume::{Component, demo};

use super::*;
use crate::support::{drawer, drawn};

const SIDES: [u32; 2] = [72, 60];

/// Tents through samples of cells about two of these wide, as of all that are too many to be drawn themselves. Measured, native,
/// 2026-11-30: 0.013 from the cells themselves; 0.138 where tents end with the samples that lie in cells.
#[test]
fn tents_of_cells_end_where_these_do_and_are_lit_as_these_are() {
    let Some(mut drawer) = drawer() else { return };
    let grid = demo::open("demo:mesh:14", None).expect("a demo");
    let field = grid.field(None).expect("a field");
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).expect("a volume");
    let mut scene = opening(SampleSource::default(), Arc::new(volume), None);
    scene.splat = SplatSettings::CELLS;
    scene.shading.lighting = Some(Lighting::first_look());
    // As bright wherever it is, so that light is what is seen.
    let colour = ColourSource::Map { map: ColourMap::Gray, range: [-9.0, 1.0] };
    let opaque = vec![(-0.05, 0.9), (1.0, 0.9)];
    *scene.transfer_mut().expect("a field") = TransferFunction::of(opaque, colour);
    // So near its border that a sample is several pixels wide.
    scene.camera = framing_camera(&scene.lattice(), DVec3::new(-0.4, 0.8, -0.45), DVec3::Z);
    scene.camera.focal_point = DVec3::X * 0.7;
    scene.camera.parallel_scale = 0.3;
    let (exact, _) = drawn(&mut drawer, &scene, SIDES, Rung::Full);
    let apart = |picture: &_| Difference::between(picture, &exact).expect("one size").rmse;
    let rung = Rung::Reduced { field: SlabField::Preview, shrink: 1.0 };
    let (quick, reduced) = drawn(&mut drawer, &scene, SIDES, rung);
    assert_eq!(reduced.field, SlabField::Preview);
    // Of the same samples, without what is known of cells.
    let samples = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
    let samples = Scene { splat: samples, ..scene.clone() };
    let (samples, _) = drawn(&mut drawer, &samples, SIDES, Rung::Full);
    let [of_border, of_samples] = [apart(&quick), apart(&samples)];
    println!("measured {of_border} {of_samples}");
    assert!(of_border < 0.02 && of_border < 0.2 * of_samples, "{of_border} {of_samples}");
}
