//! Modes as the hand chooses them: the last choice holds, and what contradicts it gives way.

use super::panels::SPLATS;
use super::words;
use crate::kernel::{Kernel, Subdivisions};
use crate::rbf::Limits;
use crate::scene::{
    Backend, Classify, ModeChoice, Order, Reconstruction, SplatSettings, Visibility,
};

/// The modes with a name of their own: what the buttons say, the settings, and what they are.
pub const PRESETS: [(&str, SplatSettings, &str); 2] = [
    (
        "Exact",
        SplatSettings::EXACT,
        "The best picture of the data: values are interpolated first, then coloured, slab by slab",
    ),
    (
        "Classic splatting",
        SplatSettings::SHADE_FIRST,
        "Westover's splatting: every sample is coloured first and laid down as a soft footprint",
    ),
];

/// `now` with what was just chosen. The choice always holds; each other setting stays where it goes
/// with the choice, and otherwise takes the value that does.
///
/// A choice that contradicts itself changes nothing.
pub fn changed(now: &SplatSettings, chosen: ModeChoice) -> SplatSettings {
    let mut choice = chosen;
    // What decides most is kept first.
    keep(&mut choice, |c| c.visibility = c.visibility.or(Some(now.visibility)));
    keep(&mut choice, |c| c.classify = c.classify.or(Some(now.classify)));
    keep(&mut choice, |c| c.kernel = c.kernel.or(Some(now.kernel)));
    keep(&mut choice, |c| c.functions = c.functions.or(Some(now.functions)));
    // What is left out everywhere goes with means of slabs, too.
    let everywhere = Limits { per_cell: None, ..now.functions };
    keep(&mut choice, |c| c.functions = c.functions.or(Some(everywhere)));
    keep(&mut choice, |c| c.quick_functions = c.quick_functions.or(now.quick_functions));
    keep(&mut choice, |c| c.reconstruction = c.reconstruction.or(Some(now.reconstruction)));
    keep(&mut choice, |c| c.extent = c.extent.or(now.extent));
    keep(&mut choice, |c| c.backend = c.backend.or(Some(now.backend)));
    keep(&mut choice, |c| c.opacity_model = c.opacity_model.or(Some(now.opacity_model)));
    keep(&mut choice, |c| c.slabs_per_voxel = c.slabs_per_voxel.or(Some(now.slabs_per_voxel)));
    if now.order != usual_order(now.visibility) {
        keep(&mut choice, |c| c.order = c.order.or(Some(now.order)));
    }
    // A number of sheets would choose sheets where nothing else is chosen.
    if let Ok(settings) = choice.resolve() {
        choice.visibility = Some(settings.visibility);
        let sheets = Some(now.sheets_per_kernel);
        keep(&mut choice, |c| c.sheets_per_kernel = c.sheets_per_kernel.or(sheets));
        // And one of angles or rings a mesh.
        choice.kernel = Some(settings.kernel);
        choice.gouraud_angles = choice.gouraud_angles.or(Some(now.gouraud.angles));
        choice.gouraud_rings = choice.gouraud_rings.or(Some(now.gouraud.rings));
    }
    choice.cut = choice.cut.or(Some(now.cut));
    choice.opacity_unit_distance = chosen.opacity_unit_distance.or(now.opacity_unit_distance);
    choice.resolve().unwrap_or(*now)
}

/// Makes a choice more definite, unless it would contradict itself.
fn keep(choice: &mut ModeChoice, add: impl FnOnce(&mut ModeChoice)) {
    let mut more = *choice;
    add(&mut more);
    if more.resolve().is_ok() {
        *choice = more;
    }
}

/// The order in which a way of hiding is composited where nobody chooses.
fn usual_order(visibility: Visibility) -> Order {
    match visibility {
        Visibility::EverySample => SplatSettings::SHADE_FIRST.order,
        Visibility::Sheets | Visibility::Slabs => SplatSettings::EXACT.order,
    }
}

/// `mode` for the data of `now`: the unit distance belongs to the data, not to the mode, and how octree
/// cuts are fitted, and what else quick pictures are of, to neither.
pub fn with_unit_distance_of(mode: SplatSettings, now: &SplatSettings) -> SplatSettings {
    let SplatSettings { opacity_unit_distance, cut, quick_functions, .. } = *now;
    SplatSettings { opacity_unit_distance, cut, quick_functions, ..mode }
}

/// Whether two settings are the same mode, whatever the unit distance, the octree cuts and, where no functions are drawn, the
/// limits of these.
pub fn same_mode(a: &SplatSettings, b: &SplatSettings) -> bool {
    let functions = if a.limits() == b.limits() { b.functions } else { a.functions };
    with_unit_distance_of(SplatSettings { functions, ..*a }, b) == *b
}

/// What the side panel's section of the mode is called: cells and points that are drawn as they are are no splats.
pub fn section(settings: &SplatSettings) -> &'static str {
    if is_of_cells_or_points(settings) { "Drawing" } else { SPLATS }
}

/// Whether cells or points are drawn as they are, without evenly spaced samples in between.
pub fn is_of_cells_or_points(settings: &SplatSettings) -> bool {
    matches!(settings.kernel, Kernel::Cells | Kernel::Ellipsoids)
}

/// Whether a finished picture of these settings is the exact one, up to the width of its slabs.
pub fn is_exact(settings: &SplatSettings) -> bool {
    let exact = SplatSettings::EXACT;
    let is_natural = |extent: f64| settings.kernel.natural_extent().is_none_or(|own| own == extent);
    settings.kernel == exact.kernel
        && settings.extent.is_none_or(is_natural)
        && settings.visibility == exact.visibility
        && settings.classify == exact.classify
        && settings.reconstruction == exact.reconstruction
        && settings.opacity_model == exact.opacity_model
        && settings.slabs_per_voxel >= exact.slabs_per_voxel
}

/// Whether a mode is one of [`PRESETS`]: the exact one with more slabs is the exact one.
pub fn is_preset(settings: &SplatSettings, preset: &SplatSettings) -> bool {
    same_mode(settings, preset) || (is_exact(preset) && is_exact(settings))
}

/// A mode in a few words: `B-spline, interpolating, pre-integrated, 2 slabs a voxel`.
pub fn name(settings: &SplatSettings) -> String {
    let mut parts = vec![words::kernel(settings.kernel)];
    if settings.kernel == Kernel::Gouraud && settings.gouraud != Subdivisions::default() {
        parts.push(format!("{} × {}", settings.gouraud.angles, settings.gouraud.rings));
    }
    let is_of_samples = settings.kernel.is_of_samples();
    if settings.reconstruction == Reconstruction::Interpolating && is_of_samples {
        parts.push("interpolating".to_owned());
    }
    if settings.classify != Classify::Before {
        parts.push(settings.classify.name().to_owned());
    }
    parts.push(match settings.visibility {
        Visibility::EverySample => "every sample".to_owned(),
        Visibility::Sheets if settings.sheets_per_kernel == 1 => "sheets".to_owned(),
        Visibility::Sheets => format!("{} sheets a kernel", settings.sheets_per_kernel),
        Visibility::Slabs => slabs(settings.slabs_per_voxel, is_of_samples),
    });
    if settings.opacity_model == crate::scene::OpacityModel::Published {
        parts.push("published".to_owned());
    }
    if settings.order != usual_order(settings.visibility) {
        parts.push(settings.order.name().to_owned());
    }
    if settings.backend != Backend::Auto {
        parts.push(settings.backend.name().to_owned());
    }
    if let Some(extent) = settings.extent {
        parts.push(format!("radius {}", words::value(extent)));
    }
    let Limits { per_cell, corrects, max_rms } = settings.limits();
    if let Some(most) = per_cell {
        let corrected = if corrects { "" } else { " uncorrected" };
        parts.push(format!("{most} functions a cell{corrected}"));
    }
    if max_rms > 0.0 {
        parts.push(format!("functions to {}", words::value(max_rms)));
    }
    parts.join(", ")
}

/// `1 slab a voxel`; of what is no samples itself, by the spacing of those that stand for it, `a sample`.
pub fn slabs(per_voxel: f64, is_of_samples: bool) -> String {
    let plural = if per_voxel == 1.0 { "" } else { "s" };
    let of = if is_of_samples { "voxel" } else { "sample" };
    format!("{} slab{plural} a {of}", words::value(per_voxel))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::OpacityModel;

    const LIMITS: Limits = Limits { per_cell: Some(9), corrects: true, max_rms: 0.25 };

    /// Settings of every kind that mean something, reached by a walk of choices.
    fn some_settings() -> Vec<SplatSettings> {
        let mut all = vec![SplatSettings::EXACT, SplatSettings::SHADE_FIRST];
        for choice in choices() {
            let more: Vec<_> = all.iter().map(|now| changed(now, choice)).collect();
            all.extend(more);
            all.dedup();
            all.truncate(300);
        }
        all
    }

    fn choices() -> Vec<ModeChoice> {
        let none = ModeChoice::default();
        let mut all = Vec::new();
        all.extend(Kernel::ALL.map(|k| ModeChoice { kernel: Some(k), ..none }));
        all.extend(Visibility::ALL.iter().map(|&v| ModeChoice { visibility: Some(v), ..none }));
        all.extend(Classify::ALL.iter().map(|&c| ModeChoice { classify: Some(c), ..none }));
        let reconstructions = Reconstruction::ALL.iter();
        all.extend(reconstructions.map(|&r| ModeChoice { reconstruction: Some(r), ..none }));
        all.extend(Backend::ALL.iter().map(|&b| ModeChoice { backend: Some(b), ..none }));
        all.extend(Order::ALL.iter().map(|&o| ModeChoice { order: Some(o), ..none }));
        let models = OpacityModel::ALL.iter();
        all.extend(models.map(|&o| ModeChoice { opacity_model: Some(o), ..none }));
        all.push(ModeChoice { extent: Some(2.5), ..none });
        all.push(ModeChoice { slabs_per_voxel: Some(4.0), ..none });
        all.push(ModeChoice { sheets_per_kernel: Some(5), ..none });
        all.push(ModeChoice { gouraud_angles: Some(7), ..none });
        all.push(ModeChoice { gouraud_rings: Some(2), ..none });
        all.push(ModeChoice { functions: Some(LIMITS), ..none });
        all
    }

    #[test]
    fn a_choice_always_holds_and_the_result_always_means_something() {
        for now in some_settings() {
            for choice in choices() {
                let then = changed(&now, choice);
                let case = format!("{} then {choice:?}: {}", name(&now), name(&then));
                assert_eq!(then.check(), Ok(()), "{case}");
                assert!(choice.kernel.is_none_or(|k| k == then.kernel), "{case}");
                assert!(choice.visibility.is_none_or(|v| v == then.visibility), "{case}");
                assert!(choice.classify.is_none_or(|c| c == then.classify), "{case}");
                assert!(choice.reconstruction.is_none_or(|r| r == then.reconstruction), "{case}");
                assert!(choice.backend.is_none_or(|b| b == then.backend), "{case}");
                assert!(choice.order.is_none_or(|o| o == then.order), "{case}");
                assert!(choice.opacity_model.is_none_or(|o| o == then.opacity_model), "{case}");
                assert!(choice.extent.is_none_or(|e| Some(e) == then.extent), "{case}");
                assert!(choice.slabs_per_voxel.is_none_or(|n| n == then.slabs_per_voxel), "{case}");
                let sheets = choice.sheets_per_kernel;
                assert!(sheets.is_none_or(|n| n == then.sheets_per_kernel), "{case}");
                let (angles, rings) = (choice.gouraud_angles, choice.gouraud_rings);
                assert!(angles.is_none_or(|n| n == then.gouraud.angles), "{case}");
                assert!(rings.is_none_or(|n| n == then.gouraud.rings), "{case}");
                assert!(choice.functions.is_none_or(|f| f == then.functions), "{case}");
            }
        }
    }

    #[test]
    fn what_goes_with_a_choice_stays() {
        let exact = SplatSettings { slabs_per_voxel: 4.0, ..SplatSettings::EXACT };
        let linear = changed(&exact, ModeChoice { kernel: Some(Kernel::Linear), ..none() });
        assert_eq!(linear, SplatSettings { kernel: Kernel::Linear, ..exact });
        let published = ModeChoice { opacity_model: Some(OpacityModel::Published), ..none() };
        assert_eq!(changed(&exact, published).slabs_per_voxel, 4.0);
        let unit = SplatSettings { opacity_unit_distance: Some(3.0), ..exact };
        assert_eq!(changed(&unit, published).opacity_unit_distance, Some(3.0));
    }

    #[test]
    fn limits_of_functions_stay_but_for_that_of_cells_where_means_of_slabs_are_chosen() {
        let few = SplatSettings { functions: LIMITS, ..SplatSettings::FUNCTIONS };
        assert_eq!(
            name(&few),
            "Basis functions, pre-integrated, 1 slab a sample, 9 functions a cell, functions to 0.25"
        );
        let after = changed(&few, ModeChoice { classify: Some(Classify::After), ..none() });
        assert_eq!(after.functions, LIMITS);
        let samples = changed(&few, ModeChoice { kernel: Some(Kernel::BSpline), ..none() });
        assert!(samples.functions == LIMITS && same_mode(&samples, &SplatSettings::EXACT));
        assert!(!same_mode(&few, &SplatSettings::FUNCTIONS));
        let mean = changed(&few, ModeChoice { classify: Some(Classify::Mean), ..none() });
        assert_eq!(mean.functions, Limits { per_cell: None, ..LIMITS });
    }

    #[test]
    fn every_sample_takes_classic_splatting_with_it() {
        let choice = ModeChoice { visibility: Some(Visibility::EverySample), ..none() };
        assert_eq!(changed(&SplatSettings::EXACT, choice), SplatSettings::SHADE_FIRST);
    }

    #[test]
    fn interpolating_takes_classification_after_reconstruction_with_it() {
        let choice = ModeChoice { reconstruction: Some(Reconstruction::Interpolating), ..none() };
        let then = changed(&SplatSettings::SHADE_FIRST, choice);
        assert_eq!(then.classify, Classify::PreIntegrated);
        assert_eq!(then.visibility, Visibility::Slabs);
        assert_eq!(then.kernel, Kernel::Cubic, "which goes with it");
    }

    #[test]
    fn a_contradiction_in_itself_changes_nothing() {
        let now = SplatSettings::SHADE_FIRST;
        let choice = ModeChoice {
            kernel: Some(Kernel::Linear),
            visibility: Some(Visibility::EverySample),
            ..none()
        };
        assert_eq!(changed(&now, choice), now);
        let beyond = ModeChoice { slabs_per_voxel: Some(f64::NAN), ..none() };
        assert_eq!(changed(&SplatSettings::EXACT, beyond), SplatSettings::EXACT);
    }

    #[test]
    fn modes_have_names_that_tell_them_apart() {
        assert_eq!(
            name(&SplatSettings::EXACT),
            "B-spline, interpolating, pre-integrated, 1 slab a voxel"
        );
        assert_eq!(name(&SplatSettings::SHADE_FIRST), "Cubic, every sample");
        assert_eq!(name(&SplatSettings::CELLS), "Cells, pre-integrated, 1 slab a sample");
        // They pass through no samples: beside those, by the divider, nothing says that they interpolate.
        assert_eq!(
            name(&SplatSettings::FUNCTIONS),
            "Basis functions, pre-integrated, 1 slab a sample"
        );
        let settings = some_settings();
        // What no samples are sharpened for has no reconstruction to tell.
        let told = |settings: &SplatSettings| match settings.kernel.is_of_samples() {
            true => *settings,
            false => SplatSettings { reconstruction: Reconstruction::Smooth, ..*settings },
        };
        for (i, a) in settings.iter().enumerate() {
            for b in &settings[i + 1..] {
                let shown_apart = told(a) != told(b) && a.visibility == Visibility::Slabs;
                if shown_apart && a.sheets_per_kernel == b.sheets_per_kernel {
                    assert_ne!(name(a), name(b), "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn only_the_exact_mode_or_finer_is_called_exact() {
        assert!(is_exact(&SplatSettings::EXACT));
        assert!(is_exact(&SplatSettings { slabs_per_voxel: 2.0, ..SplatSettings::EXACT }));
        assert!(!is_exact(&SplatSettings { slabs_per_voxel: 0.5, ..SplatSettings::EXACT }));
        assert!(!is_exact(&SplatSettings::SHADE_FIRST));
    }

    fn none() -> ModeChoice {
        ModeChoice::default()
    }
}
