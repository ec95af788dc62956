//! Where vector splats land, and what the passes over them are told of that.

use glam::{DMat3, DVec3};

use super::{VectorLook, VectorSplats};
use crate::gpu::layout::{self, LAYER_SLABS, narrow, narrow4};
use crate::gpu::list_plan::{Layers, MOST_LAYER_BITS, bits_below};
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{Order, View};
use crate::vector::{Foreshortening, MARK_SIDE, VectorMode, WINDOW};

/// Where splats land: their view in pixels. Units are those of the first field.
pub(in crate::gpu) struct VectorFrame {
    /// View space from units, pixels.
    view_from_unit: DMat3,
    /// View-space position of the origin of the splats, pixels.
    origin: DVec3,
    /// View depth of it beyond the lattice's centre, pixels.
    beyond: f64,
    eye_distance: Option<f64>,
    size: [u32; 2],
    /// Of the ellipse that is drawn, in kernel space, of the first field.
    radius: f64,
    /// Depths that splats reach, beyond the lattice's centre, pixels.
    reach: [f64; 2],
}

impl VectorFrame {
    /// `None` where there is no field.
    pub(in crate::gpu) fn new(view: &View, what: &VectorSplats<'_>) -> Option<Self> {
        let camera = what.camera;
        let natural = RadialKernel::new(Kernel::Cubic, None).map_or(1.0, RadialKernel::radius);
        let pixels = view.pixels_per_unit;
        let mut reach = [0.0_f64; 2];
        for VectorLook { splats, settings } in what.looks {
            let radius = settings.mode.drawn_radius(natural);
            let beyond = camera.direction.dot(splats.origin - what.centre) * pixels;
            let view_from_unit = camera.view_from_world_rotation() * (pixels * splats.unit);
            let along = view_from_unit.transpose().z_axis;
            for (i, splat) in splats.list.iter().enumerate() {
                let middle = beyond + along.dot(DVec3::from(splat.centre.map(f64::from)));
                // A row of the map is as long as the splat is deep.
                let axes = splats.axes_of(i) * f64::from(splat.size);
                let longest = axes.x_axis.length() + axes.y_axis.length() + axes.z_axis.length();
                let depth =
                    longest * splats.stretch * (splats.radius / natural) * radius * along.length();
                reach = [reach[0].min(middle - depth), reach[1].max(middle + depth)];
            }
        }
        let VectorLook { splats, settings } = what.looks.first()?;
        Some(Self {
            view_from_unit: camera.view_from_world_rotation() * (pixels * splats.unit),
            origin: camera.to_view(splats.origin) * pixels,
            beyond: camera.direction.dot(splats.origin - what.centre) * pixels,
            eye_distance: view.eye_distance,
            size: view.size,
            radius: settings.mode.drawn_radius(natural),
            reach,
        })
    }

    /// Layers that splats lie in, however many.
    pub(in crate::gpu) fn layer_count(&self, slab: f64) -> u64 {
        let layer = slab * f64::from(LAYER_SLABS);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let count = ((self.reach[1] - self.reach[0]) / layer).ceil() as u64;
        count
    }

    pub(in crate::gpu) fn layers(&self, slab: f64) -> Option<Layers> {
        let layer = slab * f64::from(LAYER_SLABS);
        // One more on each side: the device rounds.
        let first = (self.reach[0] / layer).floor() - 1.0;
        let count = (self.reach[1] / layer).floor() + 2.0 - first;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "2^22 at most")]
        (count <= f64::from(1_u32 << MOST_LAYER_BITS)).then_some(Layers {
            first: first as i32,
            count: count as u32,
            slab,
        })
    }

    /// Of the pass that projects: lengths in units, the origin's at 0.
    pub(in crate::gpu) fn constants(&self) -> layout::Frame {
        let m = self.view_from_unit;
        let column = |v| narrow4(v, 0.0);
        let half = self.size.map(|n| n as f32 / 2.0);
        // What extinctions are given per: a unit.
        let unit_pixels = m.x_axis.length();
        layout::Frame {
            view_x: column(m.x_axis),
            view_y: column(m.y_axis),
            view_z: column(m.z_axis),
            view_centre: narrow4(self.origin, self.eye_distance.unwrap_or(0.0)),
            lattice_centre: [0.0; 4],
            footprint: [0.0; 4],
            half_size: half,
            radius: narrow(self.radius),
            extinction_scale: narrow((1.0 / unit_pixels).min(1e20)),
            footprint_scale: 1.0,
            padding0: 0.0,
            padding1: 0.0,
            padding2: 0.0,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
    pub(in crate::gpu) fn vectors(
        &self,
        view: &View,
        what: &VectorSplats<'_>,
        record_vec4s: u32,
        layers: Layers,
        columns: u32,
    ) -> layout::Vectors {
        let natural = RadialKernel::new(Kernel::Cubic, None);
        let natural_radius = natural.map_or(1.0, RadialKernel::radius);
        let middle = natural.map_or(1.0, |kernel| kernel.footprint(0.0));
        let finest = MARK_SIDE as f64;
        let half = view.size.map(|n| n as f32 / 2.0);
        // Far to near nothing is hidden before it is drawn.
        let stop = if what.splat.order == Order::FrontToBack { what.stop_below } else { 0.0 };
        let mut constants = layout::Vectors {
            depth: [narrow(self.beyond), narrow(what.slab), stop, 0.0],
            layers: [layers.first, layers.count.cast_signed(), 0, columns.cast_signed()],
            field_slabs: [what.field_slabs.cast_signed(), 0, 0, 0],
            ..bytemuck::Zeroable::zeroed()
        };
        let Some(first) = what.looks.first() else { return constants };
        let extent = first.splats.radius / natural_radius;
        let window = WINDOW * natural_radius / self.radius;
        constants.axis_x = narrow4(first.splats.axes.x_axis, first.splats.stretch);
        constants.axis_y = narrow4(first.splats.axes.y_axis, extent);
        constants.axis_z = narrow4(first.splats.axes.z_axis, finest);
        constants.picture = [half[0], half[1], narrow(window), narrow(1.0 / middle)];
        constants.flags = [
            record_vec4s,
            u32::from(first.settings.mode == VectorMode::Blend),
            number_of(first.settings.foreshortening),
            bits_below(layers.count),
        ];
        // No splat is of a second field where there is none.
        constants.second_flags[0] = u32::MAX;
        if let Some(VectorLook { splats, settings }) = what.looks.get(1) {
            let radius = settings.mode.drawn_radius(natural_radius);
            let ratio = splats.unit / first.splats.unit;
            // As large as drawn with the first field's radius.
            let extent = splats.radius / natural_radius * ratio * radius / self.radius;
            let shift = (splats.origin - first.splats.origin) / first.splats.unit;
            constants.second_x = narrow4(splats.axes.x_axis, splats.stretch);
            constants.second_y = narrow4(splats.axes.y_axis, extent);
            constants.second_z = narrow4(splats.axes.z_axis, WINDOW * natural_radius / radius);
            constants.second_origin = narrow4(shift, ratio);
            constants.second_flags = [
                first.splats.list.len() as u32,
                u32::from(settings.mode == VectorMode::Blend),
                number_of(settings.foreshortening),
                u32::from(settings.design != first.settings.design),
            ];
        }
        constants
    }
}

/// As `shaders/lib/vector_frame.wgsl` counts them.
fn number_of(foreshortening: Foreshortening) -> u32 {
    match foreshortening {
        Foreshortening::Table => 0,
        Foreshortening::Polygon => 1,
        Foreshortening::Coordinates => 2,
    }
}
