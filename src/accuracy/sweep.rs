//! What is to be compared, in which order, and what was found: the price list as plain data.

use serde::Serialize;

use crate::gpu::PassTime;
use crate::kernel::Kernel;
use crate::scene::{
    Classify, Ground, ModeChoice, ModeError, OpacityModel, Reconstruction, Scene, SplatSettings,
    Visibility,
};

/// What of a scene is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Detail {
    /// Every voxel.
    Full,
    /// The octree cut of an error (see `hierarchy::Node::error`); drawn shade first.
    Octree {
        /// Greatest error of a node.
        max_error: f32,
    },
}

/// One way of drawing a scene: a line of the price list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setting {
    /// What people call it; one of a list has a name of its own.
    pub name: String,
    /// The mode.
    pub splat: SplatSettings,
    /// Every voxel, or an octree cut.
    pub detail: Detail,
    /// Share of the picture's width and height that is drawn, in 0..=1; less than 1 is enlarged by
    /// linear interpolation.
    pub scale: f64,
}

impl Setting {
    /// Every voxel at full size, named by [`mode_words`].
    pub fn full(splat: SplatSettings) -> Self {
        Self { name: mode_words(&splat), splat, detail: Detail::Full, scale: 1.0 }
    }

    /// The same at a share of the size.
    fn scaled(self, scale: f64) -> Self {
        Self { name: format!("{}, at {}", self.name, fraction(scale)), scale, ..self }
    }

    /// An octree cut.
    fn octree(splat: SplatSettings, max_error: f32) -> Self {
        let name = format!("octree error {max_error}, {}", mode_words(&splat));
        Self { name, detail: Detail::Octree { max_error }, ..Self::full(splat) }
    }
}

/// A mode in few words, such as `slabs ½, linear, pre-integrated`.
pub fn mode_words(splat: &SplatSettings) -> String {
    let mut words = vec![match splat.visibility {
        Visibility::EverySample => "every sample".to_owned(),
        Visibility::Sheets if splat.sheets_per_kernel == 1 => "sheets".to_owned(),
        Visibility::Sheets => format!("{} sheets a kernel", splat.sheets_per_kernel),
        Visibility::Slabs => format!("slabs {}", fraction(splat.slabs_per_voxel)),
    }];
    let sharpened = splat.reconstruction == Reconstruction::Interpolating
        && !matches!(splat.kernel, Kernel::Linear | Kernel::Nearest)
        && splat.kernel.is_of_samples();
    words.push(match sharpened {
        true => format!("{} interpolating", splat.kernel.name()),
        false => splat.kernel.name().to_owned(),
    });
    words.extend(splat.extent.map(|extent| format!("extent {extent}")));
    let limits = splat.limits();
    let corrected = if limits.corrects { "" } else { " uncorrected" };
    words.extend(limits.per_cell.map(|most| format!("{most} functions a cell{corrected}")));
    words.extend((limits.max_rms > 0.0).then(|| format!("functions to {}", limits.max_rms)));
    if splat.visibility == Visibility::Slabs {
        words.push(splat.classify.name().to_owned());
    }
    if splat.opacity_model == OpacityModel::Published {
        words.push(splat.opacity_model.name().to_owned());
    }
    words.join(", ")
}

fn fraction(value: f64) -> String {
    match value {
        0.5 => "½".to_owned(),
        0.25 => "¼".to_owned(),
        0.125 => "⅛".to_owned(),
        _ => value.to_string(),
    }
}

/// The mode whose limit every setting is held to: the exact one, for a scene's opacities; of basis functions, cells and points
/// theirs.
pub fn exact_mode(current: &SplatSettings, slabs_per_voxel: f64) -> SplatSettings {
    let exact = match current.kernel {
        Kernel::Functions => SplatSettings::FUNCTIONS,
        Kernel::Cells => SplatSettings::CELLS,
        Kernel::Ellipsoids => SplatSettings::ELLIPSOIDS,
        _ => SplatSettings::EXACT,
    };
    let opacity_unit_distance = current.opacity_unit_distance;
    SplatSettings { opacity_unit_distance, slabs_per_voxel, ..exact }
}

/// What is compared for a scene that is now drawn with `current`: that mode first, then the rest so
/// that a chart fills usefully, cheap and diverse ones first. No two are drawn alike.
pub fn candidates(current: &SplatSettings) -> Vec<Setting> {
    use Classify::{After, Before, Mean, PreIntegrated};
    use Kernel::{BSpline, Cubic, Gaussian, Gouraud, Linear, Nearest, Point};
    use OpacityModel::{OpticalDepth, Published};
    use Visibility::{EverySample, Sheets};
    let none = ModeChoice {
        opacity_unit_distance: current.opacity_unit_distance,
        backend: None,
        ..ModeChoice::default()
    };
    let resolve = |choice: ModeChoice| choice.resolve().map(Setting::full);
    let whole = |visibility, kernel, model| {
        resolve(ModeChoice {
            visibility: Some(visibility),
            kernel: Some(kernel),
            opacity_model: Some(model),
            ..none
        })
    };
    let every = |kernel| whole(EverySample, kernel, OpticalDepth);
    let slabs = |kernel, classify, slabs_per_voxel: f64| {
        resolve(ModeChoice {
            visibility: Some(Visibility::Slabs),
            kernel: Some(kernel),
            classify: Some(classify),
            slabs_per_voxel: Some(slabs_per_voxel),
            ..none
        })
    };
    let smooth = |kernel| {
        resolve(ModeChoice {
            kernel: Some(kernel),
            reconstruction: Some(Reconstruction::Smooth),
            ..none
        })
    };
    let octree = |max_error| {
        every(Cubic).map(|setting| {
            let splat = SplatSettings { cut: current.cut, ..setting.splat };
            Setting::octree(splat, max_error)
        })
    };
    let scaled = |setting: Result<Setting, ModeError>, scale| {
        setting.map(|setting: Setting| setting.scaled(scale))
    };
    let rest = [
        // A first shape of the front within seconds.
        scaled(slabs(Linear, PreIntegrated, 0.5), 0.25),
        octree(0.2),
        scaled(slabs(BSpline, PreIntegrated, 1.0), 0.25),
        slabs(Linear, PreIntegrated, 0.5),
        every(Cubic),
        slabs(Linear, PreIntegrated, 1.0),
        whole(Sheets, Cubic, OpticalDepth),
        scaled(slabs(BSpline, PreIntegrated, 1.0), 0.5),
        slabs(BSpline, PreIntegrated, 0.5),
        slabs(BSpline, PreIntegrated, 1.0),
        // One of every other kind.
        slabs(Linear, After, 1.0),
        slabs(Cubic, Before, 1.0),
        every(Point),
        every(Nearest),
        octree(0.05),
        scaled(every(Cubic), 0.5),
        scaled(slabs(Linear, PreIntegrated, 1.0), 0.5),
        slabs(Cubic, PreIntegrated, 0.5),
        slabs(Cubic, PreIntegrated, 1.0),
        whole(EverySample, Cubic, Published),
        whole(Sheets, Cubic, Published),
        slabs(Linear, PreIntegrated, 2.0),
        slabs(BSpline, PreIntegrated, 2.0),
        // What fills the lines in.
        octree(0.1),
        octree(0.4),
        every(Gaussian),
        every(Gouraud),
        scaled(every(Cubic), 0.25),
        scaled(slabs(Cubic, PreIntegrated, 1.0), 0.5),
        scaled(slabs(BSpline, PreIntegrated, 2.0), 0.5),
        slabs(Linear, After, 2.0),
        slabs(Linear, Before, 1.0),
        slabs(BSpline, Before, 1.0),
        slabs(Nearest, PreIntegrated, 1.0),
        smooth(BSpline),
        smooth(Cubic),
        smooth(Gaussian),
        slabs(BSpline, After, 1.0),
        slabs(BSpline, After, 2.0),
        slabs(Cubic, Before, 0.5),
        slabs(Cubic, Before, 2.0),
        resolve(ModeChoice {
            visibility: Some(Visibility::Slabs),
            classify: Some(Before),
            opacity_model: Some(Published),
            ..none
        }),
        resolve(ModeChoice { sheets_per_kernel: Some(4), ..none }),
        whole(EverySample, Gaussian, Published),
        slabs(Cubic, PreIntegrated, 2.0),
        slabs(Linear, PreIntegrated, 4.0),
        slabs(Linear, After, 4.0),
        slabs(BSpline, After, 4.0),
        slabs(BSpline, PreIntegrated, 4.0),
    ];
    // Means are of functions alone, and left out of others.
    let of_source = |kernel| {
        [
            slabs(kernel, PreIntegrated, 0.5),
            slabs(kernel, PreIntegrated, 1.0),
            slabs(kernel, After, 1.0),
            slabs(kernel, Mean, 1.0),
            scaled(slabs(kernel, PreIntegrated, 1.0), 0.5),
            slabs(kernel, PreIntegrated, 2.0),
            slabs(kernel, PreIntegrated, 4.0),
            slabs(kernel, After, 4.0),
            slabs(kernel, Mean, 4.0),
        ]
    };
    let own = match current.kernel.is_of_samples() {
        true => Vec::new(),
        false => of_source(current.kernel).to_vec(),
    };
    let mut list = vec![Setting::full(*current)];
    for setting in own.into_iter().chain(rest).flatten() {
        let alike = |other: &Setting| {
            (other.splat, other.detail, other.scale)
                == (setting.splat, setting.detail, setting.scale)
                || other.name == setting.name
        };
        if !list.iter().any(alike) {
            list.push(setting);
        }
    }
    list
}

/// What is compared for a scene: of [`candidates`] those that show all of it. Octree cuts, and kernels that
/// only triangles draw, have nothing beside the field; and of vectors alone kernels and modes of the field
/// change nothing.
pub fn candidates_of(scene: &Scene) -> Vec<Setting> {
    let mut list = candidates(&scene.splat);
    if !scene.shows_field() {
        let of_slabs = |splat: &SplatSettings| exact_mode(&scene.splat, splat.slabs_per_voxel);
        list.retain(|setting| {
            let is_own = setting.splat == scene.splat;
            setting.detail == Detail::Full && (is_own || setting.splat == of_slabs(&setting.splat))
        });
    } else if !scene.vectors().is_empty() || !scene.polygons().is_empty() {
        list.retain(|setting| {
            setting.detail == Detail::Full && Ground::of_mode(&setting.splat).is_none()
        });
    }
    list
}

/// Error at sampled pixels, against the exact integral.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SampledError {
    /// Root mean square over RGB, linear light, black behind.
    pub rmse: f64,
    /// The same in dB, peak 1; +∞ for no error.
    pub psnr_db: f64,
    /// 95 % interval of `rmse`, lower and upper end. `None` where the pixels tell nothing of it: one
    /// alone, or all off by the same.
    pub rmse_interval: Option<[f64; 2]>,
    /// 95 % interval of `psnr_db`, lower and upper end; `None` as there.
    pub psnr_interval_db: Option<[f64; 2]>,
    /// Greatest difference of a channel, alpha included, at the sampled pixels.
    pub max_abs: f64,
    /// Root mean square difference of alpha.
    pub alpha_rmse: f64,
    /// Greatest difference of alpha at the sampled pixels.
    pub alpha_max: f64,
}

/// Error over the whole picture, against `converged`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WholeError {
    /// Root mean square over all pixels and RGB, linear light, black behind.
    pub rmse: f64,
    /// The same in dB, peak 1; +∞ for no error.
    pub psnr_db: f64,
    /// Greatest difference of a channel, alpha included.
    pub max_abs: f64,
    /// Root mean square difference of alpha.
    pub alpha_rmse: f64,
    /// Greatest difference of alpha.
    pub alpha_max: f64,
    /// Mean structural similarity; `None` for pictures under 11 pixels wide or high.
    pub ssim: Option<f64>,
    /// Mean FLIP error, 0 for none.
    pub flip: f64,
}

/// What one setting cost, and how far from the truth it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// Wall milliseconds of each frame, from camera set until its pixels are in memory.
    pub time_ms: Vec<f64>,
    /// Name of the engine that drew it: modes of one table may be drawn by two.
    pub engine: &'static str,
    /// The native engine's compiled loop that drew it; `None` of the other engine.
    pub native_loop: Option<&'static str>,
    /// What the native engine's stages of the first frame took; empty of the other engine.
    pub native_stages: Vec<PassTime>,
    /// Bytes that the engine held when it was drawn.
    pub bytes: u64,
    /// Kernels drawn.
    pub kernels: u64,
    /// Size drawn, before it was enlarged.
    pub drawn_size: [u32; 2],
    /// Error at the sampled pixels.
    pub sampled: SampledError,
    /// Error over the whole picture, where there is a converged one.
    pub whole: Option<WholeError>,
}

impl Measured {
    /// Median of [`Measured::time_ms`].
    pub fn median_ms(&self) -> f64 {
        median(&self.time_ms)
    }
}

/// A line of the price list.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// What was drawn.
    pub setting: Setting,
    /// What was found, or one sentence on why it could not be drawn.
    pub outcome: Result<Measured, String>,
}

/// Median; the mean of the middle two for even counts; NaN for none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0,
    }
}

/// The Pareto front: indices of the points that no other beats in both time and sampled error,
/// quickest first. Points that could not be drawn are on no front.
pub fn front(points: &[Point]) -> Vec<usize> {
    let costs: Vec<_> = points
        .iter()
        .map(|point| {
            point.outcome.as_ref().ok().map(|found| (found.median_ms(), found.sampled.rmse))
        })
        .collect();
    front_of(&costs)
}

/// The same for (time, error) pairs: each on the front has less error than all that are as quick or
/// quicker. Of equals the first is on it; NaN and `None` never are.
pub fn front_of(costs: &[Option<(f64, f64)>]) -> Vec<usize> {
    let mut order: Vec<(usize, f64, f64)> = costs
        .iter()
        .enumerate()
        .filter_map(|(i, cost)| cost.map(|(time, error)| (i, time, error)))
        .filter(|(_, time, error)| !time.is_nan() && !error.is_nan())
        .collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)).then(a.0.cmp(&b.0)));
    let mut least = f64::INFINITY;
    order.retain(|&(_, _, error)| {
        let better = error < least;
        least = least.min(error);
        better
    });
    order.into_iter().map(|(i, _, _)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats_in_both() {
        let at = |time, error| Some((time, error));
        let costs = [at(5.0, 0.1), at(1.0, 0.5), at(2.0, 0.6), at(2.0, 0.3), None, at(9.0, 0.1)];
        assert_eq!(front_of(&costs), [1, 3, 0]);
        // Equal twins: the first. The same error for more time: not.
        assert_eq!(front_of(&[at(1.0, 0.5), at(1.0, 0.5), at(2.0, 0.5)]), [0]);
        assert_eq!(front_of(&[at(f64::NAN, 0.0), at(1.0, f64::NAN), None]), [0_usize; 0]);
        assert_eq!(front_of(&[at(3.0, 0.0), at(2.0, 0.0)]), [1]);
    }

    #[test]
    fn every_point_off_the_front_is_beaten_by_one_on_it() {
        // A fixed scatter: multiples of irrational steps.
        let costs: Vec<_> = (1..=200)
            .map(|i| Some(((f64::from(i) * 0.618).fract(), (f64::from(i) * 0.414).fract())))
            .collect();
        let front = front_of(&costs);
        assert!((2..60).contains(&front.len()), "{}", front.len());
        for (i, cost) in costs.iter().enumerate() {
            let beaten = front.iter().any(|&j| {
                let ((t, e), (time, error)) = (costs[j].unwrap(), cost.unwrap());
                j != i && t <= time && e <= error
            });
            assert_eq!(beaten, !front.contains(&i), "{i}");
        }
    }

    #[test]
    fn candidates_mean_something_and_are_all_different() {
        for current in [
            SplatSettings::EXACT,
            SplatSettings::SHADE_FIRST,
            SplatSettings::FUNCTIONS,
            SplatSettings::CELLS,
            SplatSettings::ELLIPSOIDS,
        ] {
            let list = candidates(&SplatSettings { opacity_unit_distance: Some(0.3), ..current });
            assert!((40..66).contains(&list.len()), "{}", list.len());
            for (i, setting) in list.iter().enumerate() {
                assert_eq!(setting.splat.check(), Ok(()), "{}", setting.name);
                assert_eq!(setting.splat.opacity_unit_distance, Some(0.3));
                assert!(list[..i].iter().all(|other| other.name != setting.name), "{i}");
            }
            assert!(list[0].splat.kernel == current.kernel && list[0].scale == 1.0);
            // Every mode, kernel and resolution, within the first two dozen or so.
            for &visibility in Visibility::ALL {
                assert!(list[..24].iter().any(|s| s.splat.visibility == visibility));
            }
            for kernel in Kernel::ALL {
                let is_there = list.iter().any(|s| s.splat.kernel == kernel);
                let is_own = kernel == current.kernel;
                assert!(is_there == (kernel.is_of_samples() || is_own), "{kernel:?}");
            }
            for slabs in [0.5, 1.0, 2.0, 4.0] {
                let exact = exact_mode(&list[0].splat, slabs);
                assert!(list.iter().any(|s| s.splat == exact && s.scale == 1.0), "{slabs}");
            }
            assert!(list.iter().filter(|s| s.detail != Detail::Full).count() >= 4);
            assert!(list.iter().any(|s| s.scale == 0.5) && list.iter().any(|s| s.scale == 0.25));
        }
    }

    /// Nothing is measured that leaves out what a scene shows, or differs by what it does not.
    #[test]
    fn candidates_of_a_scene_show_all_of_it() {
        let lattice = crate::volume::Lattice::unit([2; 3]);
        let samples = crate::volume::Samples::UInt8(vec![1; 8]);
        let volume = crate::volume::ScalarVolume::from_samples("t", lattice, samples).unwrap();
        let mut scene =
            crate::scene::opening(Default::default(), std::sync::Arc::new(volume), None);
        scene.splat = SplatSettings::EXACT;
        let all = candidates(&scene.splat);
        assert_eq!(candidates_of(&scene), all);
        let vectors = vec![glam::Vec3::X; 8].into();
        let places = crate::volume::Places::Lattice(lattice);
        let ticket = crate::core::Ticket::new();
        let field = crate::volume::VectorField::new("v", places, vectors, &ticket).unwrap();
        let layer = crate::scene::VectorLayer::new(std::sync::Arc::new(field));
        let mut scene = scene.with(layer);
        let beside = candidates_of(&scene);
        assert!(beside.len() > 30 && beside.len() < all.len(), "{}", beside.len());
        assert!(
            beside.iter().all(|s| s.detail == Detail::Full && s.splat.kernel != Kernel::Gouraud)
        );
        scene.show_field(false);
        let alone = candidates_of(&scene);
        assert_eq!(alone[0], all[0]);
        assert!((6..12).contains(&alone.len()), "{}", alone.len());
        assert!(alone.iter().all(|s| s.splat.classify == Classify::PreIntegrated));
        assert!(alone.iter().all(|s| s.detail == Detail::Full));
        scene.splat = SplatSettings { kernel: Kernel::Cubic, ..SplatSettings::SHADE_FIRST };
        let own = candidates_of(&scene);
        assert_eq!(own[0].splat, scene.splat);
        let is_own = |s: &Setting| s.splat == scene.splat;
        assert!(own.iter().all(|s| is_own(s) || s.splat.classify == Classify::PreIntegrated));
        for slabs in [0.5, 1.0, 2.0, 4.0] {
            assert!(own.iter().any(|s| s.splat == exact_mode(&scene.splat, slabs)), "{slabs}");
        }
    }

    #[test]
    fn medians_are_of_sorted_values() {
        assert_eq!(median(&[3.0, 100.0, 1.0]), 3.0);
        assert_eq!(median(&[4.0, 1.0]), 2.5);
        assert!(median(&[]).is_nan());
    }
}
