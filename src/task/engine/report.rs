//! A drawn picture with what is known of it.

use super::{FrameReport, KernelCounts, Picture};
use crate::scene::{Backend, Effect, Inside, Scene};
use crate::task::draw::Drawn;
use crate::task::level::LevelOfDetail;

/// What of a scene's shading, and of what lets its inside be seen, was drawn.
fn effects(scene: &Scene, drawn: &Drawn) -> Vec<Effect> {
    let mut effects = match drawn.is_shaded {
        true if Inside::is_shown_by(&scene.splat) => scene.effects(),
        true => {
            let shown = [Effect::Vectors, Effect::SecondVectors, Effect::Polygons];
            let others = scene.effects().into_iter().filter(|effect| shown.contains(effect));
            scene.shading.effects().into_iter().chain(others).collect()
        }
        false if !scene.shows_field() => scene.effects(),
        false => Vec::new(),
    };
    // Single values pass no level.
    if scene.splat.classify.takes_one_value() {
        effects.retain(|effect| *effect != Effect::Isosurfaces);
    }
    effects
}

/// What was drawn, with what is known of it.
pub(super) fn picture(
    (scene, size): (&Scene, [u32; 2]),
    (level, progress): (LevelOfDetail, f32),
    drawn: &Drawn,
    rgba: Vec<u8>,
    kernels_active: Option<u64>,
) -> Picture {
    let total = scene.voxel_count();
    let report = FrameReport {
        effects: effects(scene, drawn),
        made_pipelines: drawn.made_pipelines,
        awaits_cut: drawn.awaits_cut && !drawn.is_whole(size),
        kernels: kernels_active.map(|active| KernelCounts { drawn: drawn.kernels, active }),
        vector_splats: (!scene.shows_field()).then_some(drawn.kernels),
        own_kernels: scene.own_kernels().filter(|_| scene.shows_field()),
        left_out_of_quick: scene.left_out_of_quick().filter(|_| scene.shows_field()),
        left_out_functions: scene.left_out_functions().filter(|_| scene.shows_field()),
        progress,
        ..FrameReport::last(level, total, Backend::Raster, drawn.wall_ms)
    };
    Picture { size: drawn.size, requested_size: size, rgba, report }
}
