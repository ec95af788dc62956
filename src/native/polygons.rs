//! Polygons: what each pixel of a tile sees of them.
//!
//! A pixel sees each triangle at four places. It has one depth, normal and colour of it: those where the pixel's own ray
//! meets the triangle's plane, or, if that is beside the triangle, of the place on it whose coordinates in the triangle
//! are those with the negative ones set to 0.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3, Vec3};

use super::cells::{Cells, Span};
use super::in_order::look;
use super::rays::TILE;
use crate::core::{Camera, Cancelled, Srgb8, Ticket, mapped, parallel};
use crate::plan::Plan;
use crate::scene::{Lighting, OpacityModel, PolygonLayer, View};

/// Where the samples of a pixel are, from its upper left.
const SAMPLES: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// The same in eighths of a pixel.
const EIGHTHS: [[i32; 2]; 4] = [[3, 1], [7, 3], [1, 5], [5, 7]];
/// How far beside their places samples may be met, pixels.
const ROUNDING: f64 = 0.01;
/// What is nearer to the eye than this share of its distance to the focal plane is left out.
const NEAREST: f64 = 1e-4;
/// Fragments that a tile keeps before what is hidden among them is left out: there are hardly ever as many.
const MOST_KEPT: usize = 1 << 14;
/// What of light comes through to less than this adds nothing that 32 bits tell.
const LEAST_THROUGH: f32 = 1e-9;
/// Triangles between two looks at the ticket, and the parts of these that threads share.
const A_RUN: usize = 1 << 12;
const RUNS: usize = 8;
/// Triangles of a tile between two looks at whether any more of them can be seen.
const BETWEEN_LOOKS: usize = 64;
/// Pixels of pictures of which it is kept what tiles see.
const MOST_KEPT_OF: u32 = 1 << 19;
/// Depths that triangles are sorted into.
const BINS: usize = 1 << 10;
/// Corners that a triangle may share with those before it are looked for among so many.
const LOOKED_BACK: usize = 20;
/// Pixels of a tile.
const PIXELS: usize = (TILE * TILE) as usize;

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

/// The triangles of layers in the world, one layer after the other. Neighbours share most corners, and what a view asks of a corner it
/// asks once.
#[derive(Debug, Default)]
struct Placed {
    layers: Vec<PolygonLayer>,
    /// Corners, from the origin of their mesh.
    places: Vec<Vec3>,
    /// Where the places of each layer end.
    ends: Vec<usize>,
    /// Three places a triangle.
    triangles: Vec<[u32; 3]>,
    looks: Vec<Painted>,
}

/// What a triangle looks like at its corners.
#[derive(Debug, Clone, Copy)]
struct Painted {
    normals: [[f32; 3]; 3],
    colours: [Srgb8; 3],
    layer: u32,
}

/// A corner in view space.
#[derive(Debug, Clone, Copy, Default)]
struct Corner {
    /// To the right, up, and how deep beyond the frame's centre, pixels.
    at: DVec3,
    /// Where it is on the picture, from the middle, pixels; anywhere for one behind the eye.
    on_picture: DVec2,
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

/// What a pixel sees of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fragment {
    /// View depth beyond the frame's centre, pixels.
    pub t: f32,
    pub opacity: f32,
    /// Lit, linear.
    pub colour: [f32; 3],
    /// A bit for each sample of the pixel that it covers.
    pub samples: u8,
}

/// Where a pixel meets a triangle, before that is lit: lights take longer than all else, and most of what is met is hidden.
#[derive(Debug, Clone, Copy)]
struct Met {
    t: f32,
    opacity: f32,
    samples: u8,
    /// Of the tile, in rows from the top.
    pixel: u8,
    /// Of those in the world.
    triangle: u32,
    /// Of the corners.
    shares: [f64; 3],
}

/// What the pixels of a tile see, each from the eye inwards.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fragments {
    list: Vec<Fragment>,
    /// Where each pixel's begin, and the last one's end.
    begins: [u32; PIXELS + 1],
}

impl Fragments {
    /// Those of a pixel of the tile.
    pub(super) fn of(&self, pixel: usize) -> &[Fragment] {
        &self.list[self.begins[pixel] as usize..self.begins[pixel + 1] as usize]
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

impl Placed {
    fn of(layers: Vec<PolygonLayer>, ticket: &Ticket) -> Result<Self, Cancelled> {
        let mut placed = Self::default();
        for (layer, number) in layers.iter().zip(0_u32..) {
            let begin = placed.places.len();
            for (triangle, colours) in layer.triangles() {
                if placed.triangles.len().is_multiple_of(A_RUN) {
                    look(ticket)?;
                }
                let corners = triangle.corners.map(|corner| placed.place(corner, begin));
                placed.triangles.push(corners);
                let normals = triangle.normals.map(|normal| normal.to_array());
                placed.looks.push(Painted { normals, colours, layer: number });
            }
            placed.ends.push(placed.places.len());
        }
        placed.places.shrink_to_fit();
        placed.triangles.shrink_to_fit();
        placed.looks.shrink_to_fit();
        Ok(Self { layers, ..placed })
    }

    /// The opacity of a triangle.
    fn opacity(&self, triangle: u32) -> f32 {
        self.layers[self.looks[triangle as usize].layer as usize].look.opacity as f32
    }

    /// All corners as a camera sees them; the centre is that of what it looks at. `corners` is room that there was for them.
    fn in_view(
        &self,
        (view, camera): (&View, &Camera),
        centre: DVec3,
        mut corners: Vec<Corner>,
        ticket: &Ticket,
    ) -> Result<Vec<Corner>, Cancelled> {
        let eye = Eye::of(view);
        let rotation = camera.view_from_world_rotation();
        let beside = view.view_centre.truncate().extend(0.0);
        let origins: Vec<DVec3> =
            self.layers.iter().map(|layer| layer.mesh.origin() - centre).collect();
        corners.resize(self.places.len(), Corner::default());
        let runs = corners.chunks_mut(A_RUN).zip(self.places.chunks(A_RUN)).enumerate();
        parallel::try_each(runs, |(i, (corners, places))| {
            look(ticket)?;
            let mut layer = self.ends.partition_point(|end| *end <= i * A_RUN);
            for ((corner, place), number) in corners.iter_mut().zip(places).zip(i * A_RUN..) {
                while number >= self.ends[layer] {
                    layer += 1;
                }
                let from_centre = place.as_dvec3() + origins[layer];
                let at = rotation * from_centre * view.pixels_per_unit + beside;
                *corner = Corner { at, on_picture: at.truncate() / eye.scale(at.z) };
            }
            Ok(())
        })?;
        Ok(corners)
    }

    /// The number of a place of the layer that begins at `begin`: that of one of the last triangles' corners, or a new one.
    fn place(&mut self, place: Vec3, begin: usize) -> u32 {
        let bits = |place: Vec3| place.to_array().map(f32::to_bits);
        let recent = self.places.len().saturating_sub(LOOKED_BACK).max(begin);
        let known = self.places[recent..].iter().rposition(|other| bits(*other) == bits(place));
        let number = known.map_or(self.places.len(), |i| recent + i);
        if known.is_none() {
            self.places.push(place);
        }
        number as u32
    }
}

/// The upper left corner of a pixel of a tile, to the right and up from the tile's own.
fn place_in_tile(pixel: usize) -> DVec2 {
    let side = TILE as usize;
    DVec2::new((pixel % side) as f64, -((pixel / side) as f64))
}

/// By pixels, from the eye inwards; those at one depth stay in the order of their triangles.
fn sort(list: &mut [Met]) {
    list.sort_by(|a, b| {
        (a.pixel.cmp(&b.pixel)).then(a.t.total_cmp(&b.t)).then(a.triangle.cmp(&b.triangle))
    });
}

/// Leaves out of a sorted list what nobody sees, since nothing comes through what lies before it.
fn leave_out_hidden(list: &mut Vec<Met>) {
    let (mut pixel, mut through) = (None, [1.0_f32; 4]);
    list.retain(|fragment| {
        if pixel != Some(fragment.pixel) {
            (pixel, through) = (Some(fragment.pixel), [1.0; 4]);
        }
        let mut is_seen = false;
        for (bit, through) in through.iter_mut().enumerate() {
            if fragment.samples & 1 << bit != 0 {
                is_seen |= *through > LEAST_THROUGH;
                *through *= 1.0 - fragment.opacity;
            }
        }
        is_seen
    });
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

/// Where the eye is.
#[derive(Debug, Clone, Copy)]
struct Eye {
    /// How far before the focal plane, pixels; `None` where rays are parallel.
    distance: Option<f64>,
    /// How far the frame's centre lies beyond the focal plane.
    beyond: f64,
    /// The least depth beyond the frame's centre that is seen.
    nearest: f64,
}

impl Eye {
    fn of(view: &View) -> Self {
        let (distance, beyond) = (view.eye_distance, view.view_centre.z);
        let nearest = distance.map_or(f64::NEG_INFINITY, |eye| eye * NEAREST - beyond);
        Self { distance, beyond, nearest }
    }

    /// The part that a pixel at the focal plane is as long at a depth beyond the frame's centre.
    fn scale(&self, depth: f64) -> f64 {
        self.distance.map_or(1.0, |eye| (depth + self.beyond) / eye)
    }
}

/// Whether a box holds any sample of any pixel, rounding included: `[[left, right], [top, bottom]]` from the picture's upper left.
/// A box far beyond the picture may be said to hold one.
fn has_sample(ends: [[f64; 2]; 2]) -> bool {
    // Samples lie at odd eighths of a pixel, and conversions to whole numbers, which round towards 0, take a fraction of the time that
    // rounding down takes where processors have no instruction for that.
    const BEYOND: f64 = (1 << 20) as f64;
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    let eighths = |at: f64| (8.0 * (at + BEYOND)).clamp(-1e9, 1e9) as i32;
    // The first eighth after the lower end, and the last one before the upper end.
    let [x, y] = ends.map(|[low, high]| [eighths(low - ROUNDING) + 1, eighths(high + ROUNDING)]);
    let holds = |[low, high]: [i32; 2], eighth: i32| (high - eighth) >> 3 > (low - eighth - 1) >> 3;
    EIGHTHS.iter().any(|[right, down]| holds(x, *right) & holds(y, *down))
}

/// A triangle as lines through the picture meet it.
///
/// A line through the place s of the picture passes corner i, at that corner's own depth, at pᵢ − s kᵢ, k the part that a
/// pixel at the focal plane is as long there. Products of two of these are the corner's share in where the line meets
/// the triangle's plane, and linear in s: nothing is divided by, so that triangles that reach behind the eye need no
/// cutting; and of two triangles the share at an edge of both is the same but for its sign, so that they leave no seam.
struct Seen {
    /// Of each corner's share: at the picture's middle, and its growth to the right and up.
    shares: [[f64; 3]; 3],
    /// Its growth from the upper left corner of a pixel to each sample.
    to_samples: [[f64; 4]; 3],
    /// The least share of each corner where a sample is covered: of two triangles at an edge one has what is 0.
    least: [f64; 3],
    depths: [f64; 3],
    /// The least depth that is seen, where it reaches nearer than that.
    nearest: Option<f64>,
}

impl Seen {
    /// `None` where it is seen from its edge, or lies behind the eye, or where a corner is not a number.
    fn new(corners: [DVec3; 3], eye: &Eye) -> Option<Self> {
        /// The least number that is greater than 0.
        const MORE_THAN_0: f64 = f64::from_bits(1);
        let depths = [corners[0].z, corners[1].z, corners[2].z];
        let is_before = |depth: &f64| *depth >= eye.nearest;
        if !depths.iter().any(is_before) {
            return None;
        }
        let scales = [eye.scale(depths[0]), eye.scale(depths[1]), eye.scale(depths[2])];
        let share = |b: usize, c: usize| {
            let (p, q) = (corners[b], corners[c]);
            let (k, l) = (scales[b], scales[c]);
            // (p − s k) × (q − s l).
            [p.x * q.y - p.y * q.x, k * -q.y - l * -p.y, k * q.x - l * p.x]
        };
        let mut shares = [share(1, 2), share(2, 0), share(0, 1)];
        // Which way round it is seen: the volume under the eye.
        let around = corners[0].truncate().extend(scales[0]).dot(
            corners[1].truncate().extend(scales[1]).cross(corners[2].truncate().extend(scales[2])),
        );
        if around == 0.0 || !around.is_finite() {
            return None;
        }
        let is_first = |b: usize, c: usize| {
            let key = |i: usize| [corners[i].x, corners[i].y, corners[i].z];
            key(b) < key(c)
        };
        let owns = [is_first(1, 2), is_first(2, 0), is_first(0, 1)];
        let is_behind = around < 0.0;
        let side = if is_behind { -1.0 } else { 1.0 };
        let mut to_samples = [[0.0; SAMPLES.len()]; 3];
        let mut least = [0.0; 3];
        for i in 0..3 {
            for number in &mut shares[i] {
                *number *= side;
            }
            for (to_sample, [right, down]) in to_samples[i].iter_mut().zip(SAMPLES) {
                *to_sample = shares[i][1] * right - shares[i][2] * down;
            }
            if owns[i] == is_behind {
                least[i] = MORE_THAN_0;
            }
        }
        let nearest = (!depths.iter().all(is_before)).then_some(eye.nearest);
        Some(Self { shares, to_samples, least, depths, nearest })
    }

    #[inline(always)]
    fn shares_at(&self, at: DVec2) -> [f64; 3] {
        let share = |i: usize| {
            let [share, right, up] = self.shares[i];
            share + (right * at.x + up * at.y)
        };
        [share(0), share(1), share(2)]
    }

    /// The samples of a pixel whose lines meet it in front of the eye, a bit each, by the pixel's upper left corner.
    fn covers(&self, corner: DVec2) -> u8 {
        let shares = self.shares_at(corner);
        let mut is_in = [true; SAMPLES.len()];
        for ((share, least), to_samples) in shares.into_iter().zip(self.least).zip(self.to_samples)
        {
            for (is_in, to_sample) in is_in.iter_mut().zip(to_samples) {
                *is_in &= share + to_sample >= least;
            }
        }
        if let Some(nearest) = self.nearest {
            for (bit, is_in) in is_in.iter_mut().enumerate() {
                let own = |i: usize| shares[i] + self.to_samples[i][bit];
                let own = [own(0), own(1), own(2)];
                let depth = own.iter().zip(self.depths).map(|(s, depth)| s * depth).sum::<f64>();
                *is_in &= depth / own.iter().sum::<f64>() >= nearest;
            }
        }
        is_in.iter().enumerate().fold(0, |all, (bit, is_in)| all | u8::from(*is_in) << bit)
    }

    /// The place on it that is nearest to where that line meets its plane, in its own coordinates: how deep it is, and
    /// the shares of the corners.
    fn place(&self, at: DVec2) -> (f64, [f64; 3]) {
        let inner = self.shares_at(at).map(|s| s.max(0.0));
        let sum: f64 = inner.iter().sum();
        let shares = if sum > 0.0 { inner.map(|s| s / sum) } else { [1.0 / 3.0; 3] };
        (shares.iter().zip(self.depths).map(|(s, depth)| s * depth).sum(), shares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Camera, Projection};
    use crate::polygons::Mesh;
    use crate::volume::Lattice;

    /// A square in the plane that is looked at, cut into triangles about a grid of corners; some lie on samples.
    fn square(corners: usize) -> Vec<[DVec3; 3]> {
        let at = |i: usize| {
            let [x, y] = [i % corners, i / corners].map(|n| n as f64 - (corners / 2) as f64);
            DVec3::new(3.0 * x + 0.375, 3.0 * y - 0.125, 2.0 * x - 0.5 * y)
        };
        let triangle = |corners: [usize; 3]| corners.map(at);
        let cells = (0..(corners - 1) * (corners - 1)).map(|i| {
            let first = i / (corners - 1) * corners + i % (corners - 1);
            // Every other one the other way round.
            let [b, c] = if i % 2 == 0 { [1, corners] } else { [corners, 1] };
            [[first, first + b, first + c], [first + 1 + corners, first + c, first + b]]
        });
        cells.flatten().map(triangle).collect()
    }

    #[test]
    fn corners_that_neighbours_share_are_placed_once_and_triangles_stay_what_they_are() {
        let side = 12_u32;
        let corners =
            (0..side * side).map(|i| Vec3::new((i % side) as f32, (i / side) as f32, 1.0));
        let quads = (0..side * side).filter(|i| i % side < side - 1 && i / side < side - 1);
        let quads = quads.flat_map(|i| [[i, i + 1, i + side], [i + side, i + 1, i + side + 1]]);
        let mesh = |shift: f32| {
            let corners = corners.clone().map(|corner| corner + shift).collect();
            let mesh = Mesh::new("sheet", corners, Vec::new(), Vec::new(), quads.clone().collect());
            PolygonLayer::new(Arc::new(mesh.expect("a mesh")))
        };
        let layers = vec![mesh(0.0), mesh(0.5)];
        let placed = Placed::of(layers.clone(), &Ticket::new()).expect("not cancelled");
        let all = layers.iter().flat_map(PolygonLayer::triangles);
        let expected: Vec<[Vec3; 3]> = all.map(|(triangle, _)| triangle.corners).collect();
        let found = placed.triangles.iter().map(|t| t.map(|i| placed.places[i as usize]));
        assert_eq!(found.collect::<Vec<_>>(), expected);
        let (places, triangles) = (placed.places.len(), placed.triangles.len());
        assert!(places < triangles * 6 / 5, "{places} of {triangles} triangles");
        assert_eq!(placed.ends, [places / 2, places]);
    }

    #[test]
    fn triangles_beside_one_another_leave_no_seam_and_share_no_sample() {
        let lattice = Lattice::unit([9; 3]);
        for projection in [Projection::Orthographic, Projection::Perspective { view_angle: 0.9 }] {
            let camera =
                Camera { projection, ..Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, 20.0) };
            let view = View::of(&camera, &lattice, [24, 24]);
            let triangles = square(17);
            let eye = Eye::of(&view);
            let seen: Vec<Seen> = triangles.iter().filter_map(|t| Seen::new(*t, &eye)).collect();
            let mut covered = 0;
            for i in 0..48 * 48 {
                // In quarters of a pixel, so that samples lie on the edges, too.
                let at = [i % 48, i / 48].map(|n| f64::from(n) * 0.25 - 6.0);
                let mut counts = [0; SAMPLES.len()];
                for samples in seen.iter().map(|seen| seen.covers(DVec2::from(at))) {
                    for (bit, count) in counts.iter_mut().enumerate() {
                        *count += samples >> bit & 1;
                    }
                }
                assert_eq!(counts, [1; SAMPLES.len()], "{projection:?} {at:?}");
                covered += 1;
            }
            assert_eq!(covered, 48 * 48);
        }
    }

    #[test]
    fn boxes_between_all_samples_are_known_from_those_with_one() {
        let mut without = 0;
        for i in 0..4000 {
            let share = |by: f64| (f64::from(i) * by).fract();
            let low = DVec2::new(5.0 * share(0.754_877_7) - 1.0, 5.0 * share(0.569_840_3) - 1.0);
            let high = low + DVec2::new(share(0.323_45), share(0.819_17));
            let is_in = |at: DVec2| at.cmpge(low).all() && at.cmple(high).all();
            let has_one = (-3..8).any(|x| {
                (-3..8).any(|y| {
                    let corner = DVec2::new(f64::from(x), f64::from(y));
                    SAMPLES.iter().any(|sample| is_in(corner + DVec2::from(*sample)))
                })
            });
            let found = has_sample([[low.x, high.x], [low.y, high.y]]);
            assert!(found || !has_one, "{low} {high}");
            without += usize::from(!found);
        }
        assert!((1000..3000).contains(&without), "{without} of 4000");
    }

    #[test]
    fn what_lies_behind_opaque_triangles_or_very_many_clear_ones_is_left_out() {
        let fragment = |t: usize, opacity: f32, samples: u8, pixel: u8| Met {
            t: t as f32,
            opacity,
            samples,
            pixel,
            triangle: t as u32,
            shares: [1.0, 0.0, 0.0],
        };
        // Two samples of a pixel are hidden from 2 on, the others from 3 on; another pixel is not.
        let mut list: Vec<_> = (4..9).map(|t| fragment(t, 1.0, 15, 0)).collect();
        list.extend([fragment(2, 1.0, 3, 0), fragment(3, 1.0, 12, 0), fragment(1, 0.5, 15, 0)]);
        list.push(fragment(9, 1.0, 15, 1));
        sort(&mut list);
        leave_out_hidden(&mut list);
        let left: Vec<(u8, u32)> = list.iter().map(|f| (f.pixel, f.triangle)).collect();
        assert_eq!(left, [(0, 1), (0, 2), (0, 3), (1, 9)]);
        let mut clear: Vec<_> = (0..1000).map(|t| fragment(t, 0.5, 15, 0)).collect();
        leave_out_hidden(&mut clear);
        assert_eq!(clear.len(), 30, "0.5³⁰ is less than 1e-9");
    }

    #[test]
    fn a_triangle_that_reaches_behind_the_eye_is_seen_as_far_as_it_lies_before_it() {
        let lattice = Lattice::unit([9; 3]);
        let projection = Projection::Perspective { view_angle: 0.9 };
        let camera =
            Camera { projection, ..Camera::new(lattice.centre(), DVec3::Z, DVec3::Y, 20.0) };
        let view = View::of(&camera, &lattice, [24, 24]);
        let eye = view.eye_distance.expect("a perspective");
        // A floor one pixel under the eye, from far behind it to far before it.
        let corners = [[-9e3, -1.0, -9e3], [9e3, -1.0, -9e3], [0.0, -1.0, 9e5]].map(DVec3::from);
        let corners = corners.map(|corner| corner - DVec3::Z * view.view_centre.z);
        let seen = Seen::new(corners, &Eye::of(&view)).expect("it is seen");
        // The first sample of the pixel that has it there.
        let covers = |x: f64, y: f64| {
            let [right, down] = SAMPLES[0];
            seen.covers(DVec2::new(x - right, y + down)) & 1 == 1
        };
        for x in [-11.0, -3.0, 0.0, 8.0] {
            for y in [-11.0, -4.0, -0.5] {
                assert!(covers(x, y), "{x} {y}: the floor");
                assert!(!covers(x, -y), "{x} {y}: the sky");
                let (depth, _) = seen.place(DVec2::new(x, y));
                // y = −1 · eye / depth, from the eye.
                let expected = -eye / y - view.view_centre.z;
                assert!((depth - expected).abs() < 1e-6 * expected.abs(), "{depth} {expected}");
            }
        }
    }
}
