//! Polygons: what each pixel of a tile sees of them.
//!
//! A pixel sees each triangle at four places. It has one depth, normal and colour of it: those where the pixel's own ray
//! meets the triangle's plane, or, if that is beside the triangle, of the place on it whose coordinates in the triangle
//! are those with the negative ones set to 0.

mod fragments;
mod meeting;
mod placed;

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

pub(super) use self::fragments::{Fragment, Fragments};
use self::fragments::{LEAST_THROUGH, Met, PIXELS, leave_out_hidden, sort};
use self::meeting::{Eye, SAMPLES, Seen, has_sample};
use self::placed::{Corner, Painted, Placed};
use super::cells::{Cells, Span};
use super::rays::TILE;
use crate::core::{Camera, Cancelled, Ticket, mapped};
use crate::plan::Plan;
use crate::scene::{Lighting, OpacityModel, View};

/// Fragments that a tile keeps before what is hidden among them is left out: there are hardly ever as many.
const MOST_KEPT: usize = 1 << 14;
/// Triangles between two looks at the ticket, and the parts of these that threads share.
const A_RUN: usize = 1 << 12;
const RUNS: usize = 8;
/// Triangles of a tile between two looks at whether any more of them can be seen.
const BETWEEN_LOOKS: usize = 64;
/// Pixels of pictures of which it is kept what tiles see.
const MOST_KEPT_OF: u32 = 1 << 19;
/// Depths that triangles are sorted into.
const BINS: usize = 1 << 10;

/// The triangles of layers, and what a view sees of them.
#[derive(Debug)]
pub(super) struct Polygons {
    /// As they lie in the world: kept, as every view begins with them.
    placed: Arc<Placed>,
    /// `None` where that was not made to its end.
    in_view: Option<InView>,
}

/// The triangles of a view.
#[derive(Debug)]
struct InView {
    made_of: MadeOf,
    placed: Arc<Placed>,
    /// Of all triangles.
    corners: Vec<Corner>,
    /// Those that may be seen, by their numbers in the world, and the box about each: most that lie in a cell are not in a tile, or
    /// hidden.
    triangles: Vec<u32>,
    boxes: Vec<Box3>,
    cells: Cells,
    eye: Eye,
    /// Each triangle lies at most so much nearer than one before it, pixels.
    depth_of_bin: f32,
    lights: Vec<(DVec3, DVec3)>,
    /// What tiles saw, in rows from the top; none of large pictures, which are drawn once. Vectors that play among polygons ask for it
    /// many times a second.
    kept: Vec<OnceLock<Option<Arc<Fragments>>>>,
}

/// Everything that a view of layers depends on.
#[derive(Debug, Clone, PartialEq)]
struct MadeOf {
    view: View,
    camera: Camera,
    lighting: Lighting,
    /// Whether what is in front hides what is behind: what is cut away hides nothing, and published opacities do not add up,
    /// so that matter is divided wherever any sample of a pixel has a polygon.
    hides: bool,
}

/// A triangle that may be seen, and where.
#[derive(Debug, Clone, Copy)]
struct Bounded {
    number: u32,
    around: Box3,
    span: Span,
}

/// From where to where a triangle reaches to the right of the picture's middle, and up, and where it is nearest, pixels.
#[derive(Debug, Clone, Copy)]
struct Box3 {
    right: [f32; 2],
    up: [f32; 2],
    nearest: f32,
}

impl Box3 {
    /// A hundredth of a pixel larger, for rounding.
    fn about([right, up]: [[f64; 2]; 2], nearest: f64) -> Self {
        let wider = |[low, high]: [f64; 2]| [low - 0.01, high + 0.01].map(|x| x as f32);
        Self { right: wider(right), up: wider(up), nearest: (nearest as f32).next_down() }
    }

    /// Whether it may touch a tile by its upper left corner.
    #[inline(always)]
    fn touches(&self, [x, y]: [f32; 2]) -> bool {
        const SIDE: f32 = TILE as f32;
        let across = (self.right[0] < x + SIDE) & (self.right[1] >= x);
        across & (self.up[1] > y - SIDE) & (self.up[0] <= y)
    }

    /// The columns and rows of a tile's pixels that it may touch.
    fn within(&self, [x, y]: [f32; 2]) -> [Range<usize>; 2] {
        // Conversions to whole numbers round towards 0.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let whole = |at: f32| at.clamp(0.0, TILE as f32) as usize;
        [
            whole(self.right[0] - x)..whole(self.right[1] - x + 1.0),
            whole(y - self.up[1])..whole(y - self.up[0] + 1.0),
        ]
    }
}

impl Polygons {
    /// Makes of what there was what a plan has, or `None` without any. Where nothing about them has changed they stay.
    ///
    /// # Errors
    /// [`Cancelled`]: then what lies in the world is there still, for the next view.
    pub(super) fn renew(
        polygons: &mut Option<Self>,
        plan: &Plan,
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        let layers = plan.polygons();
        if layers.is_empty() {
            *polygons = None;
            return Ok(());
        }
        let kept = polygons.take().filter(|old| old.placed.layers == layers);
        let all = match kept {
            Some(old) => polygons.insert(old),
            None => {
                let placed = Arc::new(Placed::of(layers, ticket)?);
                polygons.insert(Self { placed, in_view: None })
            }
        };
        let made_of = MadeOf {
            view: plan.view(),
            camera: plan.camera,
            lighting: plan.shading.polygon_lighting(),
            hides: !plan.inside.clip.cuts()
                && plan.mode.opacity_model == OpacityModel::OpticalDepth,
        };
        let before = all.in_view.take();
        all.in_view = Some(match before {
            Some(before) if before.made_of == made_of => before,
            before => {
                let centre = plan.frame.lattice.centre();
                let room = before.map(|before| before.corners).unwrap_or_default();
                InView::new((&all.placed, room), centre, made_of, ticket)?
            }
        });
        Ok(())
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        let Placed { places, ends, triangles, looks, .. } = &*self.placed;
        let placed = size_of_val(&places[..])
            + size_of_val(&ends[..])
            + size_of_val(&triangles[..])
            + size_of_val(&looks[..]);
        let in_view =
            self.in_view.as_ref().map_or(0, |InView { corners, boxes, cells, kept, .. }| {
                let kept = kept.iter().filter_map(|tile| tile.get()?.as_ref());
                let kept = kept.map(|seen| size_of::<Fragments>() + size_of_val(&seen.list[..]));
                let each = size_of::<u32>() + size_of::<Box3>();
                let lists = size_of_val(&corners[..]) + each * boxes.len() + kept.sum::<usize>();
                lists as u64 + cells.size_bytes()
            });
        placed as u64 + in_view
    }

    /// What the pixels of a tile see, whose first one is `corner`; `None` where that is nothing.
    pub(super) fn seen_in(&self, corner: [u32; 2]) -> Option<Arc<Fragments>> {
        let in_view = self.in_view.as_ref()?;
        let see = || in_view.seen_in(corner).map(Arc::new);
        match in_view.kept.get(in_view.tile(corner)) {
            Some(kept) => kept.get_or_init(see).clone(),
            None => see(),
        }
    }
}

impl InView {
    /// Of layers, and room that is written over.
    fn new(
        (placed, room): (&Arc<Placed>, Vec<Corner>),
        centre: DVec3,
        made_of: MadeOf,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let (view, camera) = (&made_of.view, &made_of.camera);
        let eye = Eye::of(view);
        let corners = placed.in_view((view, camera), centre, room, ticket)?;
        let seen = in_runs(placed.triangles.len(), ticket, |run| {
            let seen = run.filter_map(|number| {
                let of = placed.triangles[number].map(|i| &corners[i as usize]);
                let (around, span) = bounds(of, &eye, view.size)?;
                Some(Bounded { number: number as u32, around, span })
            });
            seen.collect()
        })?;
        let (seen, depth_of_bin) = match made_of.hides {
            true => nearest_first(&seen),
            false => (seen, f32::INFINITY),
        };
        let spans: Vec<Span> = seen.iter().map(|one| one.span).collect();
        let cells = Cells::new(view.size, &spans, ticket)?;
        let lights = made_of.lighting.lights.iter().filter(|_| made_of.lighting.uses_lights());
        let lights = lights.map(|l| (l.towards(camera), DVec3::from(l.colour.to_linear().0)));
        Ok(Self {
            corners,
            triangles: seen.iter().map(|one| one.number).collect(),
            boxes: seen.iter().map(|one| one.around).collect(),
            cells,
            eye,
            depth_of_bin,
            lights: lights.collect(),
            kept: match view.size[0].saturating_mul(view.size[1]) <= MOST_KEPT_OF {
                true => {
                    vec![OnceLock::new(); view.size.map(tiles).iter().product::<u32>() as usize]
                }
                false => Vec::new(),
            },
            placed: Arc::clone(placed),
            made_of,
        })
    }

    /// The number of the tile that begins with a pixel.
    fn tile(&self, corner: [u32; 2]) -> usize {
        let [x, y] = corner.map(|n| n / TILE);
        (y * tiles(self.made_of.view.size[0]) + x) as usize
    }

    /// What the pixels of a tile see, whose first one is `corner`; `None` where that is nothing.
    fn seen_in(&self, corner: [u32; 2]) -> Option<Fragments> {
        let mut list = Vec::new();
        let mut most = MOST_KEPT;
        let upper_left = self.upper_left(corner);
        let tile = [upper_left.x as f32, upper_left.y as f32];
        let mut nearest = self.made_of.hides.then_some([[f32::INFINITY; SAMPLES.len()]; PIXELS]);
        for (i, &number) in self.cells.at(corner).iter().enumerate() {
            if i.is_multiple_of(BETWEEN_LOOKS)
                && let Some(nearest) = &nearest
            {
                let farthest =
                    nearest.as_flattened().iter().fold(f32::NEG_INFINITY, |most, t| most.max(*t));
                // Everything that follows is hidden.
                if self.boxes[number as usize].nearest - self.depth_of_bin > farthest {
                    break;
                }
            }
            if self.boxes[number as usize].touches(tile) {
                self.add(number, (upper_left, tile), (&mut list, nearest.as_mut()));
            }
            if list.len() >= most && self.made_of.hides {
                sort(&mut list);
                leave_out_hidden(&mut list);
                most = MOST_KEPT.max(2 * list.len());
            }
        }
        if list.is_empty() {
            return None;
        }
        sort(&mut list);
        if self.made_of.hides {
            leave_out_hidden(&mut list);
        }
        let mut begins = [0; PIXELS + 1];
        for met in &list {
            begins[usize::from(met.pixel) + 1] += 1;
        }
        for i in 0..PIXELS {
            begins[i + 1] += begins[i];
        }
        let list = list.iter().map(|met| self.seen(met, corner)).collect();
        Some(Fragments { list, begins })
    }

    /// What is seen of a triangle where a pixel of the tile meets it.
    fn seen(
        &self,
        &Met { t, opacity, samples, pixel, triangle, shares }: &Met,
        corner: [u32; 2],
    ) -> Fragment {
        let at =
            self.upper_left(corner) + place_in_tile(usize::from(pixel)) + DVec2::new(0.5, -0.5);
        let colour = self.lit(&self.placed.looks[triangle as usize], shares, at);
        Fragment { t, opacity, colour: colour.as_vec3().to_array(), samples }
    }

    /// The upper left corner of a tile, whose first pixel is `corner`, to the right and up from the picture's middle.
    fn upper_left(&self, corner: [u32; 2]) -> DVec2 {
        let half = self.made_of.view.size.map(|n| f64::from(n) / 2.0);
        DVec2::new(f64::from(corner[0]) - half[0], half[1] - f64::from(corner[1]))
    }

    /// Adds where the pixels of a tile meet a triangle; where things hide one another, only what lies before the `nearest`
    /// opaque triangle yet, by pixels and their samples.
    #[expect(clippy::cast_possible_truncation, reason = "a tile's pixels")]
    fn add(
        &self,
        number: u32,
        (upper_left, tile): (DVec2, [f32; 2]),
        (list, mut nearest): (&mut Vec<Met>, Option<&mut [[f32; SAMPLES.len()]; PIXELS]>),
    ) {
        let side = TILE as usize;
        let around = &self.boxes[number as usize];
        let [columns, rows] = around.within(tile);
        if let Some(nearest) = nearest.as_deref() {
            let is_before = |pixel: usize| nearest[pixel].iter().any(|t| *t >= around.nearest);
            let mut row = rows.clone();
            if !row.any(|y| columns.clone().any(|x| is_before(y * side + x))) {
                return;
            }
        }
        let triangle = self.triangles[number as usize];
        let [a, b, c] = self.placed.triangles[triangle as usize];
        let at = |i: u32| self.corners[i as usize].at;
        let Some(seen) = Seen::new([at(a), at(b), at(c)], &self.eye) else { return };
        let opacity = self.placed.opacity(triangle);
        for pixel in rows.flat_map(|y| columns.clone().map(move |x| y * side + x)) {
            let at = upper_left + place_in_tile(pixel);
            let samples = seen.covers(at);
            if samples != 0 {
                let (depth, shares) = seen.place(at + DVec2::new(0.5, -0.5));
                if let Some(nearest) = nearest.as_mut().map(|all| &mut all[pixel]) {
                    let t = depth as f32;
                    let covered = (0..SAMPLES.len()).filter(|bit| samples & 1 << bit != 0);
                    if covered.clone().all(|bit| nearest[bit] < t) {
                        continue;
                    }
                    if 1.0 - opacity <= LEAST_THROUGH {
                        covered.for_each(|bit| nearest[bit] = nearest[bit].min(t));
                    }
                }
                list.push(Met {
                    t: depth as f32,
                    opacity,
                    samples,
                    pixel: pixel as u8,
                    triangle,
                    shares,
                });
            }
        }
    }

    /// What the lights make of a triangle at a place on it: both sides are lit.
    fn lit(&self, painted: &Painted, shares: [f64; 3], screen: DVec2) -> DVec3 {
        let MadeOf { view, camera, lighting, .. } = &self.made_of;
        let sum =
            |of: &dyn Fn(usize) -> DVec3| -> DVec3 { (0..3).map(|i| of(i) * shares[i]).sum() };
        let Painted { normals, colours, .. } = painted;
        let normal = sum(&|i| DVec3::from(normals[i].map(f64::from)));
        let normal = normal.normalize_or_zero();
        let albedo = sum(&|i| DVec3::from(colours[i].to_linear().0));
        let mut along = camera.direction;
        if let Some(eye) = view.eye_distance {
            along += (camera.right() * screen.x + camera.up * screen.y) / eye;
        }
        let eye = -along.normalize();
        let facing = if normal.dot(eye) < 0.0 { -normal } else { normal };
        let mut colour = albedo * lighting.ambient;
        for &(towards, falls) in &self.lights {
            let cosine = facing.dot(towards);
            colour += falls * albedo * (lighting.diffuse * cosine.max(0.0));
            if cosine > 0.0 && lighting.specular > 0.0 {
                let reflected = facing * (2.0 * cosine) - towards;
                let mirror = reflected.dot(eye).max(1e-6).powf(lighting.exponent);
                colour += falls * (lighting.specular * mirror);
            }
        }
        colour
    }
}

/// Tiles along a side of so many pixels.
fn tiles(pixels: u32) -> u32 {
    pixels.div_ceil(TILE)
}

/// What is made of so many things, in their order, by threads that share them.
fn in_runs<T: Send>(
    count: usize,
    ticket: &Ticket,
    of: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Result<Vec<T>, Cancelled> {
    const A_PART: usize = A_RUN / RUNS;
    let run = |i: usize| of(i * A_PART..count.min((i + 1) * A_PART));
    let runs = mapped(count.div_ceil(A_PART), RUNS, run, ticket)?;
    let mut all = Vec::with_capacity(runs.iter().map(Vec::len).sum());
    runs.into_iter().for_each(|mut run| all.append(&mut run));
    Ok(all)
}

/// The upper left corner of a pixel of a tile, to the right and up from the tile's own.
fn place_in_tile(pixel: usize) -> DVec2 {
    let side = TILE as usize;
    DVec2::new((pixel % side) as f64, -((pixel / side) as f64))
}

/// The box about a triangle in view space, and the cells that it may touch; `None` where it lies between all samples, as most do
/// of a mesh that is fine beside the pixels, or behind the eye.
fn bounds([a, b, c]: [&Corner; 3], eye: &Eye, size: [u32; 2]) -> Option<(Box3, Span)> {
    let near = a.at.z.min(b.at.z).min(c.at.z);
    let [right, up] = match near >= eye.nearest {
        true => {
            let low = a.on_picture.min(b.on_picture).min(c.on_picture);
            let high = a.on_picture.max(b.on_picture).max(c.on_picture);
            [[low.x, high.x], [low.y, high.y]]
        }
        // Without ends where a corner lies behind the eye.
        false if [a, b, c].iter().any(|corner| corner.at.z >= eye.nearest) => {
            [[f64::NEG_INFINITY, f64::INFINITY]; 2]
        }
        false => return None,
    };
    let half = size.map(|n| f64::from(n) / 2.0);
    if !has_sample([right.map(|x| x + half[0]), [half[1] - up[1], half[1] - up[0]]]) {
        return None;
    }
    // Samples lie up to half a pixel beside its centre.
    let columns = [right[0] + half[0] - 0.5, right[1] + half[0] + 0.5];
    let rows = [half[1] - up[1] - 0.5, half[1] - up[0] + 0.5];
    Some((Box3::about([right, up], near), Span::of(size, columns, rows)?))
}

/// Triangles in the order of the nearest part of each, as far as bins of depth tell them apart, and how deep a bin is: what lies
/// before others comes first, and most of what they would hide need not be looked at.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the bins")]
fn nearest_first(seen: &[Bounded]) -> (Vec<Bounded>, f32) {
    let depths = || seen.iter().map(|one| one.around.nearest).filter(|depth| depth.is_finite());
    let [least, most] = depths().fold([f32::MAX, f32::MIN], |[a, b], d| [a.min(d), b.max(d)]);
    let depth_of_bin = (most - least).max(f32::MIN_POSITIVE) / (BINS - 1) as f32;
    let bin = |one: &Bounded| {
        (((one.around.nearest - least) / depth_of_bin).max(0.0) as usize).min(BINS - 1)
    };
    let mut begins = [0; BINS + 1];
    for one in seen {
        begins[bin(one) + 1] += 1;
    }
    for i in 0..BINS {
        begins[i + 1] += begins[i];
    }
    let mut order = vec![0_u32; seen.len()];
    for (one, number) in seen.iter().zip(0..) {
        let place = &mut begins[bin(one)];
        order[*place] = number;
        *place += 1;
    }
    (order.into_iter().map(|number| seen[number as usize]).collect(), 2.0 * depth_of_bin)
}
