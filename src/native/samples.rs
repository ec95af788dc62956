//! Samples that are classified, and shaded, before kernels are put together: what each looks like, brick by brick.
//!
//! Bricks in which nothing can show take no memory.

use std::sync::Arc;

use fearless_simd::{Level, Simd, prelude::*};
use glam::DVec3;

use super::lanes::{LANES, Lanes, Look, Vec3, dispatched};
use super::light::{Growth, Light, ValueScale};
use super::table::Halves;
use crate::core::parallel;
use crate::core::{Camera, Cancelled, Ticket, mapped};
use crate::plan::Plan;
use crate::scene::{OpacityModel, Shading, View};
use crate::transfer::{Table, TransferFunction};
use crate::volume::{BRICK, Scalar, ScalarVolume};
use crate::with_samples;

/// No place of a brick in which nothing shows.
const NOTHING: u32 = u32::MAX;
/// Bricks that each thread fills between two looks at the ticket: lit ones take a tenth of a millisecond.
const BRICKS_A_THREAD: usize = 16;
/// And bricks of which is found out whether they can show.
const A_PART: usize = 1 << 13;
/// Samples of a brick.
const BRICK_SAMPLES: usize = BRICK * BRICK * BRICK;

/// What a sample looks like: linear colour; and extinction per unit distance, or opacity over that.
pub(super) type SampleLook = [f32; 4];
/// Those of a brick, x fastest.
type BrickLooks = [SampleLook; BRICK_SAMPLES];

/// The samples of a volume, each by itself.
#[derive(Debug)]
pub(super) struct Samples {
    made_of: MadeOf,
    /// Of each brick, x fastest: the place of its samples among `looks`, in bricks.
    places: Vec<u32>,
    looks: Vec<BrickLooks>,
    /// Until all are filled.
    filling: Option<Filling>,
    pub dims: [usize; 3],
    bricks: [usize; 3],
    /// First and last brick along each axis that can show; `None` where none can.
    pub showing: Option<[[usize; 3]; 2]>,
}

/// What bricks are filled by.
#[derive(Debug)]
struct Filling {
    /// Bricks that can show, in the order of their places.
    with_looks: Vec<usize>,
    table: Table,
    shader: Option<Shader>,
    filled: usize,
}

/// Everything that looks depend on, but for the samples themselves.
#[derive(Debug, Clone, PartialEq)]
struct MadeOf {
    volume: Volume,
    transfer: TransferFunction,
    published: bool,
    /// What shades samples, if anything, and from where they are seen.
    shaded: Option<(Shading, Camera, View)>,
}

/// A volume: the same one, not an equal one.
#[derive(Debug, Clone)]
struct Volume(Arc<ScalarVolume>);

impl PartialEq for Volume {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl MadeOf {
    /// `None` of a plan without a field.
    fn new(plan: &Plan) -> Option<Self> {
        let field = plan.field()?;
        let shades = plan.shades_samples();
        Some(Self {
            volume: Volume(Arc::clone(&field.volume)),
            transfer: match shades {
                true => plan.shading.by_value(&field.transfer),
                false => field.transfer.clone(),
            },
            published: plan.mode.opacity_model == OpacityModel::Published,
            shaded: shades.then(|| (plan.shading.clone(), plan.camera, plan.view())),
        })
    }
}

impl Samples {
    /// Those of a plan, whose bricks are to be filled; `None` where it has no field.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(plan: &Plan, ticket: &Ticket) -> Result<Option<Self>, Cancelled> {
        let Some(made_of) = MadeOf::new(plan) else { return Ok(None) };
        let volume = Arc::clone(&made_of.volume.0);
        let table = Table::new(&made_of.transfer, volume.samples.scalar_type());
        let shown = shown(&volume, &table, ticket)?;
        let bricks = volume.bricks.dims;
        let with_looks: Vec<usize> = (0..shown.len()).filter(|&brick| shown[brick]).collect();
        let mut places = vec![NOTHING; shown.len()];
        for (place, &brick) in (0..).zip(&with_looks) {
            places[brick] = place;
        }
        let shader = made_of.shaded.as_ref().and_then(|_| Shader::new(plan, &volume));
        Ok(Some(Self {
            looks: bytemuck::zeroed_vec(with_looks.len()),
            dims: volume.lattice.dims,
            showing: showing(&shown, bricks),
            filling: Some(Filling { with_looks, table, shader, filled: 0 }),
            made_of,
            places,
            bricks,
        }))
    }

    /// Fills the bricks that are not filled yet.
    ///
    /// # Errors
    /// [`Cancelled`]: those that were filled stay so.
    pub(super) fn fill(&mut self, level: Level, ticket: &Ticket) -> Result<(), Cancelled> {
        let Self { filling, looks, made_of, bricks, .. } = self;
        let Some(Filling { with_looks, table, shader, filled }) = filling else { return Ok(()) };
        let MadeOf { volume: Volume(volume), published, .. } = &*made_of;
        let classifier = Classifier { volume, table, published: *published };
        let fill = |looks: &mut BrickLooks, brick: usize| {
            let first = brick_at(brick, *bricks).map(|n| n * BRICK);
            for (row, looks) in looks.chunks_exact_mut(BRICK).enumerate() {
                let at = [first[0], first[1] + row % BRICK, first[2] + row / BRICK];
                classifier.fill(at, looks);
                if let Some(shader) = &*shader
                    && looks.iter().any(|look| look[3] > 0.0)
                {
                    shader.shade(level, at, looks);
                }
            }
        };
        let piece = BRICKS_A_THREAD * rayon::current_num_threads();
        while *filled < with_looks.len() {
            ticket.look()?;
            let some = *filled..(*filled + piece).min(with_looks.len());
            let own = looks[some.clone()].iter_mut().zip(&with_looks[some.clone()]);
            parallel::each(own, |(looks, brick)| fill(looks, *brick));
            *filled = some.end;
        }
        *filling = None;
        Ok(())
    }

    /// Whether all are filled.
    pub(super) fn are_filled(&self) -> bool {
        self.filling.is_none()
    }

    /// Whether they are those of a plan.
    pub(super) fn are_of(&self, plan: &Plan) -> bool {
        MadeOf::new(plan).as_ref() == Some(&self.made_of)
    }

    /// Whether they are of a volume.
    pub(super) fn are_of_volume(&self, volume: &Arc<ScalarVolume>) -> bool {
        Arc::ptr_eq(&self.made_of.volume.0, volume)
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        (size_of_val(&self.places[..]) + size_of_val(&self.looks[..])) as u64
    }

    /// Them, indexed along axes in another order.
    pub(super) fn along(&self, axes: [usize; 3]) -> Along<'_> {
        let bricks = [1, self.bricks[0], self.bricks[0] * self.bricks[1]];
        let samples = [1, BRICK, BRICK * BRICK];
        Along {
            samples: self,
            brick_strides: axes.map(|axis| bricks[axis]),
            strides: axes.map(|axis| samples[axis]),
        }
    }
}

/// Them, indexed along axes in the order of a traversal, outermost first.
#[derive(Clone, Copy)]
pub(super) struct Along<'a> {
    samples: &'a Samples,
    brick_strides: [usize; 3],
    /// Of samples within a brick.
    strides: [usize; 3],
}

/// A row of them along the innermost axis.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    samples: &'a Samples,
    /// The brick and the sample in it of index 0 along that axis.
    brick: usize,
    brick_stride: usize,
    sample: usize,
    stride: usize,
}

/// What classifies the samples of a volume.
struct Classifier<'a> {
    volume: &'a ScalarVolume,
    table: &'a Table,
    published: bool,
}

impl Classifier<'_> {
    /// Fills a row along x that begins at `first`, as far as there are samples.
    fn fill(&self, first: [usize; 3], looks: &mut [SampleLook]) {
        let dims = self.volume.lattice.dims;
        if first[1] >= dims[1] || first[2] >= dims[2] {
            return;
        }
        let begin = (first[2] * dims[1] + first[1]) * dims[0] + first[0];
        let count = looks.len().min(dims[0] - first[0]);
        with_samples!(&*self.volume.samples, values => {
            for (look, value) in looks.iter_mut().zip(&values[begin..begin + count]) {
                let [r, g, b, extinction] = self.table.lookup(value.to_f64());
                let weight = if self.published { -(-extinction).exp_m1() } else { extinction };
                *look = [r, g, b, weight];
            }
        });
    }
}

/// Bytes that the samples of a plan take.
///
/// # Errors
/// [`Cancelled`].
pub fn samples_bytes(plan: &Plan, ticket: &Ticket) -> Result<u64, Cancelled> {
    let Some(made_of) = MadeOf::new(plan) else { return Ok(0) };
    let volume = &made_of.volume.0;
    let table = Table::new(&made_of.transfer, volume.samples.scalar_type());
    let shown = shown(volume, &table, ticket)?;
    let count = shown.iter().filter(|&&shows| shows).count();
    Ok(size_of_val(&shown[..]) as u64 * 4 + count as u64 * size_of::<BrickLooks>() as u64)
}

/// Which bricks of a volume can show.
fn shown(volume: &ScalarVolume, table: &Table, ticket: &Ticket) -> Result<Vec<bool>, Cancelled> {
    let bricks = &volume.bricks;
    let shows = |brick: usize| table.shows(bricks.ranges[brick], bricks.has_holes(brick));
    mapped(bricks.ranges.len(), A_PART, shows, ticket)
}

/// First and last brick along each axis that can show.
fn showing(shown: &[bool], dims: [usize; 3]) -> Option<[[usize; 3]; 2]> {
    let mut found: Option<[[usize; 3]; 2]> = None;
    for brick in (0..shown.len()).filter(|&brick| shown[brick]) {
        let at = brick_at(brick, dims);
        let [low, high] = found.get_or_insert([at, at]);
        *low = std::array::from_fn(|axis| low[axis].min(at[axis]));
        *high = std::array::from_fn(|axis| high[axis].max(at[axis]));
    }
    found
}

fn brick_at(brick: usize, dims: [usize; 3]) -> [usize; 3] {
    [brick % dims[0], brick / dims[0] % dims[1], brick / (dims[0] * dims[1])]
}

impl<'a> Along<'a> {
    /// Whether anything can show of the samples from `low` to `high`.
    #[inline(always)]
    pub(super) fn any_shows(&self, low: [i32; 3], high: [i32; 3]) -> bool {
        let [first, last] = [low, high].map(|at| at.map(|i| (i / BRICK as i32) as usize));
        let [sa, sb, sc] = self.brick_strides;
        (first[0]..=last[0]).any(|a| {
            (first[1]..=last[1]).any(|b| {
                let row = a * sa + b * sb;
                (first[2]..=last[2]).any(|c| self.samples.places[row + c * sc] != NOTHING)
            })
        })
    }

    /// The samples of a row along the last axis.
    #[inline(always)]
    pub(super) fn row(self, [a, b]: [i32; 2]) -> Row<'a> {
        let brick = |i: i32| (i / BRICK as i32) as usize;
        let within = |i: i32| (i % BRICK as i32) as usize;
        let ([pa, pb, pc], [sa, sb, sc]) = (self.brick_strides, self.strides);
        Row {
            samples: self.samples,
            brick: brick(a) * pa + brick(b) * pb,
            brick_stride: pc,
            sample: within(a) * sa + within(b) * sb,
            stride: sc,
        }
    }
}

impl<'a> Row<'a> {
    /// What a sample of it looks like; nothing where its brick shows nothing.
    #[inline(always)]
    pub(super) fn look(self, c: i32) -> Option<&'a SampleLook> {
        let (brick, within) = ((c / BRICK as i32) as usize, (c % BRICK as i32) as usize);
        let place = self.samples.places[self.brick + brick * self.brick_stride];
        let looks = self.samples.looks.get(place as usize)?;
        Some(&looks[self.sample + within * self.stride]).filter(|look| look[3] > 0.0)
    }
}

/// What lights and shading tables make of samples (Westover's shading process): each has the gradient of the samples
/// beside it, and is seen from where it stands itself.
#[derive(Debug)]
struct Shader {
    light: Light,
    volume: Arc<ScalarVolume>,
    camera: Camera,
    /// View depth of an index, pixels.
    per_index: DVec3,
    centre: DVec3,
}

impl Shader {
    fn new(plan: &Plan, volume: &Arc<ScalarVolume>) -> Option<Self> {
        let view = plan.view();
        let per_index = view.view_from_index.transpose().z_axis;
        let (camera, centre) = (plan.camera, view.lattice_centre);
        Some(Self {
            light: Light::of(plan)?,
            volume: Arc::clone(volume),
            camera,
            per_index,
            centre,
        })
    }

    /// Shades a row of samples along x that begins at `first`.
    fn shade(&self, level: Level, first: [usize; 3], looks: &mut [SampleLook]) {
        let count = looks.len().min(self.volume.lattice.dims[0] - first[0]);
        let seen: [Seen; LANES] = with_samples!(&*self.volume.samples, values => {
            std::array::from_fn(|i| match i < count {
                true => self.seen(values, [first[0] + i, first[1], first[2]]),
                false => Seen::default(),
            })
        });
        dispatched!(level, simd => self.shade_seen(simd, &seen, looks));
    }

    fn seen<T: Scalar>(&self, values: &[T], at: [usize; 3]) -> Seen {
        let dims = self.volume.lattice.dims;
        let value = |i: [usize; 3]| values[(i[2] * dims[1] + i[1]) * dims[0] + i[0]].to_f64();
        let here = value(at);
        // Between the samples on both sides; to one where the other is missing or has no data.
        let growth = |axis: usize| {
            let moved = |to: usize| {
                let mut i = at;
                i[axis] = to;
                Some(value(i)).filter(|value| !value.is_nan())
            };
            let before = at[axis].checked_sub(1).and_then(moved);
            let after = Some(at[axis] + 1).filter(|&i| i < dims[axis]).and_then(moved);
            match (before, after) {
                (Some(before), Some(after)) => (after - before) / 2.0,
                (Some(before), None) => here - before,
                (None, Some(after)) => after - here,
                (None, None) => 0.0,
            }
        };
        let index = DVec3::from(at.map(|i| i as f64));
        let eye = match self.camera.eye_distance() {
            Some(_) => {
                let place = self.volume.lattice.world_from_index(index);
                (self.camera.view_origin() - place).normalize_or_zero()
            }
            None => -self.camera.direction,
        };
        #[expect(clippy::cast_possible_truncation, reason = "pixels have 32 bits, as the device's")]
        let narrow = |x: f64| x as f32;
        Seen {
            value: narrow(here),
            growth: [0, 1, 2].map(growth).map(narrow),
            eye: eye.as_vec3().to_array(),
            depth: narrow(self.per_index.dot(index - self.centre)),
        }
    }

    #[inline(always)]
    fn shade_seen<S: Simd>(&self, simd: S, seen: &[Seen; LANES], looks: &mut [SampleLook]) {
        let lanes = |f: fn(&Seen) -> f32| Lanes::from_fn(simd, |i| f(&seen[i]));
        let vec3 = |f: fn(&Seen) -> [f32; 3]| Vec3 {
            x: Lanes::from_fn(simd, |i| f(&seen[i])[0]),
            y: Lanes::from_fn(simd, |i| f(&seen[i])[1]),
            z: Lanes::from_fn(simd, |i| f(&seen[i])[2]),
        };
        let own = |c: usize| Lanes::from_fn(simd, |i| looks[i][c]);
        let look = Look { colour: Vec3 { x: own(0), y: own(1), z: own(2) }, weight: own(3) };
        let mut halves = Halves { near: look, far: Look::splat(simd, [0.0; 4]) };
        let growth = self.light.uses_gradient.then(|| Growth::At(vec3(|seen| seen.growth)));
        let place = (lanes(|seen| seen.value), growth, lanes(|seen| seen.depth));
        let eye = vec3(|seen| seen.eye);
        self.light.shade(simd, (eye, ValueScale::VALUES), &mut halves, place);
        let found = halves.near;
        for (i, (look, seen)) in looks.iter_mut().zip(seen).enumerate() {
            // What has no data has neither a value nor a gradient.
            if look[3] > 0.0 && !seen.value.is_nan() {
                let [r, g, b] = found.colour.lane(i);
                *look = [r, g, b, found.weight[i]];
            }
        }
    }
}

/// What a sample is shaded by.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    value: f32,
    /// Per index.
    growth: [f32; 3],
    /// Unit vector towards the eye, in the world.
    eye: [f32; 3],
    /// Pixels beyond the lattice's centre.
    depth: f32,
}
