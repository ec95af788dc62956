//! How a scene's kernels become a picture: what they reconstruct, when they are classified, and how
//! they hide one another.

mod choice;

pub use choice::ModeChoice;

use serde::{Deserialize, Serialize};

use super::View;
use crate::core::{names, plain_number};
use crate::hierarchy::ErrorMeasure;
use crate::kernel::{Kernel, Subdivisions};
use crate::rbf::Limits;

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
    /// The mean value of each slab: basis functions are splatted into slabs, as their integrals, and these are added up
    /// before anything is coloured. With [`Kernel::Functions`].
    Mean,
}

impl Classify {
    /// Whether one value stands for all of a slab: values at its faces are not known then.
    pub fn takes_one_value(self) -> bool {
        matches!(self, Self::After | Self::Mean)
    }
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
    /// What quick pictures of a reconstructed field are of.
    #[serde(default, skip_serializing_if = "Moving::is_auto")]
    pub moving: Moving,
}

impl CutSettings {
    /// Of classified voxels, everywhere alike, not balanced.
    pub const UNIFORM: Self = Self {
        measure: ErrorMeasure::Classified,
        view_dependent: false,
        balanced: false,
        moving: Moving::Auto,
    };

    /// Whether a kind of octree of classified voxels was chosen, which cuts of a field know nothing of.
    pub fn are_of_voxels(&self) -> bool {
        Self { moving: Moving::Auto, ..*self } != Self::UNIFORM
    }
}

/// What a picture within a time shows of a reconstructed field, as while the view moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Moving {
    /// A cut of it, wherever there is one: bricks that look alike are drawn from means of their samples, and the time saved
    /// goes to more pixels.
    Octree,
    /// All of its samples, in as many pixels as the time allows.
    Subsampled,
    /// Whichever of both is thought to be nearer to the finished picture.
    #[default]
    Auto,
}

names!(Moving[3] {
    Octree => "octree",
    Subsampled => "subsampled",
    Auto => "auto",
});

impl Moving {
    fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
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
    /// What of the basis functions is left out; with [`Kernel::Functions`].
    #[serde(default)]
    pub functions: Limits,
    /// Quick pictures are of the functions that are left where the field may be off by so much ([`Limits::max_rms`]), rather
    /// than of tents through its samples; with [`Kernel::Functions`].
    #[serde(default)]
    pub quick_functions: Option<f64>,
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
    pub(super) expected: &'static str,
    pub(super) found: String,
    pub(super) advice: &'static str,
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
        functions: Limits::NONE,
        quick_functions: None,
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
        self.check_sources()?;
        self.check_functions()?;
        if kernel.is_separable() && self.visibility != Visibility::Slabs {
            return refuse(
                "--kernel linear or bspline with --visibility slabs",
                name(&format!("--visibility {}", self.visibility.name())),
                "choose --visibility slabs, or --kernel cubic",
            );
        }
        if let Some(extent) = self.extent.filter(|e| !kernel.extents().contains(e)) {
            let (expected, advice) = match kernel {
                Kernel::Linear => (
                    "--extent between 0.6 and 2 voxels with --kernel linear",
                    "choose one in that range",
                ),
                Kernel::BSpline => (
                    "--extent between 0.6 and 8 voxels with --kernel bspline",
                    "choose one in that range",
                ),
                _ => ("a positive --extent", "choose a number of voxels, such as 2"),
            };
            return refuse(expected, plain_number(extent), advice);
        }
        if self.extent.is_some() && kernel.natural_extent().is_none() {
            return refuse(
                "--extent with a kernel that has one: all but point, nearest, functions and cells",
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
                plain_number(self.slabs_per_voxel),
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

    /// What basis functions, cells and points can be: evaluated before anything is coloured, in slabs.
    fn check_sources(&self) -> Result<(), ModeError> {
        let refuse = |expected, found: String, advice| Err(ModeError { expected, found, advice });
        match (self.kernel, self.classify) {
            (Kernel::Functions, Classify::Before) => refuse(
                "--kernel functions with values classified after reconstruction",
                "--classify before".to_owned(),
                "choose --classify pre-integrated, or another --kernel",
            ),
            (Kernel::Cells, Classify::Before) => refuse(
                "--kernel cells with values classified after reconstruction",
                "--classify before".to_owned(),
                "choose --classify pre-integrated, or another --kernel",
            ),
            (Kernel::Ellipsoids, Classify::Before) => refuse(
                "--kernel ellipsoids with values classified after reconstruction",
                "--classify before".to_owned(),
                "choose --classify pre-integrated, or another --kernel",
            ),
            (Kernel::Functions, _)
            | (_, Classify::Before | Classify::After | Classify::PreIntegrated) => Ok(()),
            (kernel, Classify::Mean) => refuse(
                "--classify mean with --kernel functions, whose integrals are known",
                format!("--kernel {}", kernel.name()),
                "choose --classify after or pre-integrated",
            ),
        }
    }

    /// What of basis functions can be left out.
    fn check_functions(&self) -> Result<(), ModeError> {
        let refuse = |expected, found: String, advice| Err(ModeError { expected, found, advice });
        let Limits { per_cell, max_rms, .. } = self.functions;
        if let Some(found) = per_cell.filter(|count| !Limits::PER_CELL.contains(count)) {
            return refuse(
                "--functions-per-cell between 1 and 65536",
                found.to_string(),
                "choose a number in that range",
            );
        }
        if !max_rms.is_finite() || max_rms < 0.0 {
            return refuse(
                "--functions-error of 0 or more, in the units of values",
                plain_number(max_rms),
                "choose a number in that range",
            );
        }
        if let Some(found) = self.quick_functions.filter(|rms| !rms.is_finite() || *rms <= 0.0) {
            return refuse(
                "--quick-functions-error above 0, in the units of values",
                plain_number(found),
                "choose a number in that range",
            );
        }
        // What is added for those left out is no function, and has another integral.
        if per_cell.is_some() && self.classify == Classify::Mean {
            return refuse(
                "--functions-per-cell with --classify after or pre-integrated",
                format!("--classify {}", self.classify.name()),
                "choose one of these, or leave --functions-per-cell out",
            );
        }
        Ok(())
    }

    /// What of the basis functions is left out where these are drawn.
    pub fn limits(&self) -> Limits {
        if self.kernel == Kernel::Functions { self.functions } else { Limits::NONE }
    }

    /// What is left out of quick pictures, where these are of functions.
    pub fn quick_limits(&self) -> Option<Limits> {
        let max_rms = self.quick_functions.filter(|_| self.kernel == Kernel::Functions)?;
        let max_rms = max_rms.max(self.functions.max_rms);
        Some(Limits { max_rms, ..self.functions })
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
            extent: self.splatted_extent(),
            opacity_unit_distance: self.opacity_unit_distance,
            backend: Backend::Raster,
            gouraud: self.gouraud,
            cut: self.cut,
            ..Self::SHADE_FIRST
        }
    }

    /// Whether finished pictures in two modes are the same: octree cuts take no part in a reconstructed field, nor what quick
    /// pictures leave out in any.
    pub fn makes_same_picture(&self, other: &Self) -> bool {
        let reconstructs =
            self.visibility == Visibility::Slabs && self.classify != Classify::Before;
        let cut = if reconstructs { other.cut } else { self.cut };
        // Nor do limits of functions where none are drawn.
        let functions =
            if self.limits() == other.limits() { other.functions } else { self.functions };
        let quick_functions = other.quick_functions;
        Self { cut, functions, quick_functions, ..*self } == *other
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

    /// The splat radius of the kernel that footprints stand in with, voxels: as much wider than natural.
    pub fn splatted_extent(&self) -> Option<f64> {
        self.kernel.splatted_extent(self.extent)
    }

    /// Whether kernels of samples side by side leave no gap between them.
    pub fn covers(&self) -> bool {
        self.kernel.reach(self.extent) >= 0.5
    }

    /// Whether kernels are narrower than a pixel and gathered by several rays in each. Where they leave
    /// gaps between the samples, rays would miss them: those are drawn a pixel wide, as triangles always
    /// do.
    pub fn takes_several_rays(&self, view: &View) -> bool {
        self.can_gather() && self.covers() && view.rays_per_side(self.kernel, self.extent) > 1
    }

    /// What of it only triangles draw, where that is why its samples are not gathered by rays.
    pub(super) fn drawn_by_triangles_alone(&self) -> Option<String> {
        if self.can_gather() {
            return None;
        }
        Some(match (self.kernel, self.extent) {
            (Kernel::Gouraud, _) => "--kernel gouraud".to_owned(),
            (_, Some(extent)) if self.backend != Backend::Raster => format!("--extent {extent}"),
            _ => "--backend raster".to_owned(),
        })
    }

    /// Whether its samples may be gathered by rays in tiles.
    pub(super) fn can_gather(&self) -> bool {
        self.kernel != Kernel::Gouraud
            && self.backend != Backend::Raster
            && self.extent.is_none_or(|extent| extent <= MOST_GATHERED_EXTENT)
    }

    /// Whether triangles would show something else: kernels under a pixel, which they widen, or about the
    /// eye, which they see as from their middles.
    fn needs_rays(&self, view: &View) -> bool {
        let is_among = || view.has_eye_within(self.kernel.reach(self.extent));
        self.takes_several_rays(view) || self.can_gather() && is_among()
    }

    /// What draws every voxel in a view where nobody chose and nothing was measured: as
    /// [`SplatSettings::fixed_backend`], and tiles where kernels are narrower than a pixel or about the eye.
    pub fn backend_in(&self, view: &View) -> Backend {
        match self.backend {
            Backend::Auto if self.needs_rays(view) => Backend::Tiles,
            _ => self.fixed_backend(),
        }
    }

    /// Whether nobody chose what draws it, and both can.
    pub fn is_backend_open(&self, view: &View) -> bool {
        self.backend == Backend::Auto
            && !self.needs_tiles()
            && self.kernel != Kernel::Gouraud
            && !self.needs_rays(view)
    }
}

names!(Visibility { EverySample => "every-sample", Sheets => "sheets", Slabs => "slabs" });
names!(OpacityModel { OpticalDepth => "optical-depth", Published => "published" });
names!(Classify {
    Before => "before",
    After => "after",
    PreIntegrated => "pre-integrated",
    Mean => "mean",
});
names!(Reconstruction { Smooth => "smooth", Interpolating => "interpolating" });
names!(Order { BackToFront => "back-to-front", FrontToBack => "front-to-back" });
names!(Backend { Auto => "auto", Raster => "raster", Tiles => "tiles" });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for &visibility in Visibility::ALL {
            assert_eq!(Visibility::from_name(visibility.name()), Some(visibility));
        }
        assert_eq!(Classify::from_name("during"), None);
    }
}
