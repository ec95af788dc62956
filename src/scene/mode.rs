//! How a scene's kernels become a picture: what they reconstruct, when they are classified, and how
//! they hide one another.

use serde::{Deserialize, Serialize};

use super::View;
use crate::hierarchy::ErrorMeasure;
use crate::kernel::{Kernel, Subdivisions};

/// How kernels hide one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// Each kernel's footprint is composited on its own (Westover §3.6).
    EverySample,
    /// Footprints are added up in axis-aligned sheets, which are composited (Westover §4.2, §5.3).
    Sheets,
    /// Kernels give their integrals to image-aligned slabs, which are composited.
    Slabs,
}

/// What a kernel's opacity means where kernels overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OpacityModel {
    /// Extinction adds up; opacity is 1 − exp(−optical depth).
    OpticalDepth,
    /// Opacity times footprint, as the papers print it; sums are capped at 1.
    Published,
}

/// When values become colour and extinction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Classify {
    /// Each sample, before reconstruction ("shade first").
    Before,
    /// The reconstructed value in the middle of each slab.
    After,
    /// All values between the two faces of each slab, in two halves in their order. The value runs
    /// along the parabola through the faces that has the mean of the cubic through these and the next
    /// on either side, in each half along the straight line with that half's mean.
    PreIntegrated,
}

/// Whether the values are sharpened so that the kernels pass through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reconstruction {
    /// Samples weigh the kernels as they are: noise is smoothed, and detail.
    Smooth,
    /// Samples are sharpened first (see [`crate::kernel`]).
    Interpolating,
}

/// The direction in which layers are composited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Each over what is behind it.
    BackToFront,
    /// Each under what is before it.
    FrontToBack,
}

/// What draws the picture. Both draw the same one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// In `render` a fixed rule ([`SplatSettings::fixed_backend`]); in the window the faster one.
    Auto,
    /// Footprints as blended triangles.
    Raster,
    /// Compute: each pixel walks its tile's layers.
    Tiles,
}

/// How octree cuts are fitted: what coarse pictures are drawn from. `full` ones do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CutSettings {
    /// What a node's error is of.
    pub measure: ErrorMeasure,
    /// Whether a node's error counts by what of it shows in the view, rather than everywhere alike.
    pub view_dependent: bool,
    /// Whether nodes that share a face differ by at most one level.
    pub balanced: bool,
}

impl CutSettings {
    /// Of classified voxels, everywhere alike, not balanced.
    pub const UNIFORM: Self =
        Self { measure: ErrorMeasure::Classified, view_dependent: false, balanced: false };
}

impl Default for CutSettings {
    fn default() -> Self {
        Self::UNIFORM
    }
}

/// How a volume is splatted: a mode of the price list.
///
/// Not every combination means something: see [`SplatSettings::check`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SplatSettings {
    /// Which reconstruction kernel.
    pub kernel: Kernel,
    /// Splat radius in voxels; `None` is the kernel's natural one. Mean depth is kept.
    pub extent: Option<f64>,
    /// World length over which opacities are given; `None` is the smallest voxel spacing.
    pub opacity_unit_distance: Option<f64>,
    /// How kernels hide one another.
    pub visibility: Visibility,
    /// Slabs per smallest voxel spacing, > 0; with [`Visibility::Slabs`].
    pub slabs_per_voxel: f64,
    /// Sheets that a kernel's extent along the sheet axis is cut into, ≥ 1; 1 keeps each kernel
    /// whole in the sheet of its own slice. With [`Visibility::Sheets`].
    pub sheets_per_kernel: u32,
    /// What opacity means where kernels overlap.
    pub opacity_model: OpacityModel,
    /// When values become colour and extinction.
    pub classify: Classify,
    /// Whether values are sharpened first.
    pub reconstruction: Reconstruction,
    /// Direction of compositing.
    pub order: Order,
    /// What draws it.
    pub backend: Backend,
    /// How finely splats are cut into triangles; with [`Kernel::Gouraud`].
    #[serde(default)]
    pub gouraud: Subdivisions,
    /// How octree cuts are fitted.
    #[serde(default)]
    pub cut: CutSettings,
}

impl Default for SplatSettings {
    fn default() -> Self {
        Self::EXACT
    }
}

/// The finest slabs on offer, per voxel.
pub const MOST_SLABS_PER_VOXEL: f64 = 64.0;
/// The coarsest.
pub const LEAST_SLABS_PER_VOXEL: f64 = 0.125;
/// The most sheets a kernel may be cut into.
pub const MOST_SHEETS_PER_KERNEL: u32 = 64;
/// The largest splat radius, voxels, of kernels that are gathered from the lattice.
pub const MOST_GATHERED_EXTENT: f64 = 8.0;

/// A combination of settings that means nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected {expected}, found {found}; {advice}")]
pub struct ModeError {
    expected: &'static str,
    found: String,
    advice: &'static str,
}

impl SplatSettings {
    /// Westover's splatting by optical depth: every sample, shaded first, the optimal cubic.
    pub const SHADE_FIRST: Self = Self {
        kernel: Kernel::Cubic,
        extent: None,
        opacity_unit_distance: None,
        visibility: Visibility::EverySample,
        slabs_per_voxel: 1.0,
        sheets_per_kernel: 1,
        opacity_model: OpacityModel::OpticalDepth,
        classify: Classify::Before,
        reconstruction: Reconstruction::Smooth,
        order: Order::BackToFront,
        backend: Backend::Auto,
        gouraud: Subdivisions { angles: 8, rings: 4 },
        cut: CutSettings::UNIFORM,
    };

    /// What "exact" means: slabs, the interpolating cubic B-spline, pre-integrated.
    pub const EXACT: Self = Self {
        kernel: Kernel::BSpline,
        visibility: Visibility::Slabs,
        classify: Classify::PreIntegrated,
        reconstruction: Reconstruction::Interpolating,
        order: Order::FrontToBack,
        ..Self::SHADE_FIRST
    };

    /// Whether the combination means something.
    ///
    /// # Errors
    /// One sentence: what was expected, what was found, what to try.
    pub fn check(&self) -> Result<(), ModeError> {
        let kernel = self.kernel;
        let refuse = |expected, found: String, advice| Err(ModeError { expected, found, advice });
        let name = |what: &str| format!("{what} with --kernel {}", kernel.name());
        self.check_mesh()?;
        if self.visibility != Visibility::Slabs && self.classify != Classify::Before {
            return refuse(
                "--classify after or pre-integrated with --visibility slabs",
                format!("--visibility {}", self.visibility.name()),
                "choose --visibility slabs, or --classify before",
            );
        }
        if self.classify == Classify::Before && self.reconstruction == Reconstruction::Interpolating
        {
            return refuse(
                "--reconstruction interpolating with values classified after reconstruction",
                "--classify before".to_owned(),
                "choose --classify pre-integrated, or --reconstruction smooth",
            );
        }
        if kernel.is_separable() {
            if self.visibility != Visibility::Slabs {
                return refuse(
                    "--kernel linear or bspline with --visibility slabs",
                    name(&format!("--visibility {}", self.visibility.name())),
                    "choose --visibility slabs, or --kernel cubic",
                );
            }
            if self.extent.is_some() {
                return refuse(
                    "--extent with a kernel that has one (gaussian, cubic, gouraud)",
                    name("--extent"),
                    "leave one of the two out",
                );
            }
        }
        if self.extent.is_some() && kernel.natural_extent().is_none() {
            return refuse(
                "--extent with a kernel that has one (gaussian, cubic, gouraud)",
                name("--extent"),
                "leave one of the two out",
            );
        }
        if kernel == Kernel::Point && self.classify != Classify::Before {
            return refuse(
                "--kernel point with --classify before: points leave no value between them",
                format!("--classify {}", self.classify.name()),
                "choose --kernel nearest, or --classify before",
            );
        }
        let slabs = LEAST_SLABS_PER_VOXEL..=MOST_SLABS_PER_VOXEL;
        if self.visibility == Visibility::Slabs && !slabs.contains(&self.slabs_per_voxel) {
            return refuse(
                "--slabs-per-voxel between 0.125 and 64",
                self.slabs_per_voxel.to_string(),
                "choose a number in that range",
            );
        }
        if !(1..=MOST_SHEETS_PER_KERNEL).contains(&self.sheets_per_kernel) {
            return refuse(
                "--sheets-per-kernel between 1 and 64",
                self.sheets_per_kernel.to_string(),
                "choose a number in that range",
            );
        }
        let gathered = self.fixed_backend() == Backend::Tiles || self.backend == Backend::Tiles;
        if gathered && self.extent.is_some_and(|extent| extent > MOST_GATHERED_EXTENT) {
            return refuse(
                "--extent up to 8 voxels with sheets, slabs or tiles",
                format!("{}", self.extent.unwrap_or_default()),
                "choose a smaller extent, or --visibility every-sample",
            );
        }
        if self.backend == Backend::Raster && self.needs_tiles() {
            return refuse(
                "--backend raster with every sample, back to front, by optical depth",
                format!(
                    "--visibility {}, --order {} and --opacity-model {}",
                    self.visibility.name(),
                    self.order.name(),
                    self.opacity_model.name()
                ),
                "choose --backend tiles or auto",
            );
        }
        Ok(())
    }

    /// What a mesh of triangles can be: laid down one by one, far to near, as triangles.
    fn check_mesh(&self) -> Result<(), ModeError> {
        let Subdivisions { angles, rings } = self.gouraud;
        for (count, range, expected) in [
            (angles, Subdivisions::ANGLES, "--gouraud-angles between 3 and 64"),
            (rings, Subdivisions::RINGS, "--gouraud-rings between 1 and 16"),
        ] {
            if !range.contains(&count) {
                let advice = "choose a number in that range";
                return Err(ModeError { expected, found: count.to_string(), advice });
            }
        }
        if self.kernel != Kernel::Gouraud {
            return Ok(());
        }
        let faults = [
            (
                self.visibility != Visibility::EverySample,
                format!("--visibility {}", self.visibility.name()),
                "choose --visibility every-sample, or --kernel cubic",
            ),
            (
                self.classify != Classify::Before,
                format!("--classify {}", self.classify.name()),
                "choose --classify before, or --kernel cubic",
            ),
            (
                self.reconstruction != Reconstruction::Smooth,
                format!("--reconstruction {}", self.reconstruction.name()),
                "choose --reconstruction smooth, or --kernel cubic",
            ),
            (
                self.order != Order::BackToFront,
                format!("--order {}", self.order.name()),
                "choose --order back-to-front, or --kernel cubic",
            ),
            (
                self.backend == Backend::Tiles,
                format!("--backend {}", self.backend.name()),
                "choose --backend raster or auto, or --kernel cubic",
            ),
        ];
        let expected = "--kernel gouraud with every sample, classified before reconstruction, back to \
                        front, as triangles";
        match faults.into_iter().find(|(wrong, ..)| *wrong) {
            Some((_, found, advice)) => Err(ModeError { expected, found, advice }),
            None => Ok(()),
        }
    }

    /// The mode that stands in for this one while the view moves: triangles, shaded first.
    pub fn previewed(&self) -> Self {
        Self {
            kernel: self.kernel.splatted(),
            extent: self.extent,
            opacity_unit_distance: self.opacity_unit_distance,
            backend: Backend::Raster,
            gouraud: self.gouraud,
            cut: self.cut,
            ..Self::SHADE_FIRST
        }
    }

    /// What `render` draws with where nobody chose: triangles for every sample, composited far to
    /// near by optical depth; tiles for all else, which triangles cannot do.
    pub fn fixed_backend(&self) -> Backend {
        if self.backend != Backend::Auto {
            return self.backend;
        }
        if self.needs_tiles() { Backend::Tiles } else { Backend::Raster }
    }

    /// Whether only tiles can draw it.
    pub fn needs_tiles(&self) -> bool {
        self.visibility != Visibility::EverySample
            || self.opacity_model == OpacityModel::Published && self.kernel != Kernel::Gouraud
            || self.order == Order::FrontToBack
    }

    /// Whether kernels of samples side by side leave no gap between them.
    pub fn covers(&self) -> bool {
        self.kernel.reach(self.extent) >= 0.5
    }

    /// Whether kernels are narrower than a pixel and gathered by several rays in each. Where they leave
    /// gaps between the samples, rays would miss them: those are drawn a pixel wide, as triangles always
    /// do.
    pub fn takes_several_rays(&self, view: &View) -> bool {
        let can_gather = self.kernel != Kernel::Gouraud
            && self.backend != Backend::Raster
            && self.extent.is_none_or(|extent| extent <= MOST_GATHERED_EXTENT);
        can_gather && self.covers() && view.rays_per_side(self.kernel, self.extent) > 1
    }

    /// What draws every voxel in a view where nobody chose and nothing was measured: as
    /// [`SplatSettings::fixed_backend`], and tiles where kernels are narrower than a pixel.
    pub fn backend_in(&self, view: &View) -> Backend {
        match self.backend {
            Backend::Auto if self.takes_several_rays(view) => Backend::Tiles,
            _ => self.fixed_backend(),
        }
    }

    /// Whether nobody chose what draws it, and both can.
    pub fn is_backend_open(&self, view: &View) -> bool {
        self.backend == Backend::Auto
            && !self.needs_tiles()
            && self.kernel != Kernel::Gouraud
            && !self.takes_several_rays(view)
    }
}

macro_rules! names {
    ($type:ty { $($variant:ident => $name:literal),* $(,)? }) => {
        impl $type {
            /// Every one.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The name scripts use.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// The one of this name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|one| one.name() == name)
            }
        }
    };
}

names!(Visibility { EverySample => "every-sample", Sheets => "sheets", Slabs => "slabs" });
names!(OpacityModel { OpticalDepth => "optical-depth", Published => "published" });
names!(Classify { Before => "before", After => "after", PreIntegrated => "pre-integrated" });
names!(Reconstruction { Smooth => "smooth", Interpolating => "interpolating" });
names!(Order { BackToFront => "back-to-front", FrontToBack => "front-to-back" });
names!(Backend { Auto => "auto", Raster => "raster", Tiles => "tiles" });

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
        let asked = self.kernel.or(subdivided.then_some(Kernel::Gouraud));
        let visibility = self.visibility.unwrap_or(match self.sheets_per_kernel {
            Some(_) => Visibility::Sheets,
            None if self.backend == Some(Backend::Raster) => Visibility::EverySample,
            None if asked == Some(Kernel::Gouraud) => Visibility::EverySample,
            None => exact.visibility,
        });
        let whole = visibility != Visibility::Slabs || self.kernel == Some(Kernel::Point);
        let classify =
            self.classify.unwrap_or(if whole { Classify::Before } else { exact.classify });
        let radial = visibility != Visibility::Slabs || self.extent.is_some();
        let smooth = classify == Classify::Before;
        let settings = SplatSettings {
            kernel: asked.unwrap_or(if radial || smooth {
                shade_first.kernel
            } else {
                exact.kernel
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
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::core::Camera;
    use crate::volume::Lattice;

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
            ModeChoice { extent: Some(2.0), kernel: Some(Kernel::BSpline), ..none },
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

    #[test]
    fn names_are_read_back() {
        for &visibility in Visibility::ALL {
            assert_eq!(Visibility::from_name(visibility.name()), Some(visibility));
        }
        assert_eq!(Classify::from_name("during"), None);
    }
}
