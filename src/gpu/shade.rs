//! Shading tables and lights on the device (`shaders/lib/shade.wgsl`).

use glam::{DMat3, DVec3};

use super::layout::{self, SHADE_ENTRIES, narrow, narrow4};
use super::pipelines::flag;
use crate::plan::Plan;
use crate::scene::{Amounts, Colours, Index, OpacityModel, Shading, ShadingSpace};
use crate::transfer::{Region, RegionShape};

/// What of shading a pipeline is made for: what is not asked for is not compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct ShadeVariant {
    /// What opacity, modulation, reflection and emission are indexed by, as the shader numbers it.
    pub by: [u32; 4],
    pub is_lit: bool,
    pub lights: u32,
    pub uses_gradient: bool,
    /// Whether light falls on the border of cells.
    pub of_borders: bool,
    /// Whether it falls on where things end that numbers name.
    pub of_names: bool,
    /// Whether tents are lit by their own derivative.
    pub quickly: bool,
    /// Regions of value and gradient strength.
    pub regions: u32,
}

impl ShadeVariant {
    /// The shader's overrides.
    pub(super) fn constants(&self) -> Vec<(&'static str, f64)> {
        let names = ["opacity_by", "modulation_by", "reflection_by", "emission_by"];
        let tables = names.into_iter().zip(self.by.map(f64::from));
        let more = [
            ("lit", flag(self.is_lit)),
            ("lights", f64::from(self.lights)),
            ("uses_gradient", flag(self.uses_gradient)),
        ];
        let regions = ("region_count", f64::from(self.regions));
        tables.chain(more).chain([regions]).collect()
    }
}

/// A scene's shading, ready for fields of any table and size.
#[derive(Debug, Clone)]
pub(super) struct Shade {
    pub variant: ShadeVariant,
    /// It is there for isosurfaces alone.
    pub is_of_surfaces: bool,
    constants: layout::Shade,
    /// Rows of the map from gradients per index in data units to the world's.
    world_from_gradient: DMat3,
    /// What strengths are counted in on the device, a power of two near the least that has a direction: neither data nor world units
    /// take them beyond single precision.
    strength_unit: f64,
    /// How far the field's values are apart at most.
    range: f64,
    /// World units.
    radius: f64,
    /// Of each table: what it is indexed by, the index of its first entry, and entries per index.
    places: [(Index, f64, f64); 4],
    regions: Vec<Region>,
}

/// Where a value lies in a field's table of values: cells = `at_zero` + `per_value` · value.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellsOfValues {
    pub at_zero: f64,
    pub per_value: f64,
}

impl Shade {
    /// `None` where a plan asks for none, or has no field.
    pub(super) fn of(plan: &Plan) -> Option<Self> {
        let field = plan.field()?;
        let shading = &plan.shading;
        let has_surfaces = plan.inside.has_isosurfaces();
        if shading.is_plain() && !has_surfaces {
            return None;
        }
        let published = plan.mode.opacity_model == OpacityModel::Published;
        let space = ShadingSpace::of(&plan.frame.lattice, Some(&field.volume));
        let camera = &plan.camera;
        let [right, up, forward] = [camera.right(), camera.up, camera.direction];
        let mut constants = layout::Shade {
            right: narrow4(right, 0.0),
            up: narrow4(up, 0.0),
            forward: narrow4(forward, 0.0),
            ..bytemuck::Zeroable::zeroed()
        };
        // Of a constant over huge steps that is 0.
        let least_strength = space.least_strength.max(f64::MIN_POSITIVE);
        let strength_unit = least_strength.log2().round().exp2();
        constants.world_x[3] = narrow(strength_unit / least_strength);
        constants.world_z[3] = narrow(Shading::opacity_factor_of_one(published));
        let mut lights = 0;
        if let Some(lighting) = &plan.shading.surface_lighting(&plan.inside) {
            let shares = [lighting.ambient, lighting.diffuse, lighting.specular, lighting.exponent];
            constants.material = shares.map(narrow);
            if lighting.uses_lights() {
                for (i, light) in lighting.lights.iter().take(layout::MOST_LIGHTS).enumerate() {
                    constants.towards[i] = narrow4(light.towards(camera), 0.0);
                    constants.colours[i] = narrow4(DVec3::from(light.colour.to_linear().0), 0.0);
                    lights += 1;
                }
            }
        }
        let mut by = [0; 4];
        let mut places = [(Index::Value, 0.0, 0.0); 4];
        let mut table =
            |which: usize, index: Index, ends: [f64; 2], at: &dyn Fn(f64) -> [f64; 3]| {
                by[which] = number(index);
                let last = (SHADE_ENTRIES - 1) as f64;
                let [low, high] = ends;
                // A table of one point is the same everywhere.
                let per_index = if high > low { last / (high - low) } else { 0.0 };
                places[which] = (index, low, per_index);
                for i in 0..SHADE_ENTRIES {
                    let share = i as f64 / last;
                    let colour = at(low * (1.0 - share) + high * share);
                    constants.tables[which * SHADE_ENTRIES + i] = narrow4(DVec3::from(colour), 0.0);
                }
            };
        for (which, amounts) in [&shading.opacity, &shading.modulation].into_iter().enumerate() {
            if let Some(Amounts { index, points }) = amounts {
                let at = |q: f64| amounts.as_ref().map_or([0.0; 3], |a| [a.at(q), 0.0, 0.0]);
                table(which, *index, ends(points), &at);
            }
        }
        for (which, colours) in [&shading.reflection, &shading.emission].into_iter().enumerate() {
            if let Some(Colours { index, stops }) = colours {
                let at = |q: f64| colours.as_ref().map_or([0.0; 3], |c| c.at(q));
                table(2 + which, *index, ends(stops), &at);
            }
        }
        let variant = ShadeVariant {
            by,
            is_lit: shading.lighting.is_some(),
            lights,
            uses_gradient: shading.uses_gradient() || has_surfaces,
            of_borders: shading.lights_borders(),
            of_names: shading.lights_names(&plan.mode, &field.volume),
            quickly: false,
            regions: shading.painted().len() as u32,
        };
        Some(Self {
            variant,
            is_of_surfaces: shading.is_plain(),
            constants,
            world_from_gradient: space.world_from_gradient,
            strength_unit,
            range: field.volume.statistics.max - field.volume.statistics.min,
            radius: space.radius,
            places,
            regions: shading.painted().to_vec(),
        })
    }

    /// Writes regions for a table of values.
    fn write_regions(&self, constants: &mut layout::Shade, values: CellsOfValues) {
        for (i, region) in self.regions.iter().take(layout::MOST_REGIONS).enumerate() {
            let [low, high] = region.values.map(|v| values.at_zero + v * values.per_value);
            let [weak, strong] = match (region.shape, region.strengths) {
                // It has no border at 0: as if it went as far beyond.
                (RegionShape::Rectangle, [weak, strong]) if weak <= 0.0 => [-strong, strong],
                (_, strengths) => strengths,
            }
            .map(|strength| strength / self.strength_unit);
            let place = |low: f64, high: f64| [f64::midpoint(low, high), 2.0 / (high - low)];
            let ([u, per_u], [g, per_g]) = (place(low, high), place(weak, strong));
            constants.region_places[i] = [u, per_u, g, per_g].map(narrow);
            let colour = region.colour.map_or([0.0; 3], |colour| colour.to_linear().0);
            constants.region_looks[i] = narrow4(DVec3::from(colour), region.opacity);
            let as_flag = |is: bool| f32::from(u8::from(is));
            constants.region_shapes[i] = [
                narrow(1.0 / region.softness.max(1e-6)),
                as_flag(region.shape == RegionShape::Ellipse),
                as_flag(region.shape == RegionShape::Triangle),
                as_flag(region.colour.is_none()),
            ];
        }
    }

    /// The shader's uniform for a field that was halved `level` times, and is taken to grow so much per index at the border of the cells
    /// that it is samples of, if of any.
    pub(super) fn constants(
        &self,
        values: CellsOfValues,
        (level, border_strength): (u32, Option<f64>),
        pixels_per_unit: f64,
        ray_growth: f32,
    ) -> layout::Shade {
        let mut constants = self.constants;
        // Of means, an index is 2^level samples; values in data units.
        let scale = 1.0 / (f64::from(1_u32 << level) * values.per_value);
        let rows = (self.world_from_gradient * scale * self.strength_unit.recip()).transpose();
        let set = |row: &mut [f32; 4], v: DVec3| *row = narrow4(v, f64::from(row[3]));
        set(&mut constants.world_x, rows.x_axis);
        set(&mut constants.world_y, rows.y_axis);
        set(&mut constants.world_z, rows.z_axis);
        let at_ends = if self.variant.of_names { Some(self.range) } else { border_strength };
        constants.world_y[3] = narrow(at_ends.unwrap_or(0.0) * values.per_value);
        constants.right[3] = narrow(self.radius * pixels_per_unit);
        constants.up[3] = ray_growth;
        for (place, (index, low, per_index)) in constants.places.iter_mut().zip(self.places) {
            // By value, the shader knows the cell.
            let (zero, unit) = match index {
                Index::Value => (values.at_zero, values.per_value),
                Index::GradientStrength => (0.0, self.strength_unit.recip()),
                _ => (0.0, 1.0),
            };
            let per_unit = per_index / unit;
            *place = [narrow(-(low * unit + zero) * per_unit), narrow(per_unit), 0.0, 0.0];
        }
        self.write_regions(&mut constants, values);
        constants
    }
}

/// As the shader numbers what tables are indexed by.
fn number(index: Index) -> u32 {
    match index {
        Index::Value => 1,
        Index::GradientStrength => 2,
        Index::GradientElevation => 3,
        Index::GradientAzimuth => 4,
        Index::ViewDepth => 5,
    }
}

/// Indices at which a table's first and last entries are. One that begins with a step has an entry
/// before it, or what lies below would be as what lies above.
fn ends<T>(points: &[(f64, T)]) -> [f64; 2] {
    let (Some(&(low, _)), Some(&(high, _))) = (points.first(), points.last()) else {
        return [0.0; 2];
    };
    let begins_with_step = points.get(1).is_some_and(|(second, _)| *second == low);
    let cell = match high > low {
        true => (high - low) / (SHADE_ENTRIES - 2) as f64,
        // A step and nothing else.
        false => 1e-3 * low.abs().max(1.0),
    };
    if begins_with_step { [low - cell, high] } else { [low, high] }
}
