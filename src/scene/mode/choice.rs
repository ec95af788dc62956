//! A mode as people ask for it, and what follows from what they leave open.

use super::{
    Backend, Classify, CutSettings, ModeError, OpacityModel, Order, Reconstruction, SplatSettings,
    Visibility,
};
use crate::kernel::{Kernel, Subdivisions};
use crate::rbf::Limits;

/// A mode as people ask for it: what they leave open follows from what they choose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[expect(missing_docs, reason = "the fields are those of SplatSettings")]
pub struct ModeChoice {
    pub kernel: Option<Kernel>,
    pub extent: Option<f64>,
    pub opacity_unit_distance: Option<f64>,
    pub visibility: Option<Visibility>,
    pub slabs_per_voxel: Option<f64>,
    pub sheets_per_kernel: Option<u32>,
    pub opacity_model: Option<OpacityModel>,
    pub classify: Option<Classify>,
    pub reconstruction: Option<Reconstruction>,
    pub order: Option<Order>,
    pub backend: Option<Backend>,
    pub gouraud_angles: Option<u32>,
    pub gouraud_rings: Option<u32>,
    pub cut: Option<CutSettings>,
    pub functions: Option<Limits>,
    pub quick_functions: Option<f64>,
}

impl ModeChoice {
    /// The settings chosen: the exact mode, and where that contradicts what was asked for, what goes
    /// with it. Nothing that was asked for is changed.
    ///
    /// # Errors
    /// Where what was asked for contradicts itself.
    pub fn resolve(&self) -> Result<SplatSettings, ModeError> {
        let exact = SplatSettings::EXACT;
        let shade_first = SplatSettings::SHADE_FIRST;
        let subdivided = self.gouraud_angles.is_some() || self.gouraud_rings.is_some();
        let limited = self.functions.is_some_and(|limits| limits.leaves_out())
            || self.quick_functions.is_some();
        let meant = subdivided.then_some(Kernel::Gouraud).or(limited.then_some(Kernel::Functions));
        let asked = self.kernel.or(meant);
        let visibility = self.visibility.unwrap_or(match self.sheets_per_kernel {
            Some(_) => Visibility::Sheets,
            None if self.backend == Some(Backend::Raster) => Visibility::EverySample,
            None if asked == Some(Kernel::Gouraud) => Visibility::EverySample,
            None => exact.visibility,
        });
        let whole = visibility != Visibility::Slabs || self.kernel == Some(Kernel::Point);
        let classify =
            self.classify.unwrap_or(if whole { Classify::Before } else { exact.classify });
        let radial = visibility != Visibility::Slabs;
        let smooth = classify == Classify::Before;
        let settings = SplatSettings {
            kernel: asked.unwrap_or(match classify {
                Classify::Mean => Kernel::Functions,
                _ if radial || smooth => shade_first.kernel,
                _ => exact.kernel,
            }),
            extent: self.extent,
            opacity_unit_distance: self.opacity_unit_distance,
            visibility,
            slabs_per_voxel: self.slabs_per_voxel.unwrap_or(exact.slabs_per_voxel),
            sheets_per_kernel: self.sheets_per_kernel.unwrap_or(exact.sheets_per_kernel),
            opacity_model: self.opacity_model.unwrap_or(exact.opacity_model),
            classify,
            reconstruction: self.reconstruction.unwrap_or(if smooth {
                Reconstruction::Smooth
            } else {
                exact.reconstruction
            }),
            order: self.order.unwrap_or(if visibility == Visibility::EverySample {
                shade_first.order
            } else {
                exact.order
            }),
            backend: self.backend.unwrap_or(exact.backend),
            gouraud: Subdivisions {
                angles: self.gouraud_angles.unwrap_or(exact.gouraud.angles),
                rings: self.gouraud_rings.unwrap_or(exact.gouraud.rings),
            },
            cut: self.cut.unwrap_or(exact.cut),
            functions: self.functions.unwrap_or(exact.functions),
            quick_functions: self.quick_functions,
        };
        settings.check()?;
        Ok(settings)
    }

    /// [`ModeChoice::resolve`] for choices that were all made on purpose: one that would change
    /// nothing is refused, too.
    ///
    /// # Errors
    /// As there, and where a number of slabs or sheets is chosen for a mode that has none.
    pub fn resolve_strictly(&self) -> Result<SplatSettings, ModeError> {
        let asks_for_slabs = self.slabs_per_voxel.is_some() && self.sheets_per_kernel.is_none();
        let visibility = self.visibility.or(asks_for_slabs.then_some(Visibility::Slabs));
        let settings = Self { visibility, ..*self }.resolve()?;
        let found = || format!("--visibility {}", settings.visibility.name());
        if self.slabs_per_voxel.is_some() && settings.visibility != Visibility::Slabs {
            return Err(ModeError {
                expected: "--slabs-per-voxel with --visibility slabs",
                found: found(),
                advice: "leave --slabs-per-voxel out, or choose --visibility slabs",
            });
        }
        if self.sheets_per_kernel.is_some() && settings.visibility != Visibility::Sheets {
            return Err(ModeError {
                expected: "--sheets-per-kernel with --visibility sheets",
                found: found(),
                advice: "leave --sheets-per-kernel out, or choose --visibility sheets",
            });
        }
        for (number, expected, advice) in [
            (
                self.gouraud_angles,
                "--gouraud-angles with --kernel gouraud",
                "leave --gouraud-angles out, or choose --kernel gouraud",
            ),
            (
                self.gouraud_rings,
                "--gouraud-rings with --kernel gouraud",
                "leave --gouraud-rings out, or choose --kernel gouraud",
            ),
        ] {
            if number.is_some() && settings.kernel != Kernel::Gouraud {
                let found = format!("--kernel {}", settings.kernel.name());
                return Err(ModeError { expected, found, advice });
            }
        }
        let limits = self.functions.unwrap_or_default();
        if !limits.corrects && limits.per_cell.is_none() {
            return Err(ModeError {
                expected: "--functions-per-cell with --no-cell-correction",
                found: "--no-cell-correction alone".to_owned(),
                advice: "add --functions-per-cell, or leave --no-cell-correction out",
            });
        }
        for (is_given, expected, advice) in [
            (
                limits.per_cell.is_some(),
                "--functions-per-cell with --kernel functions",
                "leave --functions-per-cell out, or choose --kernel functions",
            ),
            (
                limits.max_rms != 0.0,
                "--functions-error with --kernel functions",
                "leave --functions-error out, or choose --kernel functions",
            ),
            (
                self.quick_functions.is_some(),
                "--quick-functions-error with --kernel functions",
                "leave --quick-functions-error out, or choose --kernel functions",
            ),
        ] {
            if is_given && settings.kernel != Kernel::Functions {
                let found = format!("--kernel {}", settings.kernel.name());
                return Err(ModeError { expected, found, advice });
            }
        }
        Ok(settings)
    }
}

impl From<SplatSettings> for ModeChoice {
    fn from(settings: SplatSettings) -> Self {
        let SplatSettings {
            kernel,
            extent,
            opacity_unit_distance,
            visibility,
            slabs_per_voxel,
            sheets_per_kernel,
            opacity_model,
            classify,
            reconstruction,
            order,
            backend,
            gouraud,
            cut,
            functions,
            quick_functions,
        } = settings;
        Self {
            kernel: Some(kernel),
            extent,
            opacity_unit_distance,
            visibility: Some(visibility),
            slabs_per_voxel: Some(slabs_per_voxel),
            sheets_per_kernel: Some(sheets_per_kernel),
            opacity_model: Some(opacity_model),
            classify: Some(classify),
            reconstruction: Some(reconstruction),
            order: Some(order),
            backend: Some(backend),
            gouraud_angles: (kernel == Kernel::Gouraud).then_some(gouraud.angles),
            gouraud_rings: (kernel == Kernel::Gouraud).then_some(gouraud.rings),
            cut: Some(cut),
            functions: Some(functions),
            quick_functions,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::core::Camera;
    use crate::scene::View;
    use crate::volume::Lattice;

    const FEW: Limits = Limits { per_cell: Some(12), ..Limits::NONE };

    fn limited(limits: Limits) -> ModeChoice {
        ModeChoice { functions: Some(limits), ..ModeChoice::default() }
    }

    #[test]
    fn limits_of_functions_mean_functions_and_are_refused_where_others_are_drawn() {
        for limits in [FEW, Limits { max_rms: 0.5, ..Limits::NONE }] {
            let settings = limited(limits).resolve_strictly().expect("a mode");
            assert_eq!((settings.kernel, settings.limits()), (Kernel::Functions, limits));
            assert_eq!(ModeChoice::from(settings).resolve(), Ok(settings));
            let other = ModeChoice { kernel: Some(Kernel::Linear), ..limited(limits) };
            assert_eq!(other.resolve().map(|s| s.limits()), Ok(Limits::NONE), "they are idle");
            let error = other.resolve_strictly().expect_err("idle").to_string();
            assert!(error.contains("--kernel functions, found --kernel linear; "), "{error}");
        }
        let quick = ModeChoice { quick_functions: Some(2.0), ..limited(FEW) };
        let settings = quick.resolve_strictly().expect("a mode");
        assert_eq!(settings.quick_limits(), Some(Limits { max_rms: 2.0, ..FEW }));
        let all = SplatSettings { quick_functions: None, ..settings };
        assert!(all.makes_same_picture(&settings) && all.quick_limits().is_none());
        // None at all say nothing of the kernel, and pictures without functions do not differ by theirs.
        assert_eq!(limited(Limits::NONE).resolve_strictly(), Ok(SplatSettings::EXACT));
        let idle = SplatSettings { functions: FEW, ..SplatSettings::EXACT };
        assert!(idle.makes_same_picture(&SplatSettings::EXACT));
        let all = SplatSettings { kernel: Kernel::Functions, ..SplatSettings::EXACT };
        assert!(!SplatSettings { functions: FEW, ..all }.makes_same_picture(&all));
    }

    #[test]
    fn nothing_chosen_is_exact_and_both_presets_mean_something() {
        assert_eq!(ModeChoice::default().resolve(), Ok(SplatSettings::EXACT));
        assert_eq!(SplatSettings::SHADE_FIRST.check(), Ok(()));
        let kept = ModeChoice::from(SplatSettings::SHADE_FIRST).resolve();
        assert_eq!(kept, Ok(SplatSettings::SHADE_FIRST));
    }

    #[test]
    fn one_choice_alone_always_means_something() {
        let none = ModeChoice::default();
        let mut choices = Vec::new();
        choices.extend(Kernel::ALL.map(|k| ModeChoice { kernel: Some(k), ..none }));
        choices.extend(Visibility::ALL.iter().map(|&v| ModeChoice { visibility: Some(v), ..none }));
        choices.extend(Classify::ALL.iter().map(|&c| ModeChoice { classify: Some(c), ..none }));
        choices.extend(
            Reconstruction::ALL.iter().map(|&r| ModeChoice { reconstruction: Some(r), ..none }),
        );
        choices.extend(Backend::ALL.iter().map(|&b| ModeChoice { backend: Some(b), ..none }));
        choices.extend(Order::ALL.iter().map(|&o| ModeChoice { order: Some(o), ..none }));
        choices.push(ModeChoice { extent: Some(2.0), ..none });
        choices.push(ModeChoice { sheets_per_kernel: Some(5), ..none });
        for choice in choices {
            let settings = choice.resolve().unwrap_or_else(|error| panic!("{choice:?}: {error}"));
            assert!(choice.kernel.is_none_or(|k| k == settings.kernel));
            assert!(choice.classify.is_none_or(|c| c == settings.classify));
            assert!(choice.visibility.is_none_or(|v| v == settings.visibility));
        }
    }

    #[test]
    fn contradictions_are_refused_in_a_sentence() {
        let none = ModeChoice::default();
        let slabs = Some(Visibility::Slabs);
        let mesh = ModeChoice { kernel: Some(Kernel::Gouraud), ..none };
        let refused = [
            ModeChoice {
                classify: Some(Classify::Before),
                reconstruction: Some(Reconstruction::Interpolating),
                ..none
            },
            ModeChoice {
                visibility: Some(Visibility::EverySample),
                classify: Some(Classify::After),
                ..none
            },
            ModeChoice {
                visibility: Some(Visibility::Sheets),
                classify: Some(Classify::PreIntegrated),
                ..none
            },
            ModeChoice {
                visibility: Some(Visibility::Sheets),
                kernel: Some(Kernel::Linear),
                ..none
            },
            ModeChoice { extent: Some(0.4), kernel: Some(Kernel::BSpline), ..none },
            ModeChoice { extent: Some(8.5), kernel: Some(Kernel::BSpline), ..none },
            ModeChoice { extent: Some(f64::NAN), kernel: Some(Kernel::BSpline), ..none },
            ModeChoice { extent: Some(2.5), kernel: Some(Kernel::Linear), ..none },
            ModeChoice { extent: Some(1e-6), kernel: Some(Kernel::Linear), ..none },
            ModeChoice { extent: Some(1e6), kernel: Some(Kernel::Linear), ..none },
            ModeChoice { extent: Some(2.0), kernel: Some(Kernel::Nearest), ..none },
            ModeChoice { extent: Some(9.0), visibility: slabs, ..none },
            ModeChoice { slabs_per_voxel: Some(0.0), ..none },
            ModeChoice { slabs_per_voxel: Some(f64::NAN), ..none },
            ModeChoice { sheets_per_kernel: Some(0), ..none },
            ModeChoice { kernel: Some(Kernel::Point), classify: Some(Classify::After), ..none },
            ModeChoice { backend: Some(Backend::Raster), visibility: slabs, ..none },
            ModeChoice { visibility: slabs, ..mesh },
            ModeChoice { visibility: Some(Visibility::Sheets), ..mesh },
            ModeChoice { sheets_per_kernel: Some(2), ..mesh },
            ModeChoice { backend: Some(Backend::Tiles), ..mesh },
            ModeChoice { order: Some(Order::FrontToBack), ..mesh },
            ModeChoice { classify: Some(Classify::After), ..mesh },
            ModeChoice { classify: Some(Classify::PreIntegrated), ..mesh },
            ModeChoice { reconstruction: Some(Reconstruction::Interpolating), ..mesh },
            ModeChoice { gouraud_angles: Some(2), ..none },
            ModeChoice { gouraud_angles: Some(65), ..none },
            ModeChoice { gouraud_rings: Some(0), ..none },
            ModeChoice { gouraud_rings: Some(17), ..none },
            ModeChoice { gouraud_rings: Some(17), kernel: Some(Kernel::Cubic), ..none },
            limited(Limits { per_cell: Some(0), ..Limits::NONE }),
            limited(Limits { per_cell: Some(65_537), ..Limits::NONE }),
            limited(Limits { max_rms: -1.0, ..Limits::NONE }),
            limited(Limits { max_rms: f64::NAN, ..Limits::NONE }),
            limited(Limits { max_rms: f64::INFINITY, ..Limits::NONE }),
            ModeChoice { quick_functions: Some(0.0), ..none },
            ModeChoice { quick_functions: Some(f64::NAN), ..none },
            ModeChoice { classify: Some(Classify::Mean), ..limited(FEW) },
            ModeChoice { visibility: Some(Visibility::EverySample), ..limited(FEW) },
        ];
        for choice in refused {
            let error = choice.resolve().expect_err("refused").to_string();
            assert!(error.starts_with("expected ") && error.contains("; "), "{error}");
        }
    }

    #[test]
    fn what_would_change_nothing_is_refused_only_where_all_was_chosen_on_purpose() {
        let slabs = ModeChoice { slabs_per_voxel: Some(2.0), ..ModeChoice::default() };
        let sheets = ModeChoice { sheets_per_kernel: Some(3), ..ModeChoice::default() };
        let whole = [Visibility::EverySample, Visibility::Sheets];
        let idle = [
            (whole.map(|v| ModeChoice { visibility: Some(v), ..slabs }), "--slabs-per-voxel"),
            (
                [Visibility::EverySample, Visibility::Slabs]
                    .map(|v| ModeChoice { visibility: Some(v), ..sheets }),
                "--sheets-per-kernel",
            ),
            ([ModeChoice { sheets_per_kernel: Some(3), ..slabs }; 2], "--slabs-per-voxel"),
        ];
        for (choices, flag) in idle {
            for choice in choices {
                assert!(choice.resolve().is_ok(), "{choice:?}");
                let error = choice.resolve_strictly().expect_err("idle").to_string();
                assert!(error.starts_with(&format!("expected {flag} with ")), "{error}");
                assert!(error.contains(", found --visibility ") && error.contains("; "), "{error}");
            }
        }
        // Alone, or with what they belong to, they say what is meant.
        for (choice, visibility) in [(slabs, Visibility::Slabs), (sheets, Visibility::Sheets)] {
            for given in [None, Some(visibility)] {
                let settings = ModeChoice { visibility: given, ..choice }.resolve_strictly();
                assert_eq!(settings.map(|s| s.visibility), Ok(visibility));
            }
        }
        // Slabs are meant even where triangles would have meant every sample.
        let raster = ModeChoice { backend: Some(Backend::Raster), ..slabs };
        let error = raster.resolve_strictly().expect_err("no triangles in slabs").to_string();
        assert!(
            error.contains("--backend raster") && error.contains("--visibility slabs"),
            "{error}"
        );
        assert_eq!(ModeChoice::default().resolve_strictly(), Ok(SplatSettings::EXACT));
    }

    #[test]
    fn meshes_are_laid_down_one_by_one_as_triangles_whatever_their_opacity_means() {
        let none = ModeChoice::default();
        let mesh = ModeChoice { kernel: Some(Kernel::Gouraud), ..none };
        let settings = mesh.resolve_strictly().expect("a mode");
        assert_eq!(
            settings,
            SplatSettings { kernel: Kernel::Gouraud, ..SplatSettings::SHADE_FIRST }
        );
        let published = ModeChoice { opacity_model: Some(OpacityModel::Published), ..mesh };
        let camera = Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, 100.0);
        let view = View::of(&camera, &Lattice::unit([8; 3]), [32, 32]);
        for choice in [mesh, published, ModeChoice { extent: Some(3.0), ..mesh }] {
            let settings = choice.resolve_strictly().expect("a mode");
            assert_eq!(
                (settings.fixed_backend(), settings.is_backend_open(&view)),
                (Backend::Raster, false)
            );
            assert_eq!(ModeChoice::from(settings).resolve(), Ok(settings));
            assert_eq!(settings.previewed().kernel, Kernel::Gouraud);
        }
        // A number of either alone says what is meant; with another kernel it says nothing.
        let seven = ModeChoice { gouraud_angles: Some(7), ..none };
        let two = ModeChoice { gouraud_rings: Some(2), ..none };
        for choice in [seven, two] {
            assert_eq!(choice.resolve_strictly().map(|s| s.kernel), Ok(Kernel::Gouraud));
            let other = ModeChoice { kernel: Some(Kernel::Cubic), ..choice };
            assert!(other.resolve().is_ok());
            let error = other.resolve_strictly().expect_err("idle").to_string();
            assert!(error.contains("--kernel gouraud, found --kernel cubic; "), "{error}");
        }
    }
}
