//! One splat a vector: where it stands, how opaque and of what colours it is, and its own phase.

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

use super::marks::unit_from_hash;
use super::{ColourBy, VectorMode, VectorSettings};
use crate::core::Cancelled;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::kernel::{Kernel, RadialKernel};
use crate::transfer::extinction_from_opacity;
use crate::volume::{Places, ScalarVolume, VectorField};

/// How much wider the window of the marks is than the kernel of matter ("windowed, but given a
/// slightly larger extent than the scalar splat").
pub const WINDOW: f64 = 1.15;
/// Vectors a worker takes at a time between two looks at the ticket.
const CHUNK: usize = 1 << 14;
/// Colour of what marks of mapped colours are blended into.
const GREY: [f32; 3] = [0.2; 3];
/// No axis of a splat is longer than the second longest so many times: of winds at a few levels far apart a splat as
/// tall as its cell would be a curtain, in which no direction can be read.
const MOST_ASPECT: f64 = 2.0;

/// A vector, classified. Positions are in [`Splats::unit`]s from [`Splats::origin`].
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Splat {
    /// Its middle.
    pub centre: [f32; 3],
    /// Optical depth model: extinction per unit where the kernel is 1, so that depth is kept by any
    /// stretch and extent. Published: opacity.
    pub amount: f32,
    /// Unit vector of the flow, world axes; zero where there is none.
    pub direction: [f32; 3],
    /// Its own, in cycles 0..1.
    pub phase: f32,
    /// Linear light: MODULATE's colour, or that of BLEND's body.
    pub colour: [f32; 3],
    /// Steps of the grid that it stands for, along each axis.
    pub size: f32,
    /// Linear light: BLEND's constant colour.
    pub marks: [f32; 3],
    /// How far the directions that it stands for differ: 0 where they are one, 1 where they cancel.
    pub spread: f32,
}

/// Classified vectors: those with opacity.
#[derive(Debug, Clone, PartialEq)]
pub struct Splats {
    /// World position that centres are counted from.
    pub origin: DVec3,
    /// World length of one unit, > 0.
    pub unit: f64,
    /// Grid points along x, y, z.
    pub dims: [usize; 3],
    /// World axes of a splat in kernel space, as columns, in units: steps of the grid, none longer than twice the
    /// second. Of the whole field where there are no own.
    pub axes: DMat3,
    /// The same of each splat, where a grid is curvilinear.
    pub own_axes: Vec<[[f32; 4]; 3]>,
    /// Those that can show.
    pub list: Vec<Splat>,
    /// Grid index of each.
    pub indices: Vec<u32>,
    /// Vectors without data.
    pub holes: u64,
    /// Length along the flow over width.
    pub stretch: f64,
    /// Radius of the kernel of matter in steps of the grid.
    pub radius: f64,
}

impl Splats {
    /// Classifies a field for a scene whose opacities are per `unit_distance` world units.
    ///
    /// `published` keeps opacities as they are (Crawfis–Max); else they become extinctions. `scalar` is
    /// what [`ColourBy::Scalar`] looks up: outside of it nothing shows.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(
        field: &VectorField,
        settings: &VectorSettings,
        scalar: Option<&ScalarVolume>,
        unit_distance: f64,
        published: bool,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let (origin, unit, steps) = frame(&field.places);
        let (axes, _) = slimmed(steps);
        let natural = RadialKernel::new(Kernel::Cubic, None).map_or(1.0, RadialKernel::radius);
        // h_E(r) = h(r/s)/s³ and a stretched kernel is thinner by as much as it is longer.
        let spread_out = (settings.radius() / natural).powi(3) * settings.stretch;
        let asked =
            Asked { field, settings, scalar, unit_distance, published, origin, unit, spread_out };
        let count = field.vectors.len();
        let parts = parallel::try_list(count.div_ceil(CHUNK), |chunk| {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            let range = parallel::part(count, CHUNK, chunk);
            let mut holes = 0;
            let splats = range.filter_map(|index| {
                let found = asked.splat(index);
                holes += u64::from(found.is_none());
                #[expect(clippy::cast_possible_truncation, reason = "checked when it was read")]
                let index = index as u32;
                found.filter(|splat| splat.amount > 0.0).map(|splat| (splat, index))
            });
            Ok((splats.collect::<Vec<(Splat, u32)>>(), holes))
        })?;
        let holes = parts.iter().map(|(_, holes)| holes).sum();
        let (list, indices): (Vec<_>, Vec<_>) =
            parts.into_iter().flat_map(|(part, _)| part).unzip();
        let own_axes = match &field.places {
            Places::Lattice(_) => Vec::new(),
            Places::Points { axes, .. } => indices
                .iter()
                .map(|&i| columns(slimmed(axes[i as usize] * (1.0 / unit)).0))
                .collect(),
        };
        Ok(Self {
            origin,
            unit,
            dims: field.places.dims(),
            axes,
            own_axes,
            list,
            indices,
            holes,
            stretch: settings.stretch,
            radius: settings.radius(),
        })
    }

    /// Axes of a splat in kernel space, as columns, in units: see [`Self::axes`].
    pub fn axes_of(&self, splat: usize) -> DMat3 {
        match self.own_axes.get(splat) {
            Some(columns) => DMat3::from_cols_array_2d(
                &columns.map(|[x, y, z, _]| [f64::from(x), f64::from(y), f64::from(z)]),
            ),
            None => self.axes,
        }
    }

    /// The same as columns of 32-bit floats.
    pub fn columns_of(&self, splat: usize) -> [[f32; 4]; 3] {
        self.own_axes.get(splat).copied().unwrap_or_else(|| columns(self.axes))
    }

    /// World from kernel space of a splat, in units, where 1 is a step of the grid: stretched along the
    /// flow.
    pub fn map_of(&self, splat: usize) -> DMat3 {
        let Splat { direction, size, .. } = self.list[splat];
        let v = DVec3::from(direction.map(f64::from));
        let along = DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        let natural = RadialKernel::new(Kernel::Cubic, None).map_or(1.0, RadialKernel::radius);
        let stretched = DMat3::IDENTITY + along * (self.stretch - 1.0);
        stretched * self.axes_of(splat) * (f64::from(size) * self.radius / natural)
    }
}

/// World length of a step of a grid: the shortest of a lattice, and the mean of the shortest where steps
/// differ.
pub fn typical_step(places: &Places) -> f64 {
    frame(places).1
}

/// Where positions are counted from, the world length of a unit, and the steps of a lattice in units.
fn frame(places: &Places) -> (DVec3, f64, DMat3) {
    match places {
        Places::Lattice(lattice) => {
            let unit = lattice.smallest_spacing();
            (lattice.centre(), unit, lattice.axes() * (1.0 / unit))
        }
        Places::Points { points, axes, .. } => {
            let count = points.len().max(1) as f64;
            let origin = points.iter().map(|p| *p / count).sum();
            let length =
                |m: &DMat3| m.x_axis.length().min(m.y_axis.length()).min(m.z_axis.length());
            let sum: f64 = axes.iter().map(|m| length(m) / count).sum();
            let unit = if sum > 0.0 { sum } else { 1.0 };
            (origin, unit, DMat3::IDENTITY)
        }
    }
}

/// Axes of a splat for a cell of such steps, none longer than the second longest twice, and how many times smaller it is than the cell.
fn slimmed(steps: DMat3) -> (DMat3, f64) {
    let lengths = [0, 1, 2].map(|axis| steps.col(axis).length());
    let mut sorted = lengths;
    sorted.sort_by(f64::total_cmp);
    let most = MOST_ASPECT * sorted[1];
    if sorted[2] <= most || most <= 0.0 {
        return (steps, 1.0);
    }
    let scale = DVec3::from(lengths.map(|length| (most / length).min(1.0)));
    (steps * DMat3::from_diagonal(scale), most / sorted[2])
}

pub(super) fn columns(m: DMat3) -> [[f32; 4]; 3] {
    [m.x_axis, m.y_axis, m.z_axis].map(|c| c.as_vec3().extend(0.0).to_array())
}

struct Asked<'a> {
    field: &'a VectorField,
    settings: &'a VectorSettings,
    scalar: Option<&'a ScalarVolume>,
    unit_distance: f64,
    published: bool,
    origin: DVec3,
    unit: f64,
    spread_out: f64,
}

impl Asked<'_> {
    /// `None` where there is no data.
    #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
    fn splat(&self, index: usize) -> Option<Splat> {
        let v = self.field.vectors[index].as_dvec3();
        if !v.is_finite() {
            return None;
        }
        let (place, steps) = self.field.places.at(index);
        let VectorSettings { transfer, opacity_by, colour_by, .. } = self.settings;
        let quantity = |by: ColourBy| match by {
            ColourBy::Magnitude => v.length(),
            ColourBy::X => place.x,
            ColourBy::Y => place.y,
            ColourBy::Z => place.z,
            ColourBy::Scalar => self.scalar.map_or(f64::NAN, |scalar| scalar.value_at(place)),
        };
        let opacity = transfer.opacity_at(quantity(*opacity_by));
        let amount = match self.published {
            true => opacity,
            false => {
                let per_unit = extinction_from_opacity(opacity) * self.unit / self.unit_distance;
                // As much matter as fills the cell, in a splat that may be slimmer.
                per_unit / (self.spread_out * slimmed(steps).1)
            }
        };
        let mapped = transfer.colour_at(quantity(*colour_by)).0.map(|c| c as f32);
        let (colour, marks) = match (self.settings.mode, self.settings.marks) {
            (VectorMode::Blend, None) => (GREY, mapped),
            (_, marks) => (mapped, marks.map_or([0.0; 3], |c| c.to_linear().0.map(|c| c as f32))),
        };
        Some(Splat {
            centre: ((place - self.origin) / self.unit).as_vec3().to_array(),
            amount: amount as f32,
            direction: v.normalize_or_zero().as_vec3().to_array(),
            phase: own_phase(self.settings.seed, 0, index),
            colour,
            size: 1.0,
            marks,
            spread: 0.0,
        })
    }
}

/// The phase of a vector or of a mean of some: the same in every picture.
#[expect(clippy::cast_possible_truncation, reason = "24 bits are kept")]
pub(super) fn own_phase(seed: u64, level: u32, index: usize) -> f32 {
    let key = seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ (u64::from(level) << 58) ^ index as u64;
    // Below 1 in single precision too.
    (unit_from_hash(key) as f32).min(1.0 - f32::EPSILON)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::core::Srgb8;
    use crate::transfer::{ColourSource, TransferFunction};
    use crate::volume::{Lattice, Samples};

    fn field(vectors: Vec<Vec3>) -> VectorField {
        let lattice = Lattice {
            spacing: DVec3::new(2.0, 2.0, 4.0),
            origin: DVec3::splat(1e7),
            ..Lattice::unit([vectors.len(), 1, 1])
        };
        VectorField::new("v", Places::Lattice(lattice), vectors.into(), &Ticket::new()).unwrap()
    }

    fn settings(mode: VectorMode) -> VectorSettings {
        let stops = vec![(0.0, Srgb8::BLACK), (10.0, Srgb8::WHITE)];
        let opacity = vec![(1.0, 0.0), (3.0, 0.5)];
        let transfer = TransferFunction::new(opacity, ColourSource::Stops(stops)).unwrap();
        let lengths = field(vec![Vec3::X]).statistics;
        VectorSettings { mode, transfer, stretch: 2.0, ..VectorSettings::for_lengths(&lengths) }
    }

    fn splats(vectors: Vec<Vec3>, settings: &VectorSettings, published: bool) -> Splats {
        Splats::new(&field(vectors), settings, None, 2.0, published, &Ticket::new()).unwrap()
    }

    #[test]
    fn what_cannot_show_is_left_out_and_holes_are_counted() {
        let vectors = vec![Vec3::X, Vec3::new(0.0, 3.0, 0.0), Vec3::NAN, Vec3::ZERO, Vec3::Z * 2.0];
        let found = splats(vectors, &settings(VectorMode::Modulate), true);
        assert_eq!((found.indices.as_slice(), found.holes), ([1, 4].as_slice(), 1));
        assert_eq!(found.list[0].direction, [0.0, 1.0, 0.0]);
        assert_eq!((found.list[0].amount, found.list[1].amount), (0.5, 0.25));
        // Positions survive an origin far away: 2 of 0..5 in steps of 2.
        assert_eq!((found.unit, found.list[0].centre), (2.0, [-1.0, 0.0, 0.0]));
    }

    #[test]
    fn depth_is_kept_by_any_stretch_and_extent() {
        let settings = settings(VectorMode::Modulate);
        let wide = VectorSettings { stretch: 4.0, extent: Some(3.2), ..settings.clone() };
        let depth = |settings: &VectorSettings| {
            let splats = splats(vec![Vec3::Y * 3.0], settings, false);
            // The kernel's integral over space is the determinant of its map.
            f64::from(splats.list[0].amount) * splats.map_of(0).determinant()
        };
        // −ln(1 − 0.5) per unit distance, which is a unit here, over a step of 1 × 1 × 2 units.
        assert!((depth(&settings) - 2.0 * 2.0_f64.ln()).abs() < 1e-6, "{}", depth(&settings));
        assert!((depth(&wide) - 2.0 * 2.0_f64.ln()).abs() < 1e-6, "{}", depth(&wide));
    }

    #[test]
    fn splats_of_levels_far_apart_are_no_curtains_and_as_much_matter() {
        let of = |spacing: DVec3, published: bool| {
            let lattice = Lattice { spacing, ..Lattice::unit([3, 1, 1]) };
            let field = VectorField::new(
                "v",
                Places::Lattice(lattice),
                vec![Vec3::X * 3.0; 3].into(),
                &Ticket::new(),
            );
            let settings = settings(VectorMode::Modulate);
            Splats::new(&field.unwrap(), &settings, None, 2.0, published, &Ticket::new()).unwrap()
        };
        let lengths = |splats: &Splats| [0, 1, 2].map(|axis| splats.axes.col(axis).length());
        let winds = of(DVec3::new(0.75, 0.75, 22.5), false);
        // In units of 0.75.
        assert_eq!(lengths(&winds), [1.0, 1.0, 2.0]);
        let depth = f64::from(winds.list[0].amount) * winds.map_of(0).determinant();
        let expected = 2.0_f64.ln() * 0.75 / 2.0 * 30.0;
        assert!((depth / expected - 1.0).abs() < 1e-6, "{depth}");
        // What is short is not: cells of a grid whose lines meet.
        assert_eq!(lengths(&of(DVec3::new(0.01, 1.0, 2.0), false)), [1.0, 100.0, 200.0]);
        assert_eq!(lengths(&of(DVec3::new(1.0, 9.0, 3.0), false)), [1.0, 6.0, 3.0]);
        assert_eq!(of(DVec3::new(0.75, 0.75, 22.5), true).list[0].amount, 0.5, "an opacity");
    }

    #[test]
    fn a_splat_is_stretched_along_the_flow_alone() {
        let splats = splats(vec![Vec3::new(0.0, 3.0, 4.0)], &settings(VectorMode::Modulate), true);
        let map = splats.map_of(0) * splats.axes.inverse();
        let flow = DVec3::new(0.0, 0.6, 0.8);
        let scale = splats.radius / RadialKernel::new(Kernel::Cubic, None).unwrap().radius();
        assert!((map * flow - flow * 2.0 * scale).length() < 1e-6);
        let beside = DVec3::new(0.0, 0.8, -0.6);
        assert!((map * beside - beside * scale).length() < 1e-6);
    }

    #[test]
    fn blend_has_two_colours_and_either_may_be_mapped() {
        let of = |marks| {
            let settings = VectorSettings { marks, ..settings(VectorMode::Blend) };
            let splats = splats(vec![Vec3::X * 10.0], &settings, true);
            (splats.list[0].colour, splats.list[0].marks)
        };
        assert_eq!(of(Some(Srgb8([255, 0, 0]))), ([1.0; 3], [1.0, 0.0, 0.0]));
        assert_eq!(of(None), (GREY, [1.0; 3]));
    }

    #[test]
    fn colour_and_opacity_by_place_and_by_a_scalar() {
        let lattice = Lattice { origin: DVec3::splat(1e7), ..Lattice::unit([3, 1, 1]) };
        let samples = Samples::Float32(vec![0.0, 4.0, 8.0]);
        let scalar = ScalarVolume::from_samples("s", lattice, samples).unwrap();
        let settings = VectorSettings {
            opacity_by: ColourBy::Scalar,
            colour_by: ColourBy::X,
            transfer: TransferFunction::new(
                vec![(0.0, 0.0), (8.0, 0.8)],
                ColourSource::Stops(vec![(1e7, Srgb8::BLACK), (1e7 + 2.0, Srgb8::WHITE)]),
            )
            .unwrap(),
            ..settings(VectorMode::Modulate)
        };
        let field = field(vec![Vec3::X; 3]);
        let ticket = Ticket::new();
        let splats = Splats::new(&field, &settings, Some(&scalar), 1.0, true, &ticket).unwrap();
        // At 0 the scalar is 0, at 2 it is 8, and at 4 there is none.
        assert_eq!(splats.indices, [1]);
        assert!((splats.list[0].amount - 0.8).abs() < 1e-6);
        assert_eq!(splats.list[0].colour, [1.0; 3]);
    }

    #[test]
    fn phases_are_spread_and_follow_the_seed() {
        let of = |seed, index| own_phase(seed, 0, index);
        assert_eq!(of(3, 5), of(3, 5));
        assert!(of(3, 5) != of(4, 5) && of(3, 5) != of(3, 6) && of(3, 5) != own_phase(3, 1, 5));
        let mean = (0..4096).map(|i| f64::from(of(7, i))).sum::<f64>() / 4096.0;
        // Standard deviation of the mean: 0.0045.
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
}
