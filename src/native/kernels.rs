//! Kernels of lists on the picture: where each lands, how deep it lies, and which parts of the picture it may touch.

use std::sync::Arc;

use glam::{DMat2, DMat3, DVec2, DVec3};

use super::cells::{Cells, Span, middle_of, touches};
use super::in_order::{by_first_slab, look, taken};
use super::marks::MarkTable;
use crate::core::parallel;
use crate::core::{Camera, Cancelled, Ticket};
use crate::kernel::{
    FootprintPolynomial, ProjectedKernel, RadialKernel, SlabShare, perspective_jacobian,
};
use crate::plan::{KernelSlabs, Plan};
use crate::scene::{OpacityModel, Order, View};
use crate::vector::{
    Design, Foreshortening, MARK_SIDE, Splats, VectorMode, VectorSettings, WINDOW,
};

/// Kernels nearer to the eye than this part of its distance to the focal plane are not drawn.
const NEAR: f64 = 1e-3;
/// Kernels that are placed between two looks at the ticket.
const A_PART: usize = 1 << 13;
/// Half axis, in pixels, that thinner kernels are widened to.
const LEAST_HALF_AXIS: f64 = 1.0;
/// Kernels are not shortened, nor the coordinates of marks stretched, beyond this.
pub(super) const LEAST_ACROSS: f64 = 0.1;
/// Slabs that one kernel may reach into: what is summed up of them is kept until a ray has passed them.
pub(super) const MOST_SLABS: u32 = 1 << 12;
/// No slab lies farther from the frame's centre than so many: beyond, single precision does not tell them apart.
const MOST_PLACE: f64 = (1 << 22) as f64;

/// A kernel on the picture. Lengths are in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Footprint {
    /// To the right and up from the picture's middle, and how deep beyond the frame's centre.
    pub middle: [f32; 3],
    /// Optical depth of a line through its middle, or opacity.
    pub amount: f32,
    /// From offsets on the screen to the circle of radius 1 that its ellipse becomes: a lower triangle.
    pub to_circle: [f32; 3],
    /// Half chords of a line through the middle in a pixel of depth.
    pub per_depth: f32,
    /// How much deeper its middle lies a pixel to the right, and up.
    pub tilt: [f32; 2],
    /// Direction of the flow in that circle.
    pub turn: [f32; 2],
    /// MODULATE's colour, or that of BLEND's body; and that of BLEND's marks.
    pub body: [f32; 3],
    pub marks: [f32; 3],
    /// Its own phase, in cycles.
    pub phase: f32,
    /// Part of the flow across the view, 0..=1.
    pub across: f32,
    /// Of the marks' sizes.
    pub level: u8,
    /// Of a [`ListLook`].
    pub list: u8,
}

/// A kernel, the cells that it may touch, and the first slab and the last, in the order of compositing.
type Landed = (Footprint, Span, [i32; 2]);

/// How the kernels of a list look.
#[derive(Debug, Clone)]
pub(super) struct ListLook {
    pub is_blend: bool,
    pub foreshortening: Foreshortening,
    /// Of the circle that an ellipse becomes, in the window of the marks.
    pub window: f32,
    pub marks: Arc<MarkTable>,
}

/// Everything that lists depend on, but for the kernels.
#[derive(Debug, Clone, PartialEq)]
struct MadeOf {
    view: View,
    camera: Camera,
    slabs: KernelSlabs,
    looks: Vec<(VectorMode, Foreshortening, Design)>,
    published: bool,
    back_to_front: bool,
}

/// The kernels of a picture.
#[derive(Debug)]
pub(super) struct Kernels {
    made_of: MadeOf,
    pub looks: Vec<ListLook>,
    /// In the order in which rays come to them.
    footprints: Vec<Footprint>,
    /// Slabs of each, in the order of compositing.
    slabs: Vec<[i32; 2]>,
    /// Kernels that may touch each part of the picture, in that order.
    cells: Cells,
    half_size: [f32; 2],
    /// Slabs that a kernel lies in at most.
    pub most_slabs: u32,
    /// Distance between the faces of slabs.
    pub thickness: f32,
    /// Slabs of the field in each.
    pub field_slabs: i32,
    pub share: SlabShare,
    pub footprint: FootprintPolynomial,
    pub phase: f32,
    pub back_to_front: bool,
}

/// Where the kernels of one list are seen.
struct Seen<'a> {
    splats: &'a Splats,
    settings: &'a VectorSettings,
    list: u8,
    /// View space from units, pixels.
    view_from_unit: DMat3,
    /// The origin in view space, and how deep it lies beyond the frame's centre.
    origin: DVec3,
    beyond: f64,
    /// Of the ellipse that is drawn, and of the marks' window, in kernel space.
    radius: f64,
    window: f64,
    view: View,
    published: bool,
}

impl Kernels {
    /// Whether they are those of a plan; they take on its phase then.
    pub(super) fn serve(&mut self, plan: &Plan, slabs: &KernelSlabs) -> bool {
        let do_serve = self.made_of == MadeOf::new(plan, slabs);
        if do_serve {
            self.phase = phase_of(plan);
        }
        do_serve
    }

    /// Those of a plan, cut into slabs. Marks that are there already serve again.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn new(
        plan: &Plan,
        slabs: &KernelSlabs,
        old: &[ListLook],
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let made_of = MadeOf::new(plan, slabs);
        let natural = RadialKernel::CUBIC;
        let looks = looks(plan, natural, old, ticket)?;
        let (view, back_to_front) = (plan.view(), made_of.back_to_front);
        let slab = made_of.slabs.thickness;
        let mut all: Vec<Landed> = Vec::new();
        for (i, (splats, list)) in made_of.slabs.splats.iter().zip(&plan.kernels).enumerate() {
            let seen = Seen::new(plan, &view, splats, &list.settings, i as u8);
            for first in (0..splats.list.len()).step_by(A_PART) {
                look(ticket)?;
                let some = first..(first + A_PART).min(splats.list.len());
                let lands = |k: usize| seen.lands(some.start + k, slab, back_to_front);
                all.extend(parallel::list(some.len(), lands).into_iter().flatten());
            }
        }
        // Sums are the same on any machine: their order is.
        let order = by_first_slab(&all, |(_, _, slabs)| slabs[0], ticket)?;
        let spans = taken(&all, &order, |(_, span, _)| *span, ticket)?;
        let cells = Cells::new(view.size, &spans, ticket)?;
        let slabs = taken(&all, &order, |(_, _, slabs)| *slabs, ticket)?;
        let footprints = taken(&all, &order, |(footprint, _, _)| *footprint, ticket)?;
        let most_slabs = slabs.iter().map(|[first, last]| last.abs_diff(*first) + 1).max();
        Ok(Self {
            looks,
            footprints,
            slabs,
            cells,
            half_size: view.size.map(|n| n as f32 / 2.0),
            most_slabs: most_slabs.unwrap_or(0),
            thickness: slab as f32,
            field_slabs: made_of.slabs.field_slabs.cast_signed(),
            share: SlabShare::of(natural),
            footprint: FootprintPolynomial::of(natural),
            phase: phase_of(plan),
            back_to_front,
            made_of,
        })
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        // Two lists may share their marks.
        let marks = self.looks.iter().map(|look| look.marks.size_bytes()).max().unwrap_or(0);
        let kernels = size_of_val(&self.footprints[..]) + size_of_val(&self.slabs[..]);
        marks + self.cells.size_bytes() + kernels as u64
    }

    /// A kernel, and its slabs.
    #[inline(always)]
    pub(super) fn get(&self, kernel: u32) -> (&Footprint, [i32; 2]) {
        (&self.footprints[kernel as usize], self.slabs[kernel as usize])
    }

    /// The kernels that may touch a tile, whose first pixel is `corner`, in the order in which rays come to them.
    pub(super) fn touching(&self, corner: [u32; 2], found: &mut Vec<u32>) {
        found.clear();
        let tile = middle_of(corner, self.half_size);
        found.extend(self.cells.at(corner).iter().filter(|&&kernel| {
            let Footprint { middle, to_circle, .. } = &self.footprints[kernel as usize];
            touches(tile, [middle[0], middle[1]], *to_circle)
        }));
    }
}

impl MadeOf {
    fn new(plan: &Plan, slabs: &KernelSlabs) -> Self {
        let look = |list: &crate::plan::KernelList| {
            let VectorSettings { mode, foreshortening, design, .. } = list.settings;
            (mode, foreshortening, design)
        };
        Self {
            view: plan.view(),
            camera: plan.camera,
            slabs: slabs.clone(),
            looks: plan.kernels.iter().map(look).collect(),
            published: plan.mode.opacity_model == OpacityModel::Published,
            back_to_front: plan.mode.order == Order::BackToFront,
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "0..1")]
fn phase_of(plan: &Plan) -> f32 {
    (plan.phase - plan.phase.floor()) as f32
}

fn looks(
    plan: &Plan,
    natural: RadialKernel,
    old: &[ListLook],
    ticket: &Ticket,
) -> Result<Vec<ListLook>, Cancelled> {
    let mut looks: Vec<ListLook> = Vec::new();
    for list in &plan.kernels {
        let VectorSettings { mode, foreshortening, design, .. } = list.settings;
        let made = looks.iter().chain(old).find(|look| look.marks.design == design);
        let marks = match made {
            Some(look) => Arc::clone(&look.marks),
            None => Arc::new(MarkTable::new(design, ticket)?),
        };
        looks.push(ListLook {
            is_blend: mode == VectorMode::Blend,
            foreshortening,
            window: (mode.drawn_radius(natural.radius()) / (WINDOW * natural.radius())) as f32,
            marks,
        });
    }
    Ok(looks)
}

impl<'a> Seen<'a> {
    fn new(
        plan: &Plan,
        view: &View,
        splats: &'a Splats,
        settings: &'a VectorSettings,
        list: u8,
    ) -> Self {
        let (camera, pixels) = (&plan.camera, view.pixels_per_unit);
        let natural = RadialKernel::CUBIC.radius();
        let centre = plan.frame.lattice.centre();
        Self {
            splats,
            settings,
            list,
            view_from_unit: camera.view_from_world_rotation() * (pixels * splats.unit),
            origin: camera.to_view(splats.origin) * pixels,
            beyond: camera.direction.dot(splats.origin - centre) * pixels,
            radius: settings.mode.drawn_radius(natural),
            window: natural * WINDOW,
            view: *view,
            published: plan.mode.opacity_model == OpacityModel::Published,
        }
    }

    /// Where a kernel lands; `None` where it is not seen, or is flat.
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    fn lands(&self, kernel: usize, slab: f64, back_to_front: bool) -> Option<Landed> {
        let Self { splats, settings, radius, .. } = self;
        let splat = &splats.list[kernel];
        let from_origin = self.view_from_unit * DVec3::from(splat.centre.map(f64::from));
        let place = self.origin + from_origin;
        let depth = self.beyond + from_origin.z;
        let map = self.view_from_unit * splats.map_of(kernel);
        let flow = self.view_from_unit * DVec3::from(splat.direction.map(f64::from));
        let (middle, map, on_screen, across) = match self.view.eye_distance {
            None => (place.truncate(), map, flow.truncate(), flow.truncate()),
            Some(eye) if place.z > eye * NEAR => {
                let jacobian = perspective_jacobian(place, eye)?;
                let towards = place.normalize();
                // Turned about so that its length is that across the line of sight.
                let across = (flow - towards * towards.dot(flow)).length();
                let on_screen = (jacobian * flow).truncate();
                (place.truncate() * (eye / place.z), jacobian * map, on_screen, DVec2::X * across)
            }
            Some(_) => return None,
        };
        let length = flow.length();
        let across = if length > 0.0 { (across.length() / length).min(1.0) } else { 0.0 };
        let wide = ProjectedKernel::new(map)?;
        let narrow = match settings.foreshortening {
            Foreshortening::Polygon => shortened(&wide, on_screen, across),
            Foreshortening::Table | Foreshortening::Coordinates => wide,
        };
        let drawn = narrow.widened(LEAST_HALF_AXIS / radius);
        let amount = f64::from(splat.amount)
            * match self.published {
                // Widened splats of less than a pixel are as much thinner.
                true => drawn.depth_per_unit / narrow.depth_per_unit,
                false => drawn.depth_per_unit / self.view_from_unit.x_axis.length(),
            };
        let size = self.view.size.map(f64::from);
        let reach = drawn.half_extents * *radius;
        let (right, down) = (middle.x + size[0] / 2.0, size[1] / 2.0 - middle.y);
        let right = [right - reach.x, right + reach.x];
        let span = Span::of(self.view.size, right, [down - reach.y, down + reach.y])?;
        // False where anything is not a number, too.
        let shows = amount > 0.0;
        if !shows || !depth.is_finite() {
            return None;
        }
        let leans = drawn.screen_from_unit.transpose() * drawn.tilt;
        let deep = radius * (leans.length_squared() + drawn.depth_per_unit.powi(2)).sqrt();
        let slab_at = |depth: f64| (depth / slab).floor().clamp(-MOST_PLACE, MOST_PLACE) as i32;
        let [first, last] = [slab_at(depth - deep), slab_at(depth + deep)];
        let turned = drawn.unit_from_screen * on_screen;
        let turn = turned.try_normalize().unwrap_or(DVec2::X);
        let l = drawn.unit_from_screen * (1.0 / radius);
        let narrow_f32 = |v: DVec2| v.as_vec2().to_array();
        let footprint = Footprint {
            middle: middle.extend(depth).as_vec3().to_array(),
            amount: amount.min(1e30) as f32,
            to_circle: [l.x_axis.x, l.x_axis.y, l.y_axis.y].map(|x| x as f32),
            per_depth: (1.0 / (narrow.depth_per_unit * radius)) as f32,
            tilt: narrow_f32(drawn.tilt),
            turn: narrow_f32(turn),
            body: splat.colour,
            marks: splat.marks,
            phase: splat.phase,
            across: across as f32,
            level: self.mark_level(&wide),
            list: self.list,
        };
        let slabs = if back_to_front { [-last, -first] } else { [first, last] };
        Some((footprint, span, slabs))
    }

    /// The size of the marks whose texels are about as large as pixels, where the window is narrowest.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=4")]
    fn mark_level(&self, wide: &ProjectedKernel) -> u8 {
        let k = wide.screen_from_unit;
        let trace = k.x_axis.length_squared() + k.y_axis.length_squared();
        let product = (k.x_axis.x * k.y_axis.y).abs();
        let larger = 0.5 * trace + (0.25 * trace * trace - product * product).max(0.0).sqrt();
        let radius = self.window * product / larger.sqrt();
        let level = (0.5 * MARK_SIDE as f64 / radius.max(1e-3)).log2();
        (level + 0.5).floor().clamp(0.0, f64::from(super::marks::LAST_LEVEL)) as u8
    }
}

/// A kernel shortened on the screen along the flow: on the circle its direction is e, and K (1 − (1 − f) e eᵀ) maps the
/// circle to the shorter ellipse.
fn shortened(wide: &ProjectedKernel, flow: DVec2, across: f64) -> ProjectedKernel {
    let e = (wide.unit_from_screen * flow).normalize_or_zero();
    let less = 1.0 - across.max(LEAST_ACROSS);
    let outer = DMat2::from_cols(e * e.x, e * e.y);
    let rows = (wide.screen_from_unit * (DMat2::IDENTITY - outer * less)).transpose();
    let k11 = rows.x_axis.length();
    let k21 = rows.x_axis.dot(rows.y_axis) / k11;
    let k22 = rows.x_axis.perp_dot(rows.y_axis).abs() / k11;
    ProjectedKernel {
        unit_from_screen: DMat2::from_cols(
            DVec2::new(1.0 / k11, -k21 / (k11 * k22)),
            DVec2::new(0.0, 1.0 / k22),
        ),
        screen_from_unit: DMat2::from_cols(DVec2::new(k11, k21), DVec2::new(0.0, k22)),
        half_extents: DVec2::new(k11, k21.hypot(k22)),
        ..*wide
    }
}
