//! How often the loops of a ray turn, at most, and in how many dispatches it is walked where that is
//! too often.
//!
//! Mesa's software adapters count the turns of an invocation's loops, all loops together, and end
//! every loop after 65 535 of them: what a ray had not met by then would be missing. The bounds here
//! are of a group of invocations that turn together, and count the last look at a condition as a
//! turn, as the adapter does. Where they are within the limit nothing is split, kept or compiled.

use glam::{DMat3, DVec3};

use super::GpuError;
use super::buffers::{Growing, read_words};
use super::context::Context;
use super::layout::{self, KEPT_VEC4S, LAYERS};
use crate::kernel::Kernel;

/// Turns after which software adapters end the loops of an invocation.
pub(super) const SOFTWARE_TURNS: u64 = 65_535;
/// Tiles whose rays are walked in parts at a time.
pub(super) const TILES_IN_PARTS: u32 = 256;
/// Invocations that turn together, at most.
const LANES: f64 = 16.0;
/// Turns outside of what is counted here: loops over three axes, and the like.
const REST: u64 = 64;
/// The least part of a step along the slices' axis at which slices are crossed one by one
/// (`gather_kernels.wgsl`).
const ALONG: f64 = 0.02;

/// Turns of loops in one another: of each so many, and one more to end it.
fn nested(counts: &[f64]) -> f64 {
    counts.iter().rev().fold(0.0, |inner, &count| count + 1.0 + count * inner)
}

/// What is composited together along a ray that is gathered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layers {
    /// Samples or slices: none are cut.
    None,
    /// Sheets that cut kernels.
    Sheets,
    /// Slabs.
    Slabs,
}

/// One dispatch's part of every pixel, as `Gather` has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    /// Units of each ray, first and after the last; layers of a chunk; 0.
    pub along: [i32; 4],
    /// Rays, first and after the last; rays along a pixel's side; whether it goes on, or ends rays.
    pub rays: [u32; 4],
}

/// What lies among the samples that rays gather.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Among {
    /// Polygons that a pixel sees at most, where there are any in the scene.
    pub polygons: Option<u32>,
    /// Vector splats, where there are any, and how often the turns of a part are quartered for them: how
    /// many more they take depends on which rays come to a layer of them at the same time. Where they
    /// took too many the device says so ([`GpuError::TooManyTurns`]).
    pub vectors: Option<u32>,
}

/// A dispatch goes on with what was kept of the pixel.
pub(super) const GOES_ON: u32 = 1;
/// Its rays end.
pub(super) const ENDS: u32 = 2;
/// Turns that a face takes beside vectors, of which none lies there.
const VECTOR_LOOK: f64 = 4.0;

/// The dispatches that gather a picture's rays, a square of `side` × `side` to a pixel: a single one
/// with everything where the loops allow (`most` turns, if there is a limit), else as many as are needed,
/// in order.
///
/// # Errors
/// One sentence, where a single layer or slice turns too often, or what lies among them does.
pub(super) fn gathered(
    gather: &layout::Gather,
    (kernel, layers): (Kernel, Layers),
    side: u32,
    Among { polygons, vectors }: Among,
    most: Option<u64>,
) -> Result<Vec<Part>, GpuError> {
    let count = side * side;
    let whole = |first: u32, end: u32| Part {
        along: [0, i32::MAX, LAYERS as i32, 0],
        rays: [first, end, side, ENDS | if first > 0 { GOES_ON } else { 0 }],
    };
    let rays = Rays::of(gather);
    check_faces(rays.layers(layers))?;
    check_polygons(polygons, 0, most)?;
    let Some(most) = most else { return Ok(vec![whole(0, count)]) };
    let sizes = [LAYERS, 8, 4, 2, 1];
    let walks: Vec<(u32, Walk)> = match kernel {
        Kernel::Nearest | Kernel::Linear | Kernel::BSpline => {
            vec![(LAYERS, rays.cells(kernel, layers))]
        }
        Kernel::Point | Kernel::Gaussian | Kernel::Cubic | Kernel::Gouraud
            if layers == Layers::None =>
        {
            vec![(LAYERS, rays.slices(kernel))]
        }
        Kernel::Point | Kernel::Gaussian | Kernel::Cubic | Kernel::Gouraud => {
            sizes.iter().map(|&size| (size, rays.chunks(kernel, layers, size))).collect()
        }
    };
    // Any part of a ray may meet all polygons.
    let all = most.saturating_sub(REST) as f64 - LANES * polygon_turns(polygons, 0);
    let budget = match vectors {
        None => all,
        Some(quartered) => 0.5 * all * 0.25_f64.powi(quartered.cast_signed()),
    };
    // Before each slice and layer a look, at slabs of vectors too.
    let looks = match (polygons, vectors) {
        (None, None) => 0.0,
        (_, None) => 2.0 * f64::from(LAYERS),
        (_, Some(_)) => 12.0 * f64::from(LAYERS),
    };
    let walks: Vec<(u32, Walk)> =
        walks.into_iter().map(|(size, walk)| (size, walk.with(looks))).collect();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
    let at_once = (budget / (walks[0].1.turns() + 1.0)) as u32;
    if at_once > 0 {
        let starts = (0..count).step_by(at_once as usize);
        return Ok(starts.map(|first| whole(first, (first + at_once).min(count))).collect());
    }
    // The smallest step is all that vectors can ask for.
    let smallest = walks.last().filter(|(_, walk)| vectors.is_some() && walk.each <= all);
    let fitting = walks.iter().find(|(_, walk)| walk.each <= budget).or(smallest);
    let (size, walk) = fitting.ok_or_else(|| too_often(walks[walks.len() - 1].1.each))?;
    #[expect(clippy::cast_possible_truncation, reason = "far fewer than 2^31, and saturating")]
    let (units, step) = (walk.units as i32, (budget / walk.each) as i32);
    let starts = (0..units).step_by(step.max(1) as usize);
    let part = |ray: u32, first: i32| {
        let end = first.saturating_add(step);
        let goes_on = if ray > 0 || first > 0 { GOES_ON } else { 0 };
        let ends = if end >= units { ENDS } else { 0 };
        Part { along: [first, end, *size as i32, 0], rays: [ray, ray + 1, side, goes_on | ends] }
    };
    Ok((0..count).flat_map(|ray| starts.clone().map(move |first| part(ray, first))).collect())
}

/// Turns that polygons take, so many of them over a pixel, among so many other surfaces.
fn polygon_turns(polygons: Option<u32>, surfaces: u32) -> f64 {
    polygons.map_or(0.0, f64::from) * (3.0 + f64::from(surfaces))
}

fn check_polygons(polygons: Option<u32>, surfaces: u32, most: Option<u64>) -> Result<(), GpuError> {
    // What is left is for what lies between them, and for finding the place again.
    let most = most.map_or(f64::INFINITY, |most| 0.8 * most as f64 / LANES);
    if polygon_turns(polygons, surfaces) <= most {
        return Ok(());
    }
    Err(GpuError::TooLarge {
        what: "polygons over one pixel",
        limit: format!("{}", (most / (3.0 + f64::from(surfaces))).floor()),
        found: polygons.unwrap_or(0).to_string(),
        advice: "zoom in, choose a hardware adapter, or leave a mesh out",
    })
}

/// Slabs are counted in 32-bit floats.
const MOST_FACES: f64 = 16_777_216.0;

fn check_faces(found: f64) -> Result<(), GpuError> {
    if found <= MOST_FACES {
        return Ok(());
    }
    Err(GpuError::TooLarge {
        what: "slabs along a ray",
        limit: format!("{MOST_FACES}"),
        found: format!("up to {found:.1e}"),
        advice: "choose fewer --slabs-per-voxel, --visibility every-sample, or correct a spacing that is \
                 far less than the others",
    })
}

fn too_often(found: f64) -> GpuError {
    GpuError::TooLarge {
        what: "samples to gather in one step of a ray",
        limit: format!("{SOFTWARE_TURNS} turns of its loops"),
        found: format!("up to {found:.0}"),
        advice: "choose a smaller --extent, a larger picture, or --backend raster",
    }
}

/// What a ray's loop walks: units, and the turns of each.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Walk {
    units: f64,
    each: f64,
}

impl Walk {
    /// With so many turns more in each unit.
    fn with(self, more: f64) -> Self {
        Self { each: self.each + more, ..self }
    }

    fn turns(self) -> f64 {
        self.units * self.each
    }
}

/// A picture's rays in index space, axes in the traversal's order.
struct Rays<'a> {
    gather: &'a layout::Gather,
    /// Index step for a pixel of view depth: of all rays, or of those through the corners.
    steps: Vec<DVec3>,
    /// The least length of such a step.
    shortest: f64,
    /// Samples that can show along each axis.
    counts: DVec3,
    reach: DVec3,
    radius: f64,
}

fn xyz([x, y, z, _]: [f32; 4]) -> DVec3 {
    DVec3::new(x.into(), y.into(), z.into())
}

impl<'a> Rays<'a> {
    fn of(gather: &'a layout::Gather) -> Self {
        let ahead = xyz(gather.ahead);
        let eye = f64::from(gather.scale[3]);
        let (right, up) = (xyz(gather.right), xyz(gather.up));
        let (steps, shortest) = if eye == 0.0 {
            (vec![ahead], ahead.length())
        } else {
            let half = [gather.low[3], gather.high[3]].map(|n| f64::from(n) / 2.0);
            let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
            let step =
                |[x, y]: [f64; 2]| (ahead + right * (x * half[0]) + up * (y * half[1])) / eye;
            // As near as the plane of all steps is to 0.
            let normal = right.cross(up).normalize_or_zero();
            (corners.map(step).to_vec(), ahead.dot(normal).abs() / eye)
        };
        let [low, high] =
            [gather.low, gather.high].map(|[a, b, c, _]| DVec3::new(a.into(), b.into(), c.into()));
        Self {
            gather,
            steps,
            shortest,
            counts: high - low + 1.0,
            reach: xyz(gather.reach),
            radius: gather.scale[0].into(),
        }
    }

    /// Index steps along the inner axes for one along the outermost, at most; `None` where rays run
    /// along the slices.
    fn slopes(&self) -> Option<[f64; 2]> {
        let forwards = self.steps[0].x > 0.0;
        let across = |d: &DVec3| (d.x > 0.0) == forwards && d.x.abs() >= ALONG * d.length();
        if !self.steps.iter().all(across) {
            return None;
        }
        // Ratios of linear functions are greatest at a corner.
        let most =
            |axis: usize| self.steps.iter().map(|d| (d[axis] / d.x).abs()).fold(0.0, f64::max);
        Some([most(1), most(2)])
    }

    /// Turns for one slice whose kernels are shared out among `shares` layers.
    fn slice(&self, kernel: Kernel, shares: Option<f64>) -> f64 {
        let inner = |rows: f64, columns: f64| match shares {
            None => nested(&[rows, columns]),
            Some(shares) => nested(&[rows, columns, shares]),
        };
        let [b, c] = [self.counts.y, self.counts.z];
        let bricks = |n: f64, all: f64| (n / 8.0 + 2.0).min(all / 8.0 + 2.0);
        let Some(slopes) = self.slopes() else {
            let all = nested(&[1.0, bricks(b, b), bricks(c, c)]);
            if kernel == Kernel::Point {
                return 1.0 + all + inner(b, c);
            }
            // Samples near one line, on which the others' are not.
            let r = self.radius;
            let near = (b.max(c) + 2.0 * r + 2.0) * (2.0 * std::f64::consts::SQRT_2 * r + 2.0);
            let line = 3.0 * b + LANES * near * (2.0 + shares.unwrap_or(0.0));
            return 1.0 + all + inner(b, c).min(line);
        };
        let width = |axis: usize, slope: f64| {
            let reach = if kernel == Kernel::Point {
                self.reach[axis] + slope * self.reach.x
            } else {
                self.reach[axis] * slope.hypot(1.0)
            };
            2.0 * reach + 2.0
        };
        let [rows, columns] = [width(1, slopes[0]), width(2, slopes[1])];
        let looks = |further: f64| {
            nested(&[
                1.0,
                bricks(rows + further * slopes[0], b),
                bricks(columns + further * slopes[1], c),
            ])
        };
        1.0 + looks(0.0) + looks(7.0) + inner(rows.min(b), columns.min(c))
    }

    fn slices(&self, kernel: Kernel) -> Walk {
        Walk { units: self.counts.x, each: self.slice(kernel, None) }
    }

    /// Layers that the samples reach into.
    fn layers(&self, layers: Layers) -> f64 {
        let thickness = f64::from(self.gather.layers[0]);
        let sides = self.counts - 1.0 + 2.0 * self.reach;
        let extent = match layers {
            Layers::None => return 0.0,
            Layers::Sheets => sides.x,
            Layers::Slabs => {
                let g = self.gather;
                DVec3::new(g.view_a[2].into(), g.view_b[2].into(), g.view_c[2].into())
                    .abs()
                    .dot(sides)
            }
        };
        extent / thickness + 4.0
    }

    fn chunks(&self, kernel: Kernel, layers: Layers, size: u32) -> Walk {
        let thickness = f64::from(self.gather.layers[0]);
        let size = f64::from(size);
        let (slices, per_length) = match layers {
            Layers::Slabs => {
                let most = self.steps.iter().map(|d| d.x.abs()).fold(0.0, f64::max);
                (most * thickness, 1.0 / (self.shortest * thickness))
            }
            Layers::None | Layers::Sheets => (thickness, 1.0 / thickness),
        };
        let slices = (size * slices + 2.0 * self.reach.x + 2.0).min(self.counts.x);
        let shares = (2.0 * self.radius * per_length + 2.0).min(size);
        let shares = (kernel != Kernel::Point).then_some(shares);
        let chunk = 2.0 + 2.0 * (f64::from(LAYERS) + 1.0);
        let units = (self.layers(layers) / size).ceil() + 1.0;
        Walk { units, each: chunk + slices * self.slice(kernel, shares) }
    }

    fn cells(&self, kernel: Kernel, layers: Layers) -> Walk {
        let (support, bricks) = match kernel {
            Kernel::Linear => (2.0, 2.0),
            Kernel::BSpline => (4.0, 2.0),
            _ => (0.0, 1.0),
        };
        // The longest way through the box, in steps, and the faces it meets there.
        let sides = self.counts + 2.0 * self.reach + 2.0;
        let faces: f64 = match self.steps[..] {
            [d] => {
                let d = d.abs();
                let way = (sides / d).min_element();
                (0..3).map(|axis| sides[axis].min(d[axis] * way + 2.0)).sum()
            }
            _ => sides.element_sum(),
        };
        let mut each = 1.0 + nested(&[bricks; 3]);
        if support > 0.0 {
            each += nested(&[support]) + nested(&[support; 3]);
        }
        Walk { units: faces + self.layers(layers) + 2.0, each }
    }
}

/// Turns of a dispatch for what is not polygons. Each of these is a layer of its own, wherever it is: any part
/// of a ray may meet all of them.
fn budget(polygons: Option<u32>, surfaces: u32, most: u64) -> f64 {
    most.saturating_sub(REST) as f64 - LANES * polygon_turns(polygons, surfaces)
}

/// Turns that a ray may take among vectors alone before it waits for the next dispatch: rays beside one
/// another walk the same list in step.
pub(super) fn among_vectors_alone(polygons: Option<u32>, most: u64) -> Result<u32, GpuError> {
    check_polygons(polygons, 0, Some(most))?;
    let left = budget(polygons, 0, most);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
    let turns = (0.9 * left).max(1.0) as u32;
    Ok(turns)
}

/// One dispatch's part of a pixel of slabs, as `Slabs::part` has it.
pub(super) type SlabPart = [u32; 4];

/// The slabs of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SlabRays {
    /// View-space steps of one index, pixels.
    pub view_from_index: DMat3,
    /// Samples along each axis.
    pub dims: [usize; 3],
    /// Pixels of view depth between two faces.
    pub thickness: f64,
    /// Rays along the side of a pixel.
    pub side: u32,
    /// Samples to either side of a position, of kernels that are summed up in loops.
    pub window: Option<usize>,
    /// Surfaces that a ray may meet among the slabs.
    pub surfaces: u32,
    /// Whether values are projected, face by face and without leaps.
    pub projects: bool,
    /// Polygons that a pixel sees at most; `None` where there are none in the scene.
    pub polygons: Option<u32>,
    /// Whether each slab is looked at once more for small things.
    pub seeks_specks: bool,
}

impl SlabRays {
    /// Faces that a ray passes at most.
    fn faces(&self) -> f64 {
        let m = self.view_from_index;
        let dims = DVec3::from(self.dims.map(|n| n as f64));
        let depth = DVec3::new(m.x_axis.z, m.y_axis.z, m.z_axis.z).abs().dot(dims);
        depth / self.thickness + 6.0
    }

    /// # Errors
    /// More faces than can be told apart, or more polygons over a pixel than one dispatch walks.
    pub(super) fn check(&self, most: Option<u64>) -> Result<(), GpuError> {
        check_polygons(self.polygons, self.surfaces, most)?;
        check_faces(self.faces())
    }

    /// Turns of one look, with those of the faces up to the next.
    fn look(&self) -> f64 {
        let value = self.window.map_or(0.0, |w| {
            let side = 2.0 * w as f64;
            nested(&[side, side, w as f64])
        });
        // The look, the loop of leaps and that of faces.
        let every = f64::from(layout::LOOK_EVERY);
        // Of each slab, layers between surfaces, and a look for the next one before each.
        let surfaces = f64::from(self.surfaces);
        // Where a level is passed, the field is asked up to seven times.
        let passes = nested(&[surfaces, 1.0, 7.0]) + 7.0 * surfaces * value;
        let layers = match surfaces > 0.0 || self.polygons.is_some() {
            true => nested(&[surfaces + 1.0, surfaces + 1.0]) + passes,
            false => 0.0,
        };
        let specks = if self.seeks_specks { 2.0 } else { 0.0 };
        match self.projects {
            true => 1.0 + value,
            // A slab that may show is classified in a loop of one turn.
            false => 1.0 + 1.0 + every + 1.0 + every * (value + layers + specks + 2.0),
        }
    }

    /// What a ray among vectors may take in one dispatch before it waits for the next: looks, and turns
    /// among the splats. Rays beside one another take both together, as long as they come to the same layers;
    /// either may be half of what there is. How often the turns are `quartered` says how far from one another
    /// they may be.
    pub(super) fn among_vectors(&self, most: u64, quartered: u32) -> [u32; 2] {
        let surfaces = f64::from(self.surfaces);
        // A surface divides a slab of vectors, too.
        let half = 0.5
            * (budget(self.polygons, self.surfaces, most) - LANES * surfaces * (surfaces + 4.0));
        let look = self.look() + VECTOR_LOOK * f64::from(layout::LOOK_EVERY);
        // Leaps count as looks.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
        let whole = |n: f64| n.max(1.0) as u32;
        [whole(half / (look + LANES)), whole(half * 0.25_f64.powi(quartered.cast_signed()))]
    }

    /// The dispatches that walk a pixel: `None` for a single one with everything where the loops
    /// allow.
    pub(super) fn parts(&self, most: Option<u64>) -> Option<Vec<SlabPart>> {
        let budget = budget(self.polygons, self.surfaces, most?);
        if self.check(most).is_err() {
            return None;
        }
        let dims = DVec3::from(self.dims.map(|n| n as f64));
        let faces = self.faces();
        // Each leap passes from one brick to another.
        let leaps = dims.element_sum() / 4.0 + 8.0;
        let look = self.look();
        let (looks, leaps, others) = match self.projects {
            // Between two faces there may be one more place to be asked.
            true => (2.0 * faces + 6.0, 0.0, 1.0),
            false => (faces / f64::from(layout::LOOK_EVERY) + 2.0, leaps, LANES * leaps),
        };
        let ray = 1.0 + looks * look + others;
        let rays = self.side * self.side;
        if f64::from(rays) * ray <= budget {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and saturating"
        )]
        let whole = |n: f64| n as u32;
        let at_once = whole(budget / ray);
        if at_once > 0 {
            let starts = (0..rays).step_by(at_once as usize);
            let part = |first: u32| [first, (first + at_once).min(rays), u32::MAX, ENDS];
            return Some(starts.map(part).collect());
        }
        // Leaps count as looks there.
        let step = ((budget - others) / look).max(budget / (look + LANES)).max(1.0);
        let count = whole(((looks + leaps) / step).ceil()).max(1);
        let part = |ray: u32, n: u32| {
            let ends = if n + 1 == count { ENDS } else { 0 };
            [ray, ray + 1, whole(step), if n > 0 { GOES_ON | ends } else { ends }]
        };
        Some((0..rays).flat_map(|ray| (0..count).map(move |n| part(ray, n))).collect())
    }
}

/// What is kept of rays between dispatches, and what they count; there once a picture needs it.
#[derive(Debug, Default)]
pub(super) struct Kept(Option<wgpu::Buffer>);

impl Kept {
    /// Bytes of the counts before the rays'.
    const HEADER: u64 = 32;
    /// Where among them the rays that wait for another dispatch are counted.
    const WAITING: u64 = 16;

    /// Counts nothing so far.
    pub(super) fn clear(&self, context: &Context) {
        if let Some(buffer) = &self.0 {
            context.queue.write_buffer(buffer, 0, &[0; Self::HEADER as usize]);
        }
    }

    /// Makes room for [`TILES_IN_PARTS`] tiles.
    pub(super) fn reserve(&mut self, context: &Context) {
        use wgpu::BufferUsages as Usage;
        let pixels = u64::from(TILES_IN_PARTS * layout::TILE * layout::TILE);
        self.0.get_or_insert_with(|| {
            let usage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
            let size = Self::HEADER + 16 * u64::from(KEPT_VEC4S) * pixels;
            Growing::make(context, "rays in parts", usage, size)
        });
    }

    /// Counts none that wait.
    pub(super) fn clear_waiting(&self, context: &Context) {
        if let Some(buffer) = &self.0 {
            context.queue.write_buffer(buffer, Self::WAITING, &[0; 4]);
        }
    }

    /// Rays that wait for another dispatch, and invocations whose loops were ended.
    pub(super) fn waiting(&self, context: &Context) -> Result<[u32; 2], GpuError> {
        let Some(buffer) = &self.0 else { return Ok([0; 2]) };
        let counts = read_words(context, buffer, Self::HEADER)?;
        Ok([counts[4], counts[1]])
    }

    pub(super) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.0.as_ref()
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.0.as_ref().map_or(0, wgpu::Buffer::size)
    }
}

/// Ranges of at most [`TILES_IN_PARTS`] tiles, of which so many places are kept a pixel.
pub(super) fn few_tiles(tiles: &std::ops::Range<u32>, slots: u32) -> Vec<std::ops::Range<u32>> {
    let few = TILES_IN_PARTS / slots;
    let starts = tiles.clone().step_by(few as usize);
    starts.map(|first| first..(first + few).min(tiles.end)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays along the first axis of a lattice of `counts` samples, a voxel to a pixel.
    fn along(counts: [i32; 3], radius: f32, thickness: f32) -> layout::Gather {
        layout::Gather {
            right: [0.0, 1.0, 0.0, 0.0],
            up: [0.0, 0.0, 1.0, 0.0],
            ahead: [1.0, 0.0, 0.0, 0.0],
            reach: [radius, radius, radius, 0.0],
            scale: [radius, 1.0, 1.0, 0.0],
            layers: [thickness, 0.0, 0.0, 0.0],
            view_a: [0.0, 0.0, 1.0, 0.0],
            view_b: [1.0, 0.0, 0.0, 0.0],
            view_c: [0.0, 1.0, 0.0, 0.0],
            low: [0, 0, 0, 8],
            high: [counts[0] - 1, counts[1] - 1, counts[2] - 1, 8],
            ..bytemuck::Zeroable::zeroed()
        }
    }

    fn parts(gather: &layout::Gather, kernel: Kernel, layers: Layers) -> Vec<Part> {
        gathered(gather, (kernel, layers), 1, Among::default(), Some(SOFTWARE_TURNS))
            .expect("steps that fit")
    }

    /// Parts of rays among vectors are shortened as often as is asked for, down to one step each.
    #[test]
    fn parts_among_vectors_are_quartered_to_single_steps() {
        let gather = along([400, 16, 16], 1.558, 1.0);
        let parts = |vectors, most| {
            let among = Among { polygons: None, vectors };
            gathered(&gather, (Kernel::Cubic, Layers::None), 1, among, Some(most))
        };
        let counts: Vec<usize> =
            (0..8).map(|n| parts(Some(n), SOFTWARE_TURNS).expect("parts").len()).collect();
        assert!(counts.is_sorted() && counts[1] > 2 * counts[0], "{counts:?}");
        assert_eq!((counts[6], counts[7]), (400, 400));
        assert!(parts(None, SOFTWARE_TURNS).expect("parts").len() <= counts[0]);
        let refused = parts(Some(0), 200);
        assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
    }

    /// Lengths of rows at which layers were first missing on llvmpipe (Mesa 22.3.6).
    #[test]
    fn rays_are_cut_before_the_adapter_cuts_them() {
        for (counts, kernel, radius, layers, thickness) in [
            ([2796, 1, 1], Kernel::Cubic, 1.558, Layers::Slabs, 1.0),
            ([1410, 1, 1], Kernel::Cubic, 1.558, Layers::Slabs, 0.25),
            ([482, 1, 1], Kernel::Cubic, 1.558, Layers::Slabs, 0.0625),
            ([858, 5, 5], Kernel::Cubic, 1.558, Layers::Slabs, 1.0),
            ([2815, 1, 1], Kernel::Cubic, 1.558, Layers::Sheets, 1.0375),
            ([5559, 1, 1], Kernel::Cubic, 1.558, Layers::None, 1.0),
            ([1760, 1, 1], Kernel::Linear, 1.0, Layers::Slabs, 1.0),
            ([1272, 1, 1], Kernel::BSpline, 2.0, Layers::Slabs, 1.0),
        ] {
            let gather = along(counts, radius, thickness);
            assert!(parts(&gather, kernel, layers).len() > 1, "{counts:?} {kernel:?} {layers:?}");
            // And not long before.
            let short = along([counts[0] / 6, counts[1], counts[2]], radius, thickness);
            assert_eq!(parts(&short, kernel, layers).len(), 1, "{counts:?} {kernel:?} {layers:?}");
            let free = gathered(&gather, (kernel, layers), 2, Among::default(), None);
            let everything = Part { along: [0, i32::MAX, 16, 0], rays: [0, 4, 2, ENDS] };
            assert_eq!(free, Ok(vec![everything]));
        }
        let row = |n| SlabRays {
            view_from_index: DMat3::IDENTITY,
            dims: [1, 1, n],
            thickness: 1.0 / 64.0,
            side: 1,
            window: None,
            surfaces: 0,
            projects: false,
            polygons: None,
            seeks_specks: false,
        };
        assert!(row(320).parts(Some(SOFTWARE_TURNS)).is_some());
        assert_eq!(row(240).parts(Some(SOFTWARE_TURNS)), None);
        assert_eq!(row(5000).parts(None), None);
    }

    #[test]
    fn parts_follow_one_another_to_the_end() {
        let gather = along([4096, 3, 3], 1.558, 0.5);
        for layers in [Layers::None, Layers::Sheets, Layers::Slabs] {
            let parts = parts(&gather, Kernel::Cubic, layers);
            assert_eq!(parts[0].along[0], 0);
            let follow = |two: &[Part]| two[0].along[1] == two[1].along[0];
            assert!(parts.windows(2).all(follow), "{parts:?}");
            let size = parts[0].along[2];
            let units = match layers {
                Layers::None => 4096,
                // And their rims.
                Layers::Sheets | Layers::Slabs => (4099 * 2) / size,
            };
            assert!(parts[parts.len() - 1].along[1] >= units, "{layers:?} {parts:?}");
        }
        let rays = SlabRays {
            view_from_index: DMat3::IDENTITY,
            dims: [100, 100, 4096],
            thickness: 0.1,
            side: 2,
            window: None,
            surfaces: 0,
            projects: false,
            polygons: None,
            seeks_specks: false,
        };
        let parts = rays.parts(Some(SOFTWARE_TURNS)).expect("more than one");
        let of_ray = |ray: u32| -> Vec<SlabPart> {
            parts.iter().copied().filter(|part| part[0] == ray && part[1] == ray + 1).collect()
        };
        for ray in 0..4 {
            let parts = of_ray(ray);
            // 40 960 faces, eight to a look.
            assert!(parts.iter().map(|part| part[2]).sum::<u32>() > 5_120, "{parts:?}");
            let last = parts.len() - 1;
            assert!(
                parts
                    .iter()
                    .enumerate()
                    .all(|(i, part)| { part[3] == u32::from(i > 0) | u32::from(i == last) << 1 }),
                "{parts:?}"
            );
        }
        // Short rays, several to a dispatch.
        let short = SlabRays { dims: [10, 10, 400], thickness: 0.1, side: 8, ..rays };
        let parts = short.parts(Some(SOFTWARE_TURNS)).expect("more than one");
        assert!(
            parts.len() < 64 && parts[0][1] > 1 && parts[parts.len() - 1][1] == 64,
            "{parts:?}"
        );
        assert!(parts.windows(2).all(|two| two[0][1] == two[1][0]), "{parts:?}");
    }

    #[test]
    fn specks_are_looked_for_in_turns_of_their_own() {
        let plain = SlabRays {
            view_from_index: DMat3::IDENTITY,
            dims: [1, 1, 240],
            thickness: 1.0 / 64.0,
            side: 1,
            window: None,
            surfaces: 0,
            projects: false,
            polygons: None,
            seeks_specks: false,
        };
        assert_eq!(plain.parts(Some(SOFTWARE_TURNS)), None);
        let seeking = SlabRays { seeks_specks: true, ..plain };
        assert!(seeking.parts(Some(SOFTWARE_TURNS)).is_some_and(|parts| parts.len() > 1));
    }

    /// Between two surfaces lies a layer of its own, and each is looked for: turns of every slab.
    #[test]
    fn surfaces_take_turns_of_their_own() {
        let plain = SlabRays {
            view_from_index: DMat3::IDENTITY,
            dims: [1, 1, 240],
            thickness: 1.0 / 64.0,
            side: 1,
            window: None,
            surfaces: 0,
            projects: false,
            polygons: None,
            seeks_specks: false,
        };
        assert_eq!(plain.parts(Some(SOFTWARE_TURNS)), None);
        let parts = |surfaces| {
            let rays = SlabRays { surfaces, ..plain };
            rays.parts(Some(SOFTWARE_TURNS)).map_or(1, |parts| parts.len())
        };
        assert!(parts(1) > 1 && parts(4) > 2 * parts(1), "{} {}", parts(1), parts(4));
    }

    /// Polygons of one pixel may all lie in one part of its ray, and more than fit are refused.
    #[test]
    fn polygons_take_turns_in_every_part() {
        let row = |polygons| SlabRays {
            view_from_index: DMat3::IDENTITY,
            dims: [1, 1, 1200],
            thickness: 1.0 / 16.0,
            side: 1,
            window: None,
            surfaces: 0,
            projects: false,
            polygons,
            seeks_specks: false,
        };
        let parts = |polygons: u32| {
            let parts = row(Some(polygons)).parts(Some(SOFTWARE_TURNS));
            parts.map_or(1, |parts| parts.len())
        };
        assert!(parts(900) > 2 * parts(1), "{} {}", parts(1), parts(900));
        assert!(row(Some(1000)).check(Some(SOFTWARE_TURNS)).is_ok());
        let refused = row(Some(1200)).check(Some(SOFTWARE_TURNS)).expect_err("too many");
        assert!(
            refused.to_string().contains("polygons over one pixel of at most 1092"),
            "{refused}"
        );
        assert!(row(Some(1_000_000)).check(None).is_ok());
    }

    #[test]
    fn more_slabs_than_can_be_told_apart_are_refused_before_any_memory_is_taken() {
        let row = |thickness| SlabRays {
            view_from_index: DMat3::IDENTITY,
            dims: [16, 16, 16],
            thickness,
            side: 1,
            window: None,
            surfaces: 0,
            projects: false,
            polygons: None,
            seeks_specks: false,
        };
        assert_eq!(row(1e-5).check(None), Ok(()));
        let refused = row(1e-20).check(None).expect_err("too many").to_string();
        assert!(refused.starts_with("expected slabs along a ray of at most 16777216"), "{refused}");
        assert_eq!(row(1e-20).parts(Some(SOFTWARE_TURNS)), None);
        let gather = along([16, 16, 16], 1.558, 1e-12);
        let refused = gathered(&gather, (Kernel::Cubic, Layers::Slabs), 1, Among::default(), None);
        assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
    }

    #[test]
    fn wide_kernels_come_in_smaller_chunks_and_then_are_refused() {
        let mut gather = along([512, 64, 64], 8.0, 1.0 / 64.0);
        gather.ahead = [1.0, 0.7, 0.7, 0.0];
        let parts = parts(&gather, Kernel::Cubic, Layers::Slabs);
        assert!(parts[0].along[2] < 16, "{:?}", parts[0]);
        let refused =
            gathered(&gather, (Kernel::Cubic, Layers::Slabs), 1, Among::default(), Some(1000));
        assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
    }
}
