//! How what is seen is lit, and what its opacities and colours are looked up by: Westover's
//! table-driven shading process, as plain data.
//!
//! Of a point with opacity α and colour c by the transfer function, normal N (down the gradient,
//! turned to the eye), direction V to the eye, lights of colour Iⱼ in directions Lⱼ and their
//! reflections Rⱼ = 2(N·Lⱼ)N − Lⱼ:
//!
//! - extinction: κ(α) · modulation,
//! - light: emission + reflection · (ambient + diffuse Σ Iⱼ max(N·Lⱼ, 0))
//!   + specular Σ Iⱼ max(Rⱼ·V, 0)ⁿ, where N·Lⱼ > 0.
//!
//! After reconstruction, points are slabs, with the field's gradient: that in the middle where only the value there is
//! classified ([`Classify::After`], [`Classify::Mean`]), else those on the two faces. Tables look up the mean of the two. Lights
//! fall on all gradients of the straight line from one to the other, which changes its direction as the field's does, quickly where
//! it is short: it is parted where it lies across V, since N changes its side there, and each part g₀..g₁ once more halfway in
//! direction, at a share s = |g₀| / (|g₀| + |g₁|) of it; what is left is lit as its ends are, each weighed by its gradient's length.
//! So light is of second order in how thick slabs are. One light for the mean gradient would be off by all of a light's
//! brightness in slabs within which N turns, however thin, and pictures would converge at first order.
//!
//! Shaded first ([`Classify::Before`]), points are samples, with that of the samples beside them: central differences,
//! one-sided at the borders and beside samples without data. V and the depth in the view are those of the sample's own place.
//!
//! Where cells end, lights fall on their border rather than on the gradient behind it ([`crate::cells::ShadingNormals`],
//! [`Shading::lights_borders`]).
//!
//! Numbers that name things have no gradient, as what lies between two names is neither. Lights fall on where the thing ends that a
//! point is in ([`Shading::lights_names`]): for the gradient per index they take R Σ wᵢ (i − x) / Σ wᵢ over the samples i with
//! another name than the one nearest to the point x, R being the range of the numbers and wᵢ the product over the axes of
//! (1 − ((i − x) / ([`NAMES_REACH`] + ½))²)². Beyond the border lies what lies at it.
//!
//! Each of the four tables may be indexed by any [`Index`]; the transfer function is those of opacity
//! and reflection by value.

mod presets;

pub use presets::{ShadingPreset, strong_gradient};

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use crate::core::{Camera, Srgb8, names, plain_number, plain_numbers};
use crate::kernel::Kernel;
use crate::scene::{Classify, Effect, Inside, SplatSettings};
use crate::transfer::{
    Region, RegionError, TRANSMITTANCE_FLOOR, TransferFunction, extinction_from_opacity,
    interpolate, labels_of, regions,
};
use crate::volume::{Lattice, ScalarVolume};

/// Lights in a scene at most.
pub const MOST_LIGHTS: usize = 8;
/// Below this gradient strength, in parts of the volume's range of values per smallest spacing, there
/// is no direction to be lit from: a few steps of the 16 bits that fields are kept in. Light that falls on it is scattered to all
/// sides, as by faces turned every way in the mean. Over as much again directions set in.
pub const LEAST_STRENGTH: f64 = 1e-4;

/// Samples to either side of the one nearest to a point, along each axis, that tell how the border of the thing is turned that it is in.
/// Steps of voxels as long as these are seen as the slope that they stand for.
pub const NAMES_REACH: i32 = 2;

/// What a table is indexed by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Index {
    /// The value, in the data's units.
    Value,
    /// The gradient's length, data units per world unit.
    GradientStrength,
    /// The angle of the direction down the gradient above the world's x–y plane, degrees, −90..=90.
    GradientElevation,
    /// Its angle about the world's z axis from x towards y, degrees, −180..=180.
    GradientAzimuth,
    /// Depth in the view: 0 where the sphere around the volume begins, 1 where it ends.
    ViewDepth,
}

names!(Index {
    Value => "value",
    GradientStrength => "gradient-strength",
    GradientElevation => "gradient-elevation",
    GradientAzimuth => "gradient-azimuth",
    ViewDepth => "view-depth",
});

impl Index {
    /// Whether it is known from the gradient alone.
    pub fn is_of_gradient(self) -> bool {
        matches!(self, Self::GradientStrength | Self::GradientElevation | Self::GradientAzimuth)
    }
}

/// Amounts by an index: between points linearly, beyond them as at the ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Amounts {
    /// What it is looked up by.
    pub index: Index,
    /// (index, amount in 0..=1), sorted by index, at least one.
    pub points: Vec<(f64, f64)>,
}

/// Colours by an index, likewise, interpolated in sRGB.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Colours {
    /// What they are looked up by.
    pub index: Index,
    /// (index, colour), sorted by index, at least one.
    pub stops: Vec<(f64, Srgb8)>,
}

/// What a light turns with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Attached {
    /// The camera: it stays where it is on the picture.
    #[default]
    Camera,
    /// The data.
    Data,
}

/// A directional light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Towards the light: in the world, or to the right, up, and from the scene to the eye. Of any
    /// length but 0.
    pub direction: DVec3,
    /// Its colour.
    pub colour: Srgb8,
    /// What it turns with.
    pub attached: Attached,
}

impl Light {
    /// White, from above the viewer's left shoulder.
    pub const HEADLIGHT: Self = Self {
        direction: DVec3::new(-0.3, 0.4, 1.0),
        colour: Srgb8([255; 3]),
        attached: Attached::Camera,
    };

    /// Unit vector towards it in the world.
    pub fn towards(&self, camera: &Camera) -> DVec3 {
        let DVec3 { x, y, z } = self.direction;
        let world = match self.attached {
            Attached::Data => self.direction,
            Attached::Camera => camera.right() * x + camera.up * y - camera.direction * z,
        };
        world.normalize_or_zero()
    }
}

/// What a surface makes of lights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lighting {
    /// Share of the colour that is seen without any light.
    pub ambient: f64,
    /// Share that is scattered evenly.
    pub diffuse: f64,
    /// Share of the light that is mirrored.
    pub specular: f64,
    /// How narrowly, n of (R·V)ⁿ.
    pub exponent: f64,
    /// The lights, up to [`MOST_LIGHTS`].
    pub lights: Vec<Light>,
}

impl Default for Lighting {
    fn default() -> Self {
        Self {
            ambient: 0.25,
            diffuse: 0.85,
            specular: 0.2,
            exponent: 20.0,
            lights: vec![Light::HEADLIGHT],
        }
    }
}

impl Lighting {
    /// Whether any light has anything to fall on.
    pub fn uses_lights(&self) -> bool {
        !self.lights.is_empty() && (self.diffuse > 0.0 || self.specular > 0.0)
    }
}

/// The tables and the lights of a scene. By default nothing: colours shine by themselves.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Shading {
    /// Opacity per unit distance, in place of the transfer function's.
    pub opacity: Option<Amounts>,
    /// What the extinction is multiplied by.
    pub modulation: Option<Amounts>,
    /// Colours in place of the transfer function's.
    pub reflection: Option<Colours>,
    /// Light that is there without lights.
    pub emission: Option<Colours>,
    /// Lights; without them the reflection's colours shine by themselves.
    pub lighting: Option<Lighting>,
    /// Opacities and colours by value and gradient strength together, in place of the transfer
    /// function's opacities. A table of opacity takes their place in turn.
    pub regions: Vec<Region>,
}

/// What is no shading.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShadingError {
    /// A table with nothing in it.
    #[error("expected at least one point in the {table} table, found none")]
    Empty {
        /// Which table.
        table: &'static str,
    },
    /// NaN or ±∞ as an index.
    #[error("expected finite numbers in the {table} table, found {found}")]
    NotFinite {
        /// Which table.
        table: &'static str,
        /// The offending number.
        found: f64,
    },
    /// Points out of order.
    #[error(
        "expected the {table} table sorted by its index, found {} after {}",
        plain_number(*after), plain_number(*before)
    )]
    Unsorted {
        /// Which table.
        table: &'static str,
        /// The greater index that comes first.
        before: f64,
        /// The lesser one that follows.
        after: f64,
    },
    /// A share that is none.
    #[error("expected {of} from 0 to {most}, found {}", plain_number(*found))]
    Share {
        /// Amounts of a table, ambient, diffuse, specular.
        of: &'static str,
        /// The most it may be.
        most: f64,
        /// The offending number.
        found: f64,
    },
    /// Too many lights.
    #[error("expected at most {MOST_LIGHTS} lights, found {found}")]
    Lights {
        /// How many.
        found: usize,
    },
    /// A light from nowhere.
    #[error(
        "expected a light's direction of finite length other than 0, found {}",
        plain_numbers(found.to_array())
    )]
    Direction {
        /// The offending vector.
        found: DVec3,
    },
    /// A region that is none.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// A mode whose kernels are not lit.
    #[error(
        "expected a mode that tiles draw where there are lights, shading tables or regions by gradient, \
         found {found}; choose --backend auto and another kernel than gouraud, no wider than 8 voxels, \
         or leave the shading out"
    )]
    Mode {
        /// Of the mode, what only triangles draw.
        found: String,
    },
}

impl Amounts {
    /// The amount at an index; NaN is taken as 0.
    pub fn at(&self, index: f64) -> f64 {
        interpolated(&self.points, index, |&amount| [amount])[0]
    }
}

impl Colours {
    /// The linear colour at an index; NaN is taken as 0.
    pub fn at(&self, index: f64) -> [f64; 3] {
        let encoded = interpolated(&self.stops, index, |colour| colour.encoded());
        encoded.map(crate::core::colour::linear_from_srgb)
    }
}

/// See [`interpolate`]; NaN is taken as 0, and no points as nothing.
fn interpolated<T, const N: usize>(
    points: &[(f64, T)],
    index: f64,
    value: impl Fn(&T) -> [f64; N],
) -> [f64; N] {
    let index = if index.is_nan() { 0.0 } else { index };
    interpolate(points, index, value).unwrap_or([0.0; N])
}

impl Shading {
    /// Whether nothing is asked for: pictures are of the transfer function alone.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// Whether pictures of a mode show lights and tables; those of others show the transfer function
    /// alone.
    pub fn is_shown_by(splat: &SplatSettings) -> bool {
        splat.classify != Classify::Before || splat.can_gather()
    }

    /// Whether samples are shaded in a mode, before kernels are put together.
    pub fn is_of_samples(&self, splat: &SplatSettings) -> bool {
        !self.is_plain() && splat.classify == Classify::Before && Self::is_shown_by(splat)
    }

    /// What surfaces in a field are lit by: its lights, or where there are none the usual ones for isosurfaces, which
    /// would be flat.
    pub fn surface_lighting(&self, inside: &Inside) -> Option<Lighting> {
        let usual = || inside.has_isosurfaces().then(Lighting::default);
        self.lighting.clone().or_else(usual)
    }

    /// What polygons are lit by: its lights, or where there are none the usual ones.
    pub fn polygon_lighting(&self) -> Lighting {
        self.lighting.clone().unwrap_or_default()
    }

    /// What its tables are indexed by.
    pub fn indices(&self) -> impl Iterator<Item = Index> {
        let amounts = [&self.opacity, &self.modulation].map(|t| t.as_ref().map(|t| t.index));
        let colours = [&self.reflection, &self.emission].map(|t| t.as_ref().map(|t| t.index));
        amounts.into_iter().chain(colours).flatten()
    }

    /// The regions that opacities are looked up by.
    pub fn painted(&self) -> &[Region] {
        if self.opacity.is_some() { &[] } else { &self.regions }
    }

    /// Whether anything asks for the field's gradient.
    pub fn uses_gradient(&self) -> bool {
        !self.painted().is_empty()
            || self.lighting.as_ref().is_some_and(Lighting::uses_lights)
            || self.indices().any(Index::is_of_gradient)
    }

    /// Whether cells are lit as their border is turned where they end: where only lights ask for the gradient. Tables and
    /// regions look up how the field itself grows, and are lit by that.
    pub fn lights_borders(&self) -> bool {
        self.lighting.as_ref().is_some_and(Lighting::uses_lights)
            && self.painted().is_empty()
            && !self.indices().any(Index::is_of_gradient)
    }

    /// Whether light falls on where things end that a volume's numbers name: where each place has the name of the sample
    /// nearest to it, and only lights ask for the gradient.
    pub fn lights_names(&self, mode: &SplatSettings, volume: &ScalarVolume) -> bool {
        self.lights_borders()
            && mode.kernel == Kernel::Nearest
            && mode.classify.takes_one_value()
            && !labels_of(&volume.statistics).is_empty()
    }

    /// What it asks for.
    pub fn effects(&self) -> Vec<Effect> {
        let Self { opacity, modulation, reflection, emission, lighting, .. } = self;
        let asked = [
            (self.uses_gradient(), Effect::Gradients),
            (lighting.is_some(), Effect::Lights),
            (!self.painted().is_empty(), Effect::Regions),
            (opacity.is_some(), Effect::OpacityTable),
            (modulation.is_some(), Effect::ModulationTable),
            (reflection.is_some(), Effect::ReflectionTable),
            (emission.is_some(), Effect::EmissionTable),
        ];
        asked.into_iter().filter_map(|(is_asked, effect)| is_asked.then_some(effect)).collect()
    }

    /// Whether it means something, and a mode can draw it.
    ///
    /// # Errors
    /// See [`ShadingError`].
    pub fn check(&self, splat: &SplatSettings) -> Result<(), ShadingError> {
        let amounts = [(&self.opacity, "opacity"), (&self.modulation, "modulation")];
        for (table, amounts) in amounts.iter().filter_map(|(t, name)| Some((*name, t.as_ref()?))) {
            check_indices(table, &amounts.points)?;
            for &(_, found) in &amounts.points {
                check_share("the amounts of a shading table", 1.0, found)?;
            }
        }
        let colours = [(&self.reflection, "reflection"), (&self.emission, "emission")];
        for (table, colours) in colours.iter().filter_map(|(t, name)| Some((*name, t.as_ref()?))) {
            check_indices(table, &colours.stops)?;
        }
        if let Some(Lighting { ambient, diffuse, specular, exponent, lights }) = &self.lighting {
            check_share("ambient light", 1.0, *ambient)?;
            check_share("diffuse reflection", 1.0, *diffuse)?;
            check_share("specular reflection", 1.0, *specular)?;
            check_share("the specular exponent", 1000.0, *exponent)?;
            if lights.len() > MOST_LIGHTS {
                return Err(ShadingError::Lights { found: lights.len() });
            }
            for light in lights {
                let length = light.direction.length();
                if !(length.is_finite() && length > 0.0) {
                    return Err(ShadingError::Direction { found: light.direction });
                }
            }
        }
        regions::validate(&self.regions)?;
        match splat.drawn_by_triangles_alone() {
            Some(found) if !self.is_plain() && !Self::is_shown_by(splat) => {
                Err(ShadingError::Mode { found })
            }
            _ => Ok(()),
        }
    }

    /// The transfer function as far as values decide: where opacity has another index, every value has
    /// as much as there is, [`BASE_OPACITY`]; so have those of regions, and all others nothing.
    pub fn by_value(&self, transfer: &TransferFunction) -> TransferFunction {
        let mut transfer = transfer.clone();
        if self.opacity.is_some() {
            transfer.opacity = vec![(0.0, BASE_OPACITY)];
        } else if !self.regions.is_empty() {
            let step = |[low, high]: [f64; 2]| {
                [(low, 0.0), (low, BASE_OPACITY), (high, BASE_OPACITY), (high, 0.0)]
            };
            transfer.opacity =
                regions::values_of(&self.regions).into_iter().flat_map(step).collect();
        }
        transfer
    }

    /// 1 over the weight that every value has where opacity has another index: its extinction, or
    /// where `published` its opacity.
    pub fn opacity_factor_of_one(published: bool) -> f64 {
        1.0 / if published { BASE_OPACITY } else { extinction_from_opacity(BASE_OPACITY) }
    }

    /// What the weight by value is multiplied by where opacity has another index and is `alpha`.
    pub fn opacity_factor(alpha: f64, published: bool) -> f64 {
        let weight = match published {
            true => alpha.min(1.0 - TRANSMITTANCE_FLOOR),
            false => extinction_from_opacity(alpha),
        };
        weight * Self::opacity_factor_of_one(published)
    }
}

/// Opacity of every value where opacities are not looked up by value.
pub const BASE_OPACITY: f64 = 0.5;

fn check_indices<T>(table: &'static str, points: &[(f64, T)]) -> Result<(), ShadingError> {
    if points.is_empty() {
        return Err(ShadingError::Empty { table });
    }
    if let Some(&(found, _)) = points.iter().find(|(at, _)| !at.is_finite()) {
        return Err(ShadingError::NotFinite { table, found });
    }
    match points.windows(2).find(|pair| pair[1].0 < pair[0].0) {
        Some(pair) => Err(ShadingError::Unsorted { table, before: pair[0].0, after: pair[1].0 }),
        None => Ok(()),
    }
}

fn check_share(of: &'static str, most: f64, found: f64) -> Result<(), ShadingError> {
    if (0.0..=most).contains(&found) {
        Ok(())
    } else {
        Err(ShadingError::Share { of, most, found })
    }
}

/// What a scene's shading needs of its camera and volume, the same for every point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadingSpace {
    /// World gradient of a gradient in index space.
    pub world_from_gradient: DMat3,
    /// Strength below which a gradient has no direction, data units per world unit.
    pub least_strength: f64,
    /// Radius of the sphere around the volume, world units.
    pub radius: f64,
}

impl ShadingSpace {
    /// Of values on a lattice, if there are any.
    pub fn of(lattice: &Lattice, values: Option<&ScalarVolume>) -> Self {
        let [least, most] =
            values.map_or([0.0; 2], |values| [values.statistics.min, values.statistics.max]);
        // Halved, so that ±1e308 does not overflow.
        let range = 2.0 * (most / 2.0 - least / 2.0);
        // What is within the rounding of the samples themselves is no growth: a constant field has none.
        let rounding = f64::from(f32::EPSILON) * least.abs().max(most.abs());
        let growth = (LEAST_STRENGTH * range).max(rounding).max(f64::MIN_POSITIVE);
        Self {
            world_from_gradient: lattice.axes().inverse().transpose(),
            least_strength: growth / lattice.smallest_spacing(),
            radius: lattice.bounding_radius(),
        }
    }

    /// How much of its lights falls on a face at a point of this gradient strength, 0..=1; the rest is scattered to all sides.
    pub fn lit_share(&self, strength: f64) -> f64 {
        (strength / self.least_strength - 1.0).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::scene::Backend;
    use crate::transfer::{ColourMap, ColourSource, RegionShape};

    fn region(values: [f64; 2]) -> Region {
        let (shape, strengths) = (RegionShape::Ellipse, [1.0, 5.0]);
        Region { shape, values, strengths, softness: 0.5, opacity: 0.8, colour: None }
    }

    #[test]
    fn regions_ask_for_gradients_and_slabs_until_a_table_takes_their_place() {
        let regions = vec![region([3.0, 4.0]), region([8.0, 9.0])];
        let mut shading = Shading { regions, ..Shading::default() };
        assert!(!shading.is_plain() && shading.uses_gradient());
        assert_eq!(shading.effects(), [Effect::Gradients, Effect::Regions]);
        assert_eq!(shading.check(&SplatSettings::EXACT), Ok(()));
        let first = SplatSettings::SHADE_FIRST;
        assert_eq!(shading.check(&first), Ok(()));
        for (mode, what) in [
            (SplatSettings { kernel: Kernel::Gouraud, ..first }, "--kernel gouraud"),
            (SplatSettings { backend: Backend::Raster, ..first }, "--backend raster"),
            (SplatSettings { extent: Some(9.0), ..first }, "--extent 9"),
        ] {
            let refused = shading.check(&mode).unwrap_err().to_string();
            assert!(refused.contains("regions by gradient") && refused.contains(what), "{refused}");
        }
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 9.0] };
        let transfer = TransferFunction::of(vec![(0.0, 0.9)], colour);
        let by_value = shading.by_value(&transfer);
        assert_eq!(by_value.validate(), Ok(()));
        let opacities = [2.9, 3.5, 6.0, 8.0, 9.1].map(|value| by_value.opacity_at(value));
        assert_eq!(opacities, [0.0, BASE_OPACITY, 0.0, BASE_OPACITY, 0.0]);
        shading.opacity = Some(Amounts { index: Index::Value, points: vec![(0.0, 0.5)] });
        assert!(shading.painted().is_empty() && !shading.uses_gradient());
        assert_eq!(shading.effects(), [Effect::OpacityTable]);
        assert_eq!(shading.by_value(&transfer).opacity_at(6.0), BASE_OPACITY);
        shading.regions[1].values = [9.0, 8.0];
        assert!(matches!(shading.check(&SplatSettings::EXACT), Err(ShadingError::Region(_))));
    }
}
