//! The loops that draw a tile, compiled for each instruction set.
//!
//! Each loop has a module of its own: the compiler makes code of modules side by side, and these take most of its time.

use fearless_simd::Level;

use super::lattice::{Method, by};
use super::passing::Alone;
use super::splatted::Splatted;
use super::walk::{Lit, LitCut, Pixel, Plain, PlainCut, Rich, RichCut, Scene};
use crate::scene::AlongRay;

/// What a tile is drawn from.
#[derive(Clone, Copy)]
pub(super) enum What<'a> {
    /// Slabs of a field, with all that stands in it.
    Slabs(Scene<'a>),
    /// Values along rays.
    Values(Scene<'a>, AlongRay),
    /// Kernels that are shaded first, with all that lies among them.
    Splatted(Splatted<'a>),
    /// Kernels of lists, and polygons, without a field.
    Alone(Alone<'a>),
}

/// Whether there are loops of their own for cuts of a field, and for plain pictures, with the instructions of a level. Each loop
/// takes its time to compile, and where these are narrow they gain less: there are no cuts there, and loops with effects draw
/// plain pictures, too.
pub(super) fn has_all(level: Level) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return level.as_avx2().is_some();
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    {
        let _ = level;
        true
    }
}

/// What draws a tile of slabs with the instructions of a level.
type DrawsSlabs = fn(Level, &Scene<'_>, usize, &mut [Pixel]) -> u64;

/// A loop and its name.
type Loop = (&'static str, DrawsSlabs);

/// The loop of slabs of a field: of its method, the one that has no more in it than is asked for.
fn of_slabs(level: Level, scene: &Scene<'_>) -> Loop {
    let asked = match (scene.has_no_more() && has_all(level), scene.light) {
        (true, None) => 0,
        (true, Some(_)) => 1,
        (false, _) => 2,
    };
    // Those of effects draw what is lit alone, too.
    let without_lit = |[plain, rich]: [Loop; 2]| [plain, rich, rich];
    let loops: [Loop; 3] = match (scene.levels, scene.lattice.method()) {
        (Some(_), Method::BSpline) => [
            ("a cut of B-splines, plain", plain_cut_bspline::draw),
            ("a cut of B-splines, lit", lit_cut_bspline::draw),
            ("a cut of B-splines, with effects", rich_cut_bspline::draw),
        ],
        (Some(_), _) => [
            ("a cut of tents, plain", plain_cut_linear::draw),
            ("a cut of tents, lit", lit_cut_linear::draw),
            ("a cut of tents, with effects", rich_cut_linear::draw),
        ],
        (None, Method::BSpline) => [
            ("slabs of B-splines, plain", plain_bspline::draw),
            ("slabs of B-splines, lit", lit_bspline::draw),
            ("slabs of B-splines, with effects", rich_bspline::draw),
        ],
        (None, Method::Linear) => [
            ("slabs of tents, plain", plain_linear::draw),
            ("slabs of tents, lit", lit_linear::draw),
            ("slabs of tents, with effects", rich_linear::draw),
        ],
        (None, Method::Functions) => without_lit([
            ("slabs of functions, plain", plain_functions::draw),
            ("slabs of functions, with effects", rich_functions::draw),
        ]),
        (None, Method::Cells) => without_lit([
            ("slabs of cells, plain", plain_cells::draw),
            ("slabs of cells, with effects", rich_cells::draw),
        ]),
        (None, Method::Other) => without_lit([
            ("slabs of any kernel, plain", plain_other::draw),
            ("slabs of any kernel, with effects", rich_other::draw),
        ]),
    };
    loops[asked]
}

impl What<'_> {
    /// The name of the loop that draws it, for people and statistics. A lit one has lights and shading tables in it, and a plain
    /// one not even these; other effects are surfaces, kernels of lists, samples without data, and the rarer rules of compositing.
    pub(super) fn loop_name(&self, level: Level) -> &'static str {
        match self {
            Self::Alone(_) => "lists alone",
            Self::Splatted(_) => "kernels shaded first",
            Self::Values(..) => "values along rays",
            Self::Slabs(scene) => of_slabs(level, scene).0,
        }
    }
}

/// Draws a tile with the instructions of a level; opacities that were over 1, and lowered to it.
pub(super) fn draw_tile(level: Level, what: &What<'_>, tile: usize, out: &mut [Pixel]) -> u64 {
    match what {
        What::Alone(alone) => of_lists::draw(level, alone, tile, out),
        What::Splatted(splatted) => shaded_first::draw(level, splatted, tile, out),
        What::Values(scene, along) => along_rays::draw(level, &(scene, *along), tile, out),
        What::Slabs(scene) => of_slabs(level, scene).1(level, scene, tile, out),
    }
}

/// A loop: with AVX2 where the level has it, and else with what this kind of processor has at least; `wide` ones are drawn
/// with AVX2 alone where there are processors with and without it ([`has_all`]).
macro_rules! compiled {
    (wide $name:ident($what:ident: $kind:ty) => |$simd:ident, $tile:ident, $out:ident| $draw:expr) => {
        compiled!(@module $name($what: $kind) => |$simd, $tile, $out| $draw, {
            #[cfg(target_arch = "x86_64")]
            fn narrow(_: Level, _: $kind, _: usize, _: &mut [Pixel]) -> u64 {
                unreachable!("asked for where there is AVX2")
            }
        });
    };
    (@module $name:ident($what:ident: $kind:ty) => |$simd:ident, $tile:ident, $out:ident| $draw:expr, { $($narrow:tt)* }) => {
        mod $name {
            use super::*;

            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            fearless_simd::kernel!(
                fn avx2($simd: Avx2, $what: $kind, $tile: usize, $out: &mut [Pixel]) -> u64 {
                    $draw
                }
            );

            $($narrow)*

            /// Any other level has what its kind of processor has at least.
            #[cfg(not(target_arch = "x86_64"))]
            fn narrow(_: Level, $what: $kind, $tile: usize, $out: &mut [Pixel]) -> u64 {
                fearless_simd::dispatch!(Level::baseline(), $simd => fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $draw,
                ))
            }

            pub(super) fn draw(
                level: Level,
                $what: $kind,
                $tile: usize,
                $out: &mut [Pixel],
            ) -> u64 {
                #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
                if let Some(simd) = level.as_avx2() {
                    return avx2(simd, $what, $tile, $out);
                }
                narrow(level, $what, $tile, $out)
            }
        }
    };
    ($name:ident($what:ident: $kind:ty) => |$simd:ident, $tile:ident, $out:ident| $draw:expr) => {
        compiled!(@module $name($what: $kind) => |$simd, $tile, $out| $draw, {
            #[cfg(target_arch = "x86_64")]
            fearless_simd::kernel!(
                fn sse2($simd: Sse2, $what: $kind, $tile: usize, $out: &mut [Pixel]) -> u64 {
                    $draw
                }
            );

            #[cfg(target_arch = "x86_64")]
            fn narrow(level: Level, $what: $kind, $tile: usize, $out: &mut [Pixel]) -> u64 {
                match level.as_sse2() {
                    Some(simd) => sse2(simd, $what, $tile, $out),
                    None => unreachable!("each of these processors has SSE2"),
                }
            }
        });
    };
}

compiled!(wide plain_bspline(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Plain, by::BSpline>(simd, tile, out)
});
compiled!(wide lit_bspline(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Lit, by::BSpline>(simd, tile, out)
});
compiled!(rich_bspline(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Rich, by::BSpline>(simd, tile, out)
});
compiled!(wide plain_linear(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Plain, by::Linear>(simd, tile, out)
});
compiled!(wide lit_linear(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Lit, by::Linear>(simd, tile, out)
});
compiled!(rich_linear(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Rich, by::Linear>(simd, tile, out)
});
compiled!(wide plain_other(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Plain, by::Other>(simd, tile, out)
});
compiled!(rich_other(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Rich, by::Other>(simd, tile, out)
});
compiled!(wide plain_functions(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Plain, by::Functions>(simd, tile, out)
});
compiled!(rich_functions(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Rich, by::Functions>(simd, tile, out)
});
compiled!(wide plain_cells(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Plain, by::Cells>(simd, tile, out)
});
compiled!(rich_cells(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, Rich, by::Cells>(simd, tile, out)
});
compiled!(wide plain_cut_bspline(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, PlainCut, by::BSpline>(simd, tile, out)
});
compiled!(wide lit_cut_bspline(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, LitCut, by::BSpline>(simd, tile, out)
});
compiled!(wide rich_cut_bspline(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, RichCut, by::BSpline>(simd, tile, out)
});
compiled!(wide plain_cut_linear(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, PlainCut, by::Linear>(simd, tile, out)
});
compiled!(wide lit_cut_linear(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, LitCut, by::Linear>(simd, tile, out)
});
compiled!(wide rich_cut_linear(scene: &Scene<'_>) => |simd, tile, out| {
    scene.tile::<_, RichCut, by::Linear>(simd, tile, out)
});
compiled!(along_rays(what: &(&Scene<'_>, AlongRay)) => |simd, tile, out| {
    what.0.projected_tile(simd, what.0.lattice.method(), what.1, tile, out);
    0
});
compiled!(shaded_first(splatted: &Splatted<'_>) => |simd, tile, out| splatted.tile(simd, tile, out));
compiled!(of_lists(alone: &Alone<'_>) => |simd, tile, out| alone.tile(simd, tile, out));
