//! What lets a volume's inside be seen, on the device (`shaders/lib/slabs.wgsl`).

use super::layout::{self, MOST_CLIPS, narrow, narrow4};
use super::shade::CellsOfValues;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::{AlongRay, CutFaces, HalfSpace, View};

/// What of it a pipeline is made for: what is not asked for is not compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(super) struct InsideVariant {
    /// Planes that cut.
    pub planes: u32,
    /// Whether matter shows its value where it is cut.
    pub cut_faces: bool,
    /// Slices.
    pub slices: u32,
    /// Whether edges of cells are shown on any.
    pub edges: bool,
    /// Isosurfaces.
    pub levels: u32,
    /// What stands for a ray.
    pub along: AlongRay,
}

impl InsideVariant {
    /// Surfaces that a ray may meet.
    pub(super) fn surfaces(&self) -> u32 {
        u32::from(self.cut_faces) + self.slices + self.levels
    }

    /// The shader's overrides.
    pub(super) fn constants(&self) -> Vec<(&'static str, f64)> {
        let mut constants = Vec::new();
        let along = match self.along {
            AlongRay::Composite => None,
            AlongRay::Maximum => Some(1.0),
            AlongRay::Minimum => Some(2.0),
            AlongRay::Average => Some(3.0),
        };
        constants.extend(along.map(|along| ("along", along)));
        constants.push(("clip_planes", f64::from(self.planes)));
        if self.along == AlongRay::Composite {
            constants.push(("has_surfaces", f64::from(u8::from(self.surfaces() > 0))));
            constants.push(("cut_faces", f64::from(u8::from(self.cut_faces))));
            constants.push(("slices", f64::from(self.slices)));
            constants.push(("edges", f64::from(u8::from(self.edges))));
        }
        if self.levels > 0 {
            constants.push(("levels", f64::from(self.levels)));
        }
        constants
    }
}

/// A half space as rays of a view meet it: what adds up to its height over a place so many pixels to the right and up at the
/// depth 0, and so deep, and the height in the picture's middle.
pub(super) fn in_view(half: &HalfSpace, view: &View) -> [f32; 4] {
    let index_from_view = view.view_from_index.inverse();
    let beside = index_from_view * view.view_centre.truncate().extend(0.0);
    let height = half.normal.dot(view.lattice_centre - beside) - half.least;
    narrow4(index_from_view.transpose() * half.normal, height)
}

/// What a scene is opened by, ready for fields of any size.
#[derive(Debug, Clone)]
pub(super) struct Opening {
    pub variant: InsideVariant,
    clip: Vec<HalfSpace>,
    /// Planes, opacities, whether what has none by the table is left out, and whether edges of cells are shown.
    slices: Vec<(HalfSpace, f64, [bool; 2])>,
    /// Values, linear colours, opacities.
    levels: Vec<(f64, [f32; 3], f64)>,
}

impl Opening {
    /// `None` where a plan asks for nothing, or has no field.
    pub(super) fn of(plan: &Plan) -> Option<Self> {
        let (field, lattice, inside) = (plan.field()?, &plan.frame.lattice, &plan.inside);
        let clip = inside.clip.half_spaces(lattice);
        let composites = inside.along == AlongRay::Composite;
        // Values that are projected have neither faces nor surfaces.
        let slices: Vec<_> = inside
            .slices
            .iter()
            .filter(|_| composites)
            .map(|slice| {
                let looks = [slice.only_shown, slice.edges];
                (slice.plane.in_index(lattice), slice.opacity, looks)
            })
            .collect();
        let levels: Vec<_> = inside
            .isosurfaces
            .iter()
            .filter(|_| composites)
            .map(|iso| (iso.value, iso.linear_colour(&field.transfer), iso.opacity))
            .collect();
        let count = |n: usize| u32::try_from(n).unwrap_or_default();
        let variant = InsideVariant {
            planes: u32::try_from(clip.len().min(MOST_CLIPS)).unwrap_or_default(),
            cut_faces: inside.clip.faces == CutFaces::Coloured && !clip.is_empty() && composites,
            slices: count(slices.len()),
            edges: plan.mode.kernel == Kernel::Cells
                && slices.iter().any(|(.., [_, edges])| *edges),
            levels: count(levels.len()),
            along: inside.along,
        };
        (variant != InsideVariant::default()).then_some(Self { variant, clip, slices, levels })
    }

    /// Writes it for a field that was halved `level` times.
    pub(super) fn write(&self, constants: &mut layout::Slabs, level: u32, values: CellsOfValues) {
        let words = |half: &HalfSpace| {
            let HalfSpace { normal, least } = half.halved(level);
            narrow4(normal, least)
        };
        for (to, half) in constants.clip.iter_mut().zip(&self.clip) {
            *to = words(half);
        }
        for (i, (half, opacity, [only_shown, edges])) in self.slices.iter().enumerate() {
            constants.slices[i] = words(half);
            constants.opacities[i][1] = narrow(*opacity);
            constants.opacities[i][2] = f32::from(u8::from(*only_shown));
            constants.opacities[i][3] = f32::from(u8::from(*edges));
        }
        for (i, (value, [r, g, b], opacity)) in self.levels.iter().enumerate() {
            let cell = values.at_zero + values.per_value * value;
            constants.levels[i] = [*r, *g, *b, narrow(cell)];
            constants.opacities[i][0] = narrow(*opacity);
        }
    }
}
