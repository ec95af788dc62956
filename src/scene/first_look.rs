//! What a volume that nobody has looked at yet is seen as, in the window and in `render` alike: its colours and
//! opacities, whether it is lit, its mode, and from where it is seen.

use glam::DVec3;

use super::upright::told_by_matter;
use super::{
    ByArray, Classify, Light, Lighting, NamedView, Orientation, Reconstruction, SplatSettings,
};
use crate::core::parallel;
use crate::kernel::Kernel;
use crate::transfer::{ColourMap, ColourSource, Kind, TransferFunction, presets};
use crate::volume::{Lattice, ScalarVolume, Statistics};

/// A first look.
#[derive(Debug, Clone, PartialEq)]
pub struct FirstLook {
    /// Colours and opacities, by what kind of values there are.
    pub transfer: TransferFunction,
    /// The light, where gradients carry the shape.
    pub lighting: Option<Lighting>,
    /// The mode: [`SplatSettings::EXACT`] but for labels, thick slices and basis functions.
    pub splat: SplatSettings,
    /// Which way round it is: as its file says, and where that says nothing, as its matter tells.
    pub orientation: Orientation,
    /// From where it is seen: patients from the front.
    pub view: NamedView,
}

/// Samples that are looked at to find whether gradients carry the shape, at most.
const MOST_LOOKED_AT: usize = 1 << 17;
/// Faces are lit across which values change by this part of the visible range from sample to sample, or more. What
/// changes more slowly is a cloud. (Scans and simulations with faces: 0.08 to 0.5.)
const LEAST_SHARPNESS: f64 = 0.06;
/// And whose directions agree from sample to sample so well, as mean cosine. Of noise they do not. (Noise: 0.17. Scans:
/// 0.53 to 0.87.)
const LEAST_COHERENCE: f64 = 0.45;
/// Directions that agree better than this are of a field without any noise, which a program computed.
const NOISELESS: f64 = 0.9;
/// In such a field a cloud is smooth, too: faces are steeper. (Clouds: 0.07 to 0.14. Faces: 0.18 and more.)
const LEAST_NOISELESS_SHARPNESS: f64 = 0.16;
/// Slices so many times as thick as the pixels in them are wide are thick: a spline through their samples swings
/// between them, and faces that cross them get terraces.
const THICK: f64 = 3.0;
/// A lit volume of few samples is cut into slabs so thin that there are about as many along its longest side, since slabs
/// know the gradient on their faces alone: faces that cross slabs many pixels thick show rings.
const LIT_SLABS: f64 = 256.0;
/// Walls of cells are cut into as many slabs, about: light turns from one side of a wall to the other, and fewer show a grain
/// (can.vtu: a root mean square error of 0.012 by one slab a sample, 0.006 by two, which take a sixth longer).
const SLABS_A_WALL: f64 = 2.0;
/// But no thinner than this many to a sample, where none is left (EMD-3197.map, 20³; of demo:head, 128³, two leave traces).
const MOST_LIT_SLABS: f64 = 4.0;
/// How much of the colours' range of an unlit cloud lies above its last colour: little of it is as bright as its brightest.
const ABOVE_BRIGHT: f64 = 0.25;
/// How far beyond the values of a lit cloud its colours go, in parts of their range: in its darkest and brightest colours light
/// makes no shape.
const BEYOND_LIT: [f64; 2] = [0.1, 0.2];
/// How far below the least value of a cloud its colours begin, in parts of their range.
const ABOVE_DARK: f64 = 0.3;
/// A volume that is thinner than this share of its next side is seen onto its slices, and so are no more slices than this.
const THIN: f64 = 0.12;
const FEW_SLICES: usize = 4;

impl Lighting {
    /// The light of a first look: as bright as no light where faces look at it, and darker at their edges, but never
    /// black.
    pub fn first_look() -> Self {
        Self {
            ambient: 0.3,
            diffuse: 0.8,
            specular: 0.15,
            exponent: 20.0,
            lights: vec![Light::HEADLIGHT],
        }
    }

    /// Whether it is that of a first look still.
    pub fn is_first_look(&self) -> bool {
        *self == Self::first_look()
    }
}

impl SplatSettings {
    /// For whole numbers that name things: nothing lies between two names, so each place has the name of the sample
    /// nearest to it.
    pub const NAMES: Self = Self {
        kernel: Kernel::Nearest,
        classify: Classify::After,
        reconstruction: Reconstruction::Smooth,
        // Its faces are steps: slabs of a quarter of a voxel find them.
        slabs_per_voxel: 4.0,
        ..Self::EXACT
    };

    /// For fields that are encoded as basis functions: these themselves.
    pub const FUNCTIONS: Self = Self { kernel: Kernel::Functions, ..Self::EXACT };

    /// For unstructured and curvilinear grids: their cells themselves.
    pub const CELLS: Self = Self { kernel: Kernel::Cells, ..Self::EXACT };

    /// For numbers of cells: these are steps from one to the next, which slabs of a quarter of a sample find (can.vtu: 54 dB to
    /// the converged picture, where those of a sample have 44 and a comb along each step).
    pub const CELL_VALUES: Self = Self { slabs_per_voxel: 4.0, ..Self::CELLS };

    /// For scattered points: ellipsoids about them.
    pub const ELLIPSOIDS: Self = Self { kernel: Kernel::Ellipsoids, ..Self::EXACT };

    /// Of a mesh its cells, of scattered points ellipsoids; `None` of other volumes.
    pub fn of_cells_or_points(volume: &ScalarVolume) -> Option<Self> {
        match (&volume.cells, &volume.scattered) {
            (Some(_), _) if volume.has_values_of_cells() => Some(Self::CELL_VALUES),
            (Some(_), _) => Some(Self::CELLS),
            (None, Some(_)) => Some(Self::ELLIPSOIDS),
            (None, None) => None,
        }
    }

    /// Splines that lie between the samples rather than swing through them: for thick slices, and for what was rounded to 8 bits,
    /// whose steps light would show.
    pub const SMOOTH: Self = Self { reconstruction: Reconstruction::Smooth, ..Self::EXACT };

    /// The same with so many slabs to a voxel.
    fn cut_into(self, slabs_per_voxel: f64) -> Self {
        Self { slabs_per_voxel, ..self }
    }
}

impl FirstLook {
    /// Of a volume in a space that its file names.
    pub fn of(volume: &ScalarVolume, space: Option<&str>) -> Self {
        let statistics = &volume.statistics;
        let spacing = volume.lattice.spacing.abs();
        let is_thick = spacing.max_element() / spacing.min_element() > THICK;
        let is_picture = volume.lattice.dims.contains(&1);
        let depth = volume.depth_in_cells();
        let mut transfer = match depth {
            Some(depth) => presets::of_cells(statistics, depth),
            None if volume.scattered.is_some() => presets::of_points(statistics),
            None if is_picture => presets::of_picture(statistics),
            None if is_density(volume) => presets::of_density(statistics),
            None if is_thick => presets::of_outside(statistics),
            None => presets::default_for(statistics),
        };
        let is_of_names = Kind::of(statistics) == Kind::Labels;
        let told = match space {
            Some(_) => None,
            None => told_by_matter(volume, &transfer),
        };
        let orientation = told.unwrap_or(Orientation::of(space));
        let faces = Faces::of(volume, &transfer);
        // The outer faces of cells carry their shape, whatever lies within; so does where points end.
        let is_of_cells = volume.scattered.is_some();
        let is_lit = is_of_names || is_of_cells || faces.is_some_and(Faces::carry_the_shape);
        if faces.is_some() && !is_lit {
            colour_unlit(&mut transfer.colour);
        }
        if !is_picture && !is_of_cells && !is_of_names {
            spread_colours(&mut transfer, statistics, is_lit);
        }
        let splat = mode_of(volume, (is_of_names, is_thick && !is_picture, is_lit));
        let splat = match (splat, depth, &volume.cells) {
            (SplatSettings::EXACT | SplatSettings::SMOOTH, ..) if is_lit => {
                splat.cut_into(lit_slabs(volume.lattice.dims))
            }
            (SplatSettings::CELLS, Some(depth), Some(field)) => splat
                .cut_into(wall_slabs(spacing.max_element(), depth * field.cells().median_edge())),
            _ => splat,
        };
        let view = match is_of_names {
            // Names have faces on all sides, and often no more than a few slices.
            true => NamedView::Isometric,
            // Cells and points lie in no slices.
            false if is_of_cells => orientation.first_view(),
            false => first_view(&volume.lattice, orientation),
        };
        let lighting = is_lit.then(Lighting::first_look);
        Self { transfer, lighting, splat, orientation, view }
    }

    /// Its mode where it is not lit after all: slabs of samples are a sample thick then.
    pub fn unlit_mode(&self) -> SplatSettings {
        match self.splat.kernel {
            Kernel::BSpline => self.splat.cut_into(SplatSettings::EXACT.slabs_per_voxel),
            _ => self.splat,
        }
    }

    /// The same of a file that is a surface, whose shape its light tells, whatever its numbers are like, in colours of which none
    /// is as dark as what lies behind it.
    pub fn of_surface(mut self) -> Self {
        if let ColourSource::Map { map, .. } = &mut self.transfer.colour {
            *map = ByArray::FIRST_MAP;
        }
        Self { lighting: Some(Lighting::first_look()), ..self }
    }
}

/// The mode of a volume, by whether its values name things, its slices are thick, and it is lit.
fn mode_of(
    volume: &ScalarVolume,
    (is_of_names, is_thick, is_lit): (bool, bool, bool),
) -> SplatSettings {
    if volume.functions.is_some() {
        return SplatSettings::FUNCTIONS;
    }
    if let Some(own) = SplatSettings::of_cells_or_points(volume) {
        return own;
    }
    let shows_steps = is_lit && Kind::of(&volume.statistics) == Kind::Rounded;
    match is_of_names {
        true => SplatSettings::NAMES,
        false if is_thick || shows_steps => SplatSettings::SMOOTH,
        false => SplatSettings::EXACT,
    }
}

/// Colours of what is not lit: greys and browns tell shapes by their light, and without any, matter that is dense is one white.
fn colour_unlit(colour: &mut ColourSource) {
    let ColourSource::Map { map, range } = colour else { return };
    if *map == ColourMap::Viridis {
        // Its darkest colours are those of thin matter, which would be lost on black.
        range[0] -= ABOVE_DARK * (range[1] - range[0]);
    }
    *map = ColourMap::Viridis;
}

/// Has the colours of a cloud tell its shape: lit, none is so dark or so bright that light makes none of it; unlit, and the denser
/// the greater its values are, the last colour is reached before the greatest.
fn spread_colours(transfer: &mut TransferFunction, statistics: &Statistics, is_lit: bool) {
    let is_denser = transfer.opacity.is_sorted_by(|a, b| a.1 <= b.1);
    let ColourSource::Map { map: ColourMap::Viridis, range } = &mut transfer.colour else { return };
    let [low, high] = *range;
    let width = high - low;
    let found = match presets::is_of_chance(statistics) {
        _ if is_lit => [low - BEYOND_LIT[0] * width, high + BEYOND_LIT[1] * width],
        false if is_denser => [low, high - ABOVE_BRIGHT * width],
        _ => return,
    };
    // The widest ranges have no room beside them.
    if found.iter().all(|end| end.is_finite()) {
        *range = found;
    }
}

/// Whether it is a map of density: fractions in a world of Ångström.
fn is_density(volume: &ScalarVolume) -> bool {
    let is_fractions = matches!(Kind::of(&volume.statistics), Kind::Map { .. } | Kind::Fractions);
    is_fractions && volume.unit.as_deref() == Some("Å")
}

/// Slabs a voxel of a lit volume of so many samples: 4, 2 or 1, the more the fewer it has.
fn lit_slabs(dims: [usize; 3]) -> f64 {
    let longest = dims.into_iter().max().unwrap_or(1).max(1) as f64;
    (LIT_SLABS / longest).clamp(1.0, MOST_LIT_SLABS).log2().floor().exp2()
}

/// Slabs a sample of a lattice over cells whose walls are so thick, both world: 4, 2 or 1, the more the thinner they are.
fn wall_slabs(spacing: f64, wall: f64) -> f64 {
    let wanted = SLABS_A_WALL * spacing / wall;
    // Of cells without volume or surface it is no number.
    let wanted = if wanted.is_nan() { 1.0 } else { wanted.clamp(1.0, MOST_LIT_SLABS) };
    wanted.log2().round().exp2()
}

/// From where a volume is seen first: a few slices from the side that shows them, and of patients from the feet, as
/// radiologists look; all else by its space.
fn first_view(lattice: &Lattice, orientation: Orientation) -> NamedView {
    let axes = lattice.axes();
    let mut ways = [axes.x_axis, axes.y_axis, axes.z_axis];
    for (way, n) in ways.iter_mut().zip(lattice.dims) {
        *way *= n as f64;
    }
    let few = (0..3).min_by_key(|axis| lattice.dims[*axis]).unwrap_or_default();
    let others = (0..3).filter(|axis| *axis != few).map(|axis| lattice.dims[axis]);
    let is_of_few = lattice.dims[few] <= FEW_SLICES && others.min() > Some(8 * FEW_SLICES);
    let of_few = ways[few];
    ways.sort_by(|a, b| a.length().total_cmp(&b.length()));
    let [thin, wide, _] = ways;
    let thin = match is_of_few {
        true => of_few,
        false if thin.length() > THIN * wide.length() => return orientation.first_view(),
        false => thin,
    };
    let onto = if orientation.right.is_some() { NamedView::Bottom } else { NamedView::Top };
    let along = |view: NamedView| view.direction_and_up(orientation).0.dot(thin).abs();
    let views = [NamedView::Front, NamedView::Right, onto].into_iter();
    views.max_by(|a, b| along(*a).total_cmp(&along(*b))).unwrap_or(onto)
}

/// What gradients are like where opacities change.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Faces {
    /// How much of the visible range values change by from a sample to the next.
    sharpness: f64,
    /// Cosine between the gradients of a sample and of the next.
    coherence: f64,
}

impl Faces {
    /// Means over a volume's samples, each weighed by how much opacity changes about it; `None` where it does not.
    fn of(volume: &ScalarVolume, transfer: &TransferFunction) -> Option<Self> {
        let lattice = volume.lattice;
        let dims = lattice.dims;
        if dims.iter().any(|&n| n < 5) {
            return None;
        }
        let [low, high] = transfer.colour.range();
        let range = (high - low).abs();
        if range.is_nan() || range <= 0.0 || !range.is_finite() {
            return None;
        }
        let world_from_gradient = lattice.axes().inverse().transpose();
        let step = (lattice.len() as f64 / MOST_LOOKED_AT as f64).cbrt().ceil().max(1.0) as usize;
        let strides = [1, dims[0], dims[0] * dims[1]];
        let value = |at: usize| volume.samples.get(at);
        let gradient = |at: usize| {
            let along = strides.map(|stride| 0.5 * (value(at + stride) - value(at - stride)));
            (DVec3::from(along), world_from_gradient * DVec3::from(along))
        };
        let of_layer = |z: usize| {
            let mut sums = [0.0; 3];
            for y in (2..dims[1] - 2).step_by(step) {
                for x in (2..dims[0] - 2).step_by(step) {
                    let at = (z * dims[1] + y) * dims[0] + x;
                    let changes = strides.map(|stride| {
                        let [before, after] =
                            [at - stride, at + stride].map(|at| transfer.opacity_at(value(at)));
                        (after - before).abs()
                    });
                    let weight = changes.into_iter().fold(0.0, f64::max);
                    let (along, here) = gradient(at);
                    let change = along.abs().max_element();
                    if !(weight > 0.0 && change > 0.0 && here.is_finite()) {
                        continue;
                    }
                    let cosine = |stride: usize| {
                        let (_, there) = gradient(at + stride);
                        here.normalize_or_zero().dot(there.normalize_or_zero())
                    };
                    let cosines: f64 = strides.into_iter().map(cosine).sum();
                    if cosines.is_finite() {
                        sums[0] += weight;
                        sums[1] += weight * (change / range).min(1.0);
                        sums[2] += weight * cosines / 3.0;
                    }
                }
            }
            sums
        };
        let layers: Vec<usize> = (2..dims[2] - 2).step_by(step).collect();
        let parts = parallel::list(layers.len(), |i| of_layer(layers[i]));
        // In order, so that the sum does not depend on the threads.
        let sums =
            parts.into_iter().fold([0.0; 3], |sum, part| [0, 1, 2].map(|i| sum[i] + part[i]));
        let [weight, sharpness, coherence] = sums;
        (weight > 0.0)
            .then_some(Self { sharpness: sharpness / weight, coherence: coherence / weight })
    }

    /// Whether light makes a shape of them, rather than noise or a darker cloud.
    fn carry_the_shape(self) -> bool {
        let least = match self.coherence > NOISELESS {
            true => LEAST_NOISELESS_SHARPNESS,
            false => LEAST_SHARPNESS,
        };
        self.sharpness >= least && self.coherence >= LEAST_COHERENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Samples;

    const SIDE: usize = 40;

    /// Fractions at places of −1..=1³.
    fn look(value: impl Fn(DVec3, f64) -> f64, spacing: DVec3) -> FirstLook {
        let mut seed = 1_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1_u32 << 24)
        };
        let at = |i: usize| {
            let index =
                DVec3::new((i % SIDE) as f64, (i / SIDE % SIDE) as f64, (i / SIDE / SIDE) as f64);
            index / (SIDE - 1) as f64 * 2.0 - 1.0
        };
        let values = (0..SIDE.pow(3)).map(|i| value(at(i), noise())).collect();
        let lattice = Lattice { spacing, ..Lattice::unit([SIDE; 3]) };
        let volume = ScalarVolume::from_samples("made", lattice, Samples::Float64(values));
        FirstLook::of(&volume.expect("sound"), None)
    }

    /// A ball whose face is two samples wide.
    fn ball(at: DVec3, _noise: f64) -> f64 {
        ((0.6 - at.length()) * 10.0 + 0.5).clamp(0.0, 1.0)
    }

    #[test]
    fn a_few_slices_are_seen_onto_and_of_patients_from_the_feet() {
        let view = |dims: [usize; 3], space: Option<&str>| {
            let lattice = Lattice::unit(dims);
            first_view(&lattice, Orientation::of(space))
        };
        let patient = Some("left-posterior-superior");
        assert_eq!(view([128, 128, 1], patient), NamedView::Bottom);
        assert_eq!(view([128, 128, 1], None), NamedView::Top);
        assert_eq!(view([128, 3, 100], patient), NamedView::Front);
        assert_eq!(view([2, 128, 100], None), NamedView::Right);
        assert_eq!(view([128, 128, 20], patient), NamedView::Front);
        assert_eq!(view([128, 128, 20], None), NamedView::Isometric);
        // Three levels, however far apart.
        let spacing = DVec3::new(0.75, 0.75, 22.5);
        let levels = Lattice { spacing, ..Lattice::unit([480, 241, 3]) };
        assert_eq!(first_view(&levels, Orientation::default()), NamedView::Top);
        // A rod has no side that it is seen onto.
        assert_eq!(view([128, 1, 1], None), NamedView::Isometric);
    }

    #[test]
    fn faces_are_lit_and_clouds_and_noise_are_not() {
        assert_eq!(look(ball, DVec3::ONE).lighting, Some(Lighting::first_look()));
        let cloud = |at: DVec3, _| (-3.0 * at.length_squared()).exp();
        assert_eq!(look(cloud, DVec3::ONE).lighting, None);
        assert_eq!(look(|_, noise| noise, DVec3::ONE).lighting, None);
        assert_eq!(look(|_, _| 7.5, DVec3::ONE).lighting, None);
        // Noise of a scanner, whose neighbours are a little alike.
        let before = std::cell::Cell::new(0.5);
        let alike = |_, noise| 0.5 * (noise + before.replace(noise));
        assert_eq!(look(alike, DVec3::ONE).lighting, None);
    }

    #[test]
    fn only_thick_slices_are_first_seen_between_their_samples() {
        let reconstruction = |z: f64| look(ball, DVec3::new(1.0, 1.0, z)).splat.reconstruction;
        assert_eq!(reconstruction(2.5), Reconstruction::Interpolating);
        assert_eq!(reconstruction(6.5), Reconstruction::Smooth);
    }

    #[test]
    fn lit_volumes_of_few_samples_have_thinner_slabs_and_no_rings() {
        let slabs = [[20; 3], [64, 64, 93], [128, 30, 30], [129; 3], [512; 3], [1, 1, 1]];
        assert_eq!(slabs.map(lit_slabs), [4.0, 2.0, 2.0, 1.0, 1.0, 4.0]);
        // 40 samples along a side.
        assert_eq!(look(ball, DVec3::ONE).splat.slabs_per_voxel, 4.0);
        let cloud = |at: DVec3, _| (-3.0 * at.length_squared()).exp();
        assert_eq!(look(cloud, DVec3::ONE).splat, SplatSettings::EXACT, "unlit");
    }

    #[test]
    fn thin_walls_of_cells_have_thinner_slabs() {
        let slabs = [8.0, 4.0, 2.0, 1.0, 0.1, 0.0, f64::NAN].map(|wall| wall_slabs(1.0, wall));
        assert_eq!(slabs, [1.0, 1.0, 1.0, 2.0, 4.0, 4.0, 1.0]);
    }

    #[test]
    fn maps_of_density_have_a_face_where_matter_begins() {
        let values = (0..SIDE.pow(3)).map(|i| {
            let at = DVec3::from([i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|n| n as f64));
            // −2 about a ball of 3.5, and what rounding leaves of neither.
            -2.0 + 5.5 * ball(at / (SIDE - 1) as f64 * 2.0 - 1.0, 0.0) + 0.1 * (i as f64).sin()
        });
        let samples = Samples::Float64(values.collect());
        let mut volume = ScalarVolume::from_samples("density", Lattice::unit([SIDE; 3]), samples)
            .expect("sound");
        let own = FirstLook::of(&volume, None).transfer;
        volume.unit = Some("Å".to_owned());
        let FirstLook { transfer, lighting, .. } = FirstLook::of(&volume, None);
        assert_ne!(transfer, own);
        assert!(lighting.is_some());
        let shown = [-2.0, 0.0, 1.5, 3.5].map(|value| transfer.opacity_at(value));
        assert!(shown[0] == 0.0 && shown[3] > 0.9, "{shown:?}");
        let rising = (-20..35).filter(|tenth| {
            let opacity = transfer.opacity_at(f64::from(*tenth) / 10.0);
            0.0 < opacity && opacity < 0.9
        });
        assert!((1..6).contains(&rising.count()), "a face, no cloud: {transfer:?}");
    }

    #[test]
    fn names_are_lit_and_nothing_lies_between_two_of_them() {
        let names =
            look(|at, _| if at.length() > 0.7 { 0.0 } else { 2.0 + at.x.signum() }, DVec3::ONE);
        assert_eq!(
            (names.splat, names.lighting),
            (SplatSettings::NAMES, Some(Lighting::first_look()))
        );
        assert_eq!(names.splat.check(), Ok(()));
        let [low, high] = [1.0, 3.0].map(|name| names.transfer.colour_at(name));
        assert_ne!(low, high);
        assert_eq!(names.transfer.opacity_at(0.0), 0.0);
    }

    #[test]
    fn a_face_that_looks_at_the_light_is_as_bright_as_without_any() {
        let Lighting { ambient, diffuse, lights, .. } = Lighting::first_look();
        let towards = lights[0].direction.normalize();
        let facing = ambient + diffuse * towards.z;
        assert!((0.95..1.1).contains(&facing), "{facing}");
        assert!(
            ambient >= 0.3 && towards.y > 0.0 && towards.x < 0.0,
            "over the left shoulder, never black"
        );
    }
}
