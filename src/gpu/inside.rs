//! What lets a volume's inside be seen, on the device (`shaders/lib/inside.wgsl`).

use super::layout::{self, MOST_CLIPS};
use crate::scene::{AlongRay, CutFaces, HalfSpace, Scene};

/// What of it a pipeline is made for: what is not asked for is not compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(super) struct InsideVariant {
    /// Planes that cut.
    pub planes: u32,
    /// Whether matter shows its value where it is cut.
    pub cut_faces: bool,
    /// What stands for a ray.
    pub along: AlongRay,
}

impl InsideVariant {
    /// Whether rays are shortened.
    pub(super) fn is_clipped(&self) -> bool {
        self.planes > 0
    }

    /// Whether its constants are asked for.
    pub(super) fn is_bound(&self) -> bool {
        self.is_clipped() || self.surfaces() > 0
    }

    /// Surfaces that a ray may meet.
    pub(super) fn surfaces(&self) -> u32 {
        u32::from(self.cut_faces)
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
        if self.is_clipped() {
            constants.push(("clip_planes", f64::from(self.planes)));
        }
        if self.surfaces() > 0 {
            constants.push(("cut_faces", f64::from(u8::from(self.cut_faces))));
        }
        constants
    }
}

/// What a scene is opened by, ready for fields of any size.
#[derive(Debug, Clone)]
pub(super) struct Opening {
    pub variant: InsideVariant,
    clip: Vec<HalfSpace>,
}

impl Opening {
    /// `None` where a scene asks for nothing.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        if scene.vectors.is_some() {
            // They are drawn beside fields that are whole: asking for both is refused.
            return None;
        }
        let clip = scene.inside.clip.half_spaces(&scene.volume.lattice);
        let variant = InsideVariant {
            planes: u32::try_from(clip.len().min(MOST_CLIPS)).unwrap_or_default(),
            // Values that are projected have no faces.
            cut_faces: scene.inside.clip.faces == CutFaces::Coloured
                && !clip.is_empty()
                && scene.inside.along == AlongRay::Composite,
            along: scene.inside.along,
        };
        (variant != InsideVariant::default()).then_some(Self { variant, clip })
    }

    /// The shader's uniform for a field that was halved `level` times.
    pub(super) fn constants(&self, level: u32) -> layout::Inside {
        let mut constants: layout::Inside = bytemuck::Zeroable::zeroed();
        for (to, half) in constants.clip.iter_mut().zip(&self.clip) {
            let HalfSpace { normal, least } = half.halved(level);
            #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
            let words = normal.as_vec3().extend(least as f32).to_array();
            *to = words;
        }
        constants
    }
}
