//! What is said of a picture beside it: why nothing is seen in it, and what changes nothing.

use super::flags::SceneFlags;
use super::shading::ShadingFlags;
use crate::core::{Srgb8, Ticket, counted};
use crate::kernel::Kernel;
use crate::scene::{AlongRay, Annotation, Background, Inside, MOST_SLABS_PER_VOXEL, Scene};
use crate::task::still::{CONVERGED, Convergence};
use crate::volume::{Association, Component, Field, Grid, Shape, VolumeError};

/// What of a scene may be why nothing is seen of it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Causes {
    hides_voxels: bool,
    is_cut: bool,
    is_lit: bool,
    has_isosurfaces: bool,
    has_slices: bool,
    /// What the field is drawn as, other than voxels.
    drawn_as: Option<&'static str>,
}

impl Causes {
    pub(super) fn of(scene: &Scene) -> Self {
        let (shading, inside) = (&scene.shading, &scene.inside);
        Self {
            drawn_as: match scene.splat.kernel {
                Kernel::Cells => Some("cells"),
                Kernel::Ellipsoids => Some("points"),
                Kernel::Functions => Some("basis functions"),
                _ => None,
            },
            hides_voxels: shading.opacity.is_some() || shading.modulation.is_some(),
            is_cut: inside.clip.cuts(),
            is_lit: shading.lighting.is_some() && inside.along == AlongRay::Composite,
            has_isosurfaces: inside.has_isosurfaces(),
            has_slices: !inside.slices.is_empty(),
        }
    }

    /// Where a picture of surfaces by themselves shows nothing.
    pub(super) fn no_surface_seen(self) -> String {
        match self.is_cut {
            true => self.nothing_seen(0),
            false => "nothing can be seen in the picture; look at the camera".to_owned(),
        }
    }

    /// Where a picture shows nothing: so many of its voxels have opacity.
    pub(super) fn nothing_seen(self, active: u64) -> String {
        match active {
            _ if self.is_cut => {
                "nothing can be seen in the picture; look at --clip-box and --clip-plane, which say what \
                 is kept of the volume, at the opacities and the camera"
                    .to_owned()
            }
            0 if self.has_isosurfaces || self.has_slices => {
                "nothing can be seen in the picture, as no voxel has opacity and no surface is in view; \
                 look at the values and places of --iso and --slice and at their own opacities, at \
                 --opacity and the camera"
                    .to_owned()
            }
            _ if self.hides_voxels => {
                "nothing can be seen in the picture; look at the tables of --opacity-by and --modulation, \
                 which say how much of each voxel shows, and at the camera"
                    .to_owned()
            }
            0 => format!(
                "nothing can be seen in the picture, as {} opacity; look at --opacity and at the range of the data, \
                 which `voxsplat info` tells{}",
                // Where cells overlap, those that are not drawn may have some.
                self.drawn_as.map_or("no voxel has".to_owned(), |what| format!("nothing that is drawn of the {what} has")),
                match self.drawn_as {
                    Some("cells") => "; of cells that overlap, which it counts, only the first is drawn",
                    _ => "",
                }
            ),
            active => format!(
                "nothing can be seen in the picture, though {} opacity; look at the \
                 opacities, at --opacity-unit-distance, which they are given over, the extent and the \
                 camera",
                match (self.drawn_as, active) {
                    (Some(what), _) => format!("the {what} have"),
                    (None, 1) => "1 voxel has".to_owned(),
                    (None, active) => format!("{active} voxels have"),
                }
            ),
        }
    }

    /// Where all that is seen has the background's colour.
    pub(super) fn one_colour(self, active: u64) -> String {
        // An isosurface has one colour, and no range puts another into it that was chosen for it.
        let why = match active {
            0 if self.has_isosurfaces => {
                "an isosurface has the colour of its value, or the one it is given: choose it as with \
                 --iso V:1:RRGGBB"
            }
            _ => "look at --color-range, beyond which values have the colours of its ends",
        };
        let lights = match self.is_lit {
            true => ", look at the lights (--light, --ambient), without which all is dark",
            false => "",
        };
        format!(
            "nothing can be told from the background, though there is opacity: what is seen has its \
             colour; {why}{lights}, or choose another --background"
        )
    }
}

/// How many points or cells of a mesh have no value of a field, and what becomes of these. `None` of points by themselves, which say it
/// as bodies, and of other grids.
///
/// # Errors
/// No such component, too little memory.
pub(super) fn without_value(
    grid: &Grid,
    field: &Field,
    component: Component,
) -> Result<Option<String>, VolumeError> {
    let is_surface = match &grid.shape {
        Shape::Unstructured(cells) if cells.is_surface() => true,
        Shape::Unstructured(cells) if !cells.solids().is_empty() => false,
        Shape::Curvilinear(_) => false,
        _ => return Ok(None),
    };
    let values = grid.samples_of(field, component, &Ticket::new())?;
    let without = (0..values.len()).filter(|i| values.get(*i).is_nan()).count();
    let [has, it, is] = if without == 1 { ["has", "it", "is"] } else { ["have", "them", "are"] };
    let fate = match (is_surface, field.association) {
        (true, _) => format!(": the surface has a plain colour at {it}"),
        (false, Association::Cell) => format!(" and {is} not drawn"),
        (false, Association::Point) => format!(": what lies about {it} is not drawn"),
    };
    let of = counted(values.len(), field.association.name());
    Ok((without > 0)
        .then(|| format!("{without} of {of} {has} no value of {:?} (NaN){fate}", field.name)))
}

/// Whether all pixels have the background's colour, to a step of their bytes.
pub(super) fn is_one_colour(rgba: &[u8], background: Background) -> bool {
    let Background::Colour(Srgb8(behind)) = background else { return false };
    let is_near = |pixel: &[u8]| pixel.iter().zip(behind).all(|(a, b)| a.abs_diff(b) <= 1);
    rgba.chunks_exact(4).all(|pixel| is_near(&pixel[..3]))
}

/// Which annotations a picture is too small for, or has nothing of.
pub(super) fn no_room(left_out: &[Annotation]) -> String {
    let names: Vec<_> = left_out.iter().map(|which| which.name()).collect();
    format!(
        "the picture has no room for some of --annotations, which were left out: {}; try a larger \
         --resolution, or another view",
        names.join(", ")
    )
}

/// Flags that change nothing of values that are projected, if any were given: no light falls on these,
/// and they are seen whatever their opacity.
pub(super) fn idle_beside_projection(
    inside: &Inside,
    scene: &SceneFlags,
    shading: &ShadingFlags,
    of_hiding: Vec<&'static str>,
) -> Option<String> {
    if inside.along == AlongRay::Composite {
        return None;
    }
    let fades = inside.is_faded.then_some("--fade");
    let of_opacities = scene.of_opacities().into_iter().chain(shading.given());
    let idle: Vec<_> = of_opacities.chain(of_hiding).chain(fades).collect();
    let (last, others) = idle.split_last()?;
    let (names, change) = match others {
        [] => ((*last).to_owned(), "changes"),
        _ => (format!("{} and {last}", others.join(", ")), "change"),
    };
    Some(format!(
        "values that are projected have the transfer function's colours, unlit and whatever their \
         opacities: {names} {change} nothing in the picture"
    ))
}

/// How doubling the slabs ended without two pictures alike.
pub(super) fn did_not_converge(convergence: &Convergence) -> String {
    let slabs = convergence.slabs_per_voxel;
    let most = MOST_SLABS_PER_VOXEL;
    match convergence.last_difference {
        Some(difference) => format!(
            "the picture did not converge: with {slabs} slabs per voxel, which cannot be doubled \
             again (at most {most}), a pixel still changed by {} of full brightness, not less than {}",
            percent(difference),
            percent(CONVERGED)
        ),
        None => format!(
            "whether the picture converged is not known: {slabs} slabs per voxel cannot be doubled \
             (at most {most}); choose fewer --slabs-per-voxel to begin with"
        ),
    }
}

/// A share in percent, with two digits that matter.
fn percent(share: f64) -> String {
    match 100.0 * share {
        percent if percent >= 9.95 => format!("{percent:.0} %"),
        percent if percent >= 0.995 => format!("{percent:.1} %"),
        percent => format!("{percent:.2} %"),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::flags::{Arguments, Command};

    #[test]
    fn a_picture_of_nothing_says_whether_anything_could_be_seen() {
        let plain = Causes::default();
        let (none, some) = (plain.nothing_seen(0), plain.nothing_seen(208));
        assert!(none.contains("no voxel has opacity") && none.contains("--opacity"), "{none}");
        assert!(some.contains("though 208 voxels") && some.contains("the camera"), "{some}");
        let opened = Causes { has_isosurfaces: true, ..plain };
        assert!(opened.nothing_seen(0).contains("--iso and --slice"));
        assert_eq!(opened.nothing_seen(208), some);
        let on_cells = Causes { drawn_as: Some("cells"), ..plain };
        let (none, some) = (on_cells.nothing_seen(0), on_cells.nothing_seen(208));
        assert!(
            none.contains("nothing that is drawn of the cells has opacity")
                && none
                    .ends_with("of cells that overlap, which it counts, only the first is drawn")
                && some.contains("though the cells have"),
            "{some}"
        );
        assert!(!none.contains("voxel") && !some.contains("voxel"), "{none}");
    }

    #[test]
    fn a_black_isosurface_is_blamed_on_its_colour_and_lights_and_not_on_the_range() {
        let plain = Causes::default();
        assert!(plain.one_colour(5).contains("--color-range"));
        assert!(!plain.one_colour(5).contains("lights"));
        assert!(Causes { is_lit: true, ..plain }.one_colour(5).contains("--ambient"));
        let opened = Causes { has_isosurfaces: true, ..plain };
        let said = opened.one_colour(0);
        assert!(said.contains("--iso V:1:RRGGBB") && !said.contains("--color-range"), "{said}");
        assert!(Causes { is_lit: true, ..opened }.one_colour(0).contains("--ambient"));
        assert_eq!(opened.one_colour(5), plain.one_colour(5), "matter is seen too");
    }

    #[test]
    fn a_picture_in_the_colour_of_its_background_is_known() {
        let grey = Background::Colour(Srgb8([7, 8, 9]));
        assert!(is_one_colour(&[7, 8, 9, 255, 8, 8, 8, 255], grey));
        assert!(!is_one_colour(&[7, 8, 9, 255, 7, 8, 11, 255], grey));
        assert!(!is_one_colour(&[0; 4], Background::Transparent), "alpha can be seen");
    }

    #[test]
    fn what_a_projection_shows_nothing_of_is_named() {
        let said = |along, more: &[&str]| {
            let line = ["voxsplat", "probe", "x", "--at", "0,0"];
            let parsed = Arguments::try_parse_from(line.iter().chain(more)).expect("flags");
            let Some(Command::Probe(flags)) = parsed.command else { panic!("a probe") };
            let inside = Inside { along, ..Inside::default() };
            idle_beside_projection(&inside, &flags.scene, &flags.shading, vec!["--order"])
        };
        let greatest = |more: &[&str]| said(AlongRay::Maximum, more);
        let mode = greatest(&["--colormap", "gray", "--color-range", "0,1"]).expect("a note");
        assert!(mode.ends_with("--order changes nothing in the picture"), "{mode}");
        let lit = greatest(&["--light", "0,0,1", "--nan-color", "ff0000"]).expect("a note");
        assert!(
            lit.ends_with("--nan-color, --light and --order change nothing in the picture"),
            "{lit}"
        );
        let tables = greatest(&["--modulation", "value:0:1"]).expect("a note");
        assert!(
            tables.ends_with("--modulation and --order change nothing in the picture"),
            "{tables}"
        );
        let line = ["voxsplat", "probe", "x", "--at", "0,0"];
        let Some(Command::Probe(flags)) = Arguments::try_parse_from(line).expect("flags").command
        else {
            panic!("a probe")
        };
        let faded = Inside { along: AlongRay::Average, is_faded: true, ..Inside::default() };
        let faded = idle_beside_projection(&faded, &flags.scene, &flags.shading, Vec::new());
        assert!(faded.expect("a note").ends_with("--fade changes nothing in the picture"));
        assert_eq!(said(AlongRay::Composite, &["--light", "0,0,1"]), None);
    }

    #[test]
    fn what_did_not_converge_says_by_how_much_and_what_cannot_be_known_says_that() {
        let ended = |slabs_per_voxel, last_difference| {
            did_not_converge(&Convergence { slabs_per_voxel, last_difference })
        };
        let changed = ended(48.0, Some(0.0123));
        assert!(changed.contains("did not converge: with 48 slabs"), "{changed}");
        assert!(
            changed.contains("changed by 1.2 % of full brightness, not less than 0.20 %"),
            "{changed}"
        );
        let alone = ended(64.0, None);
        assert!(alone.contains("not known: 64 slabs") && !alone.contains("changed"), "{alone}");
    }
}
