//! What the engine keeps between pictures, and a picture tile by tile.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use fearless_simd::Level;

use super::composite::Rule;
use super::grid::Grid;
use super::kernels::{Kernels, MOST_SLABS};
use super::lattice::Lattice;
use super::levels::Levels;
use super::light::Light;
use super::loops::{What, draw_tile, has_all};
use super::masks::Masks;
use super::nodes::{Node, Nodes};
use super::own::{Own, OwnLanded};
use super::passing::Alone;
use super::polygons::Polygons;
use super::rays::{Rays, TILE, check_slabs};
use super::samples::Samples;
use super::splatted::{Splats, Splatted};
use super::sums::Asked;
use super::supports::{NotBegun, Unsupported};
use super::surfaces::Surfaces;
use super::table::Table;
use super::threads::Threads;
use super::walk::{Pixel, Scene};
use crate::core::colour::srgb_encoder;
use crate::core::parallel;
use crate::core::{Cancelled, LinearRgb, Ticket};
use crate::kernel::{Coefficients, Kernel};
use crate::plan::{COARSER, FieldCut, KernelSlabs, Plan, SlabField};
use crate::scene::{AlongRay, OpacityModel, SplatSettings};
use crate::transfer::Cumulative;
use crate::volume::ScalarVolume;

/// Pixels of a tile.
const TILE_PIXELS: usize = (TILE * TILE) as usize;

/// An engine that draws plans on the processor.
#[derive(Debug)]
pub struct Renderer {
    level: Level,
    threads: Threads,
    fields: [Option<Field>; 2],
    /// Means of the volume, for cuts of its fields.
    coarser: Option<[Lattice; COARSER]>,
    /// Of plans that shade first.
    samples: Option<Samples>,
    /// What making these took, until a picture of them is begun.
    samples_ms: f64,
    /// Of lists, where the picture that was begun last has any.
    kernels: Option<Kernels>,
    polygons: Option<Polygons>,
    picture: Option<Picture>,
    /// Opacities over 1, lowered to it, since the picture began.
    capped: u64,
    /// What its stages took: milliseconds, and how often each ran.
    stages: Vec<(&'static str, f64, u32)>,
    /// The loop that draws it, once there are tiles.
    loop_name: Option<&'static str>,
    most_bytes: u64,
}

/// A field as it is drawn from: its coefficients beyond its edges, too, and their bounds. Made by any thread.
#[derive(Debug)]
pub struct Stored(Lattice);

impl Stored {
    /// The coefficients of a volume in a mode.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        mode: &SplatSettings,
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let is_quick = which == SlabField::Preview;
        Lattice::new(volume, (mode, is_quick), coefficients, ticket).map(Self)
    }
}

/// Means of a field's samples, for cuts of it. Made by any thread.
#[derive(Debug)]
pub struct StoredLevels([Lattice; COARSER]);

impl StoredLevels {
    /// Means of 2³ and of 4³ samples of a volume.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(
        volume: &Arc<ScalarVolume>,
        [second, fourth]: [Coefficients; COARSER],
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let tents = SplatSettings { kernel: Kernel::Linear, extent: None, ..SplatSettings::EXACT };
        let of = |means| Lattice::new(volume, (&tents, true), means, ticket);
        Ok(Self([of(second)?, of(fourth)?]))
    }
}

#[derive(Debug)]
struct Field {
    lattice: Lattice,
    table: Option<Table>,
}

/// A picture that was begun.
#[derive(Debug)]
struct Picture {
    size: [u32; 2],
    /// By tile, rows from the top, each with its pixels in rows from the top.
    pixels: Vec<Pixel>,
    /// What is drawn on it, if anything.
    drawing: Option<Drawing>,
}

/// What a picture is drawn from, beside fields, their tables and kernels of lists.
#[derive(Debug)]
struct Drawing {
    of: Of,
    rays: Rays,
    rule: Rule,
}

/// What of a volume it is drawn from.
#[derive(Debug)]
enum Of {
    /// Kernels of lists, and polygons, have the stage to themselves.
    Nothing,
    /// Slabs of a field.
    Field(Box<OfField>),
    /// Its samples, where any can show.
    Samples(Option<Box<Grid>>),
    /// Boxes of its voxels.
    Nodes(Box<Nodes>),
}

/// The same of a field.
#[derive(Debug)]
struct OfField {
    which: SlabField,
    masks: Masks,
    light: Option<Light>,
    surfaces: Option<Surfaces>,
    /// Where basis functions or cells land.
    landed: Option<OwnLanded>,
    asked: Asked,
    along: AlongRay,
    cut: Option<Arc<FieldCut>>,
}

impl Drawing {
    fn of_field(&self) -> Option<&OfField> {
        match &self.of {
            Of::Field(of) => Some(of),
            Of::Nothing | Of::Samples(_) | Of::Nodes(_) => None,
        }
    }

    /// Bytes of memory: what nothing asks for takes none.
    fn size_bytes(&self) -> u64 {
        let landed = |of: &OfField| of.landed.as_ref().map_or(0, OwnLanded::size_bytes);
        let masks = self.of_field().map_or(0, |of| of.masks.size_bytes() + landed(of));
        let nodes = if let Of::Nodes(nodes) = &self.of { nodes.size_bytes() } else { 0 };
        masks + nodes + self.shading_bytes() + self.inside_bytes()
    }

    /// Of them, lights and shading tables.
    fn shading_bytes(&self) -> u64 {
        let light = self.of_field().and_then(|of| of.light.as_ref());
        light.map_or(0, Light::size_bytes)
    }

    /// Of them, what lets the inside be seen.
    fn inside_bytes(&self) -> u64 {
        let surfaces = self.of_field().and_then(|of| of.surfaces.as_ref());
        surfaces.map_or(0, Surfaces::size_bytes) + size_of_val(&self.rays.clip[..]) as u64
    }
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer {
    /// On this processor, with the widest instructions that it has and this engine is compiled for.
    pub fn new() -> Self {
        Self::with(Level::new(), 0)
    }

    /// On so many threads.
    pub fn with_threads(count: usize) -> Self {
        Self::with(Level::new(), count)
    }

    /// With the instructions of a level, on so many threads.
    pub(super) fn with(level: Level, threads: usize) -> Self {
        Self {
            level,
            threads: Threads::new(threads),
            fields: [None, None],
            coarser: None,
            samples: None,
            samples_ms: 0.0,
            kernels: None,
            polygons: None,
            picture: None,
            capped: 0,
            stages: Vec::new(),
            loop_name: None,
            most_bytes: 0,
        }
    }

    /// The instructions that it draws with, and on how many threads.
    pub fn name(&self) -> String {
        let threads = self.threads.run(rayon::current_num_threads);
        let threads =
            if threads == 1 { "1 thread".to_owned() } else { format!("{threads} threads") };
        format!("{}, {threads}", self.instructions())
    }

    /// The instructions that it draws with.
    fn instructions(&self) -> &'static str {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if self.level.as_avx2().is_some() {
            return "AVX2 and FMA";
        }
        #[cfg(target_arch = "aarch64")]
        if self.level.as_neon().is_some() {
            return "NEON";
        }
        "baseline instructions"
    }

    /// Whether the field of a volume in a mode is there.
    pub fn holds_field(
        &self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        mode: &SplatSettings,
    ) -> bool {
        self.fields[which as usize].as_ref().is_some_and(|field| field.lattice.is_of(volume, mode))
    }

    /// Takes a field in; its table is gone.
    pub fn set_field(&mut self, which: SlabField, Stored(lattice): Stored) {
        self.picture = None;
        self.fields[which as usize] = Some(Field { lattice, table: None });
        self.note_bytes();
    }

    /// Whether it draws cuts of fields, by the instructions that it has; else it draws all of a field in their place.
    pub fn draws_cuts(&self) -> bool {
        has_all(self.level)
    }

    /// Takes in the means of a volume, for cuts of its fields.
    pub fn set_levels(&mut self, StoredLevels(lattices): StoredLevels) {
        self.coarser = Some(lattices);
        self.note_bytes();
    }

    /// Whether the means of a volume are there.
    pub fn holds_levels(&self, volume: &Arc<ScalarVolume>) -> bool {
        self.coarser.as_ref().is_some_and(|[finer, _]| finer.is_of_volume(volume))
    }

    /// Bricks of the scene's own field, along each axis, and those in which anything can show.
    pub fn shown_bricks(&self) -> Option<([usize; 3], &[u32])> {
        let field = self.fields[SlabField::Own as usize].as_ref()?;
        Some((field.lattice.bricks.dims, &field.table.as_ref()?.visible))
    }

    /// Bricks of the scene's own field in which it may have any of some values, as isosurfaces do, and those that share a face
    /// with one: a ray that crosses no more than the corner of a brick is looked up beside it.
    pub fn passed_bricks(&self, levels: &[f64]) -> Vec<u32> {
        let field = self.fields[SlabField::Own as usize].as_ref();
        let Some(field) = field.filter(|_| !levels.is_empty()) else { return Vec::new() };
        let lattice = &field.lattice;
        let is_passed = |[low, high]: &[f32; 2]| {
            let (low, high) = (f64::from(*low) + lattice.bias, f64::from(*high) + lattice.bias);
            // The rounding of 32 bits.
            let slack = 1e-6 * low.abs().max(high.abs());
            levels.iter().any(|level| (low - slack..=high + slack).contains(level))
        };
        let [nx, ny, nz] = lattice.bricks.dims;
        let passed: Vec<bool> = lattice.bricks.ranges.iter().map(is_passed).collect();
        let is_near = |brick: usize| {
            [(1, nx), (nx, ny), (nx * ny, nz)].into_iter().any(|(stride, n)| {
                let at = brick / stride % n;
                (at > 0 && passed[brick - stride]) || (at + 1 < n && passed[brick + stride])
            })
        };
        let bricks = (0_u32..).zip(0..passed.len());
        bricks.filter(|&(_, i)| passed[i] || is_near(i)).map(|(brick, _)| brick).collect()
    }

    /// Lets go of a field.
    pub fn clear_field(&mut self, which: SlabField) {
        self.picture = None;
        self.fields[which as usize] = None;
    }

    /// Lets go of fields of other volumes.
    pub fn keep_fields_of(&mut self, volume: &Arc<ScalarVolume>) {
        for field in &mut self.fields {
            if field.as_ref().is_some_and(|field| !field.lattice.is_of_volume(volume)) {
                *field = None;
                self.picture = None;
            }
        }
        if !self.holds_levels(volume) {
            self.coarser = None;
        }
        if self.samples.as_ref().is_some_and(|samples| !samples.are_of_volume(volume)) {
            self.samples = None;
            self.picture = None;
        }
    }

    /// Whether the samples of a plan that shades first are there, or were begun.
    pub fn begun_samples(&self, plan: &Plan) -> bool {
        self.samples.as_ref().is_some_and(|samples| samples.are_of(plan))
    }

    /// Whether they are there, all of them.
    pub fn holds_samples(&self, plan: &Plan) -> bool {
        let is_filled = self.samples.as_ref().is_some_and(Samples::are_filled);
        is_filled && self.begun_samples(plan)
    }

    /// Makes the samples of a plan that shades first, as far as they are not there.
    ///
    /// # Errors
    /// [`Cancelled`]: what was made of them stays.
    pub fn make_samples(&mut self, plan: &Plan, ticket: &Ticket) -> Result<(), Cancelled> {
        let start = Instant::now();
        if !self.begun_samples(plan) {
            self.picture = None;
            self.samples = None;
            self.samples_ms = 0.0;
            self.samples = self.threads.run(|| Samples::new(plan, ticket))?;
            self.note_bytes();
        }
        let level = self.level;
        let filled = match &mut self.samples {
            Some(samples) => self.threads.run(|| samples.fill(level, ticket)),
            None => Ok(()),
        };
        self.samples_ms += start.elapsed().as_secs_f64() * 1e3;
        filled
    }

    /// Whether a field has a table.
    pub fn holds_table(&self, which: SlabField) -> bool {
        self.fields[which as usize].as_ref().is_some_and(|field| field.table.is_some())
    }

    /// Sets the classification of a field, in which isosurfaces at `levels` show, too.
    ///
    /// # Errors
    /// [`Cancelled`]: then it has the one that it had.
    pub fn set_table(
        &mut self,
        which: SlabField,
        table: &Cumulative,
        levels: &[f64],
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        if let Some(field) = &mut self.fields[which as usize] {
            let made = self.threads.run(|| Table::new(&field.lattice, table, levels, ticket))?;
            field.table = Some(made);
            self.note_bytes();
        }
        Ok(())
    }

    /// The kernel of a field and its samples along each axis.
    pub fn field_shape(&self, which: SlabField) -> Option<(Kernel, [usize; 3])> {
        self.fields[which as usize].as_ref().map(|field| (field.lattice.kernel, field.lattice.dims))
    }

    /// Begins the picture of a plan from one of the fields, with the kernels of its lists in slabs, if it has any; rays
    /// end where less than `stop_below` shows through. It stays blank where the plan has neither.
    ///
    /// # Errors
    /// Kernels that reach through too many slabs, and a cancelled ticket: then there is no picture.
    pub fn begin(
        &mut self,
        plan: &Plan,
        which: SlabField,
        kernels: Option<&KernelSlabs>,
        stop_below: f64,
        ticket: &Ticket,
    ) -> Result<(), NotBegun> {
        let start = Instant::now();
        let pixels = self.cleared(plan.size);
        match kernels {
            Some(slabs) => {
                self.list_kernels(plan, slabs, ticket)?;
                self.note_stage("list_kernels", start);
            }
            None => self.kernels = None,
        }
        let start = Instant::now();
        let (threads, polygons) = (&self.threads, &mut self.polygons);
        threads.run(|| Polygons::renew(polygons, plan, ticket))?;
        if self.polygons.is_some() {
            self.note_stage("place_polygons", start);
        }
        let start = Instant::now();
        let samples_ms = std::mem::take(&mut self.samples_ms);
        let drawing = match plan.field() {
            Some(_) if plan.reconstructs() => {
                check_slabs(plan, glam::DVec3::ZERO)?;
                self.forget_growths(plan, which);
                self.of_field(plan, which, stop_below, ticket)?
            }
            Some(_) => {
                if samples_ms > 0.0 {
                    self.stages.push(("classify_samples", samples_ms, 1));
                }
                let samples = self.samples.as_ref().filter(|samples| samples.are_of(plan));
                let grid = match samples {
                    Some(samples) => Grid::new(plan, samples)?,
                    None => None,
                };
                let rays = Rays::new(plan, [-0.5; 3], &[]);
                let of = Of::Samples(grid.map(Box::new));
                Some(Drawing { of, ..Self::drawing(plan, rays, stop_below) })
            }
            None => {
                let clip = plan.inside.clip.half_spaces(&plan.frame.lattice);
                let rays = Rays::new(plan, [-0.5; 3], &clip);
                Some(Self::drawing(plan, rays, stop_below))
            }
        };
        let masks_depths = drawing.as_ref().is_some_and(|drawing| drawing.of_field().is_some());
        self.picture = Some(Picture { size: plan.size, pixels, drawing });
        if masks_depths {
            self.note_stage("mask_depths", start);
        }
        self.note_bytes();
        Ok(())
    }

    /// Begins a picture of nothing but kernels that are shaded first, far to near, in the mode of a plan.
    ///
    /// # Errors
    /// Kernels that lie in too many slabs, and a cancelled ticket: then there is no picture.
    pub fn begin_nodes(
        &mut self,
        plan: &Plan,
        nodes: &[Node],
        stop_below: f64,
        ticket: &Ticket,
    ) -> Result<(), NotBegun> {
        let start = Instant::now();
        let pixels = self.cleared(plan.size);
        (self.kernels, self.polygons) = (None, None);
        let nodes = self.threads.run(|| Nodes::new(plan, nodes, ticket))?;
        let rays = Rays::new(plan, [-0.5; 3], &[]);
        let of = Of::Nodes(Box::new(nodes));
        let drawing = Some(Drawing { of, ..Self::drawing(plan, rays, stop_below) });
        self.picture = Some(Picture { size: plan.size, pixels, drawing });
        self.note_stage("list_nodes", start);
        self.note_bytes();
        Ok(())
    }

    /// Pixels without light, of a picture that begins.
    fn cleared(&mut self, size: [u32; 2]) -> Vec<Pixel> {
        self.capped = 0;
        self.stages.clear();
        self.loop_name = None;
        let mut pixels = self.picture.take().map(|picture| picture.pixels).unwrap_or_default();
        pixels.clear();
        pixels.resize(tile_count(size) as usize * TILE_PIXELS, [0.0; 4]);
        pixels
    }

    /// Has the kernels of a plan's lists where they land.
    fn list_kernels(
        &mut self,
        plan: &Plan,
        slabs: &KernelSlabs,
        ticket: &Ticket,
    ) -> Result<(), NotBegun> {
        if !self.kernels.as_mut().is_some_and(|kernels| kernels.serve(plan, slabs)) {
            let old = self.kernels.as_ref().map_or(&[][..], |kernels| &kernels.looks);
            self.kernels = Some(self.threads.run(|| Kernels::new(plan, slabs, old, ticket))?);
        }
        let most = self.kernels.as_ref().map_or(0, |kernels| kernels.most_slabs);
        if most > MOST_SLABS {
            let found = format!("vectors that reach through more than {MOST_SLABS} slabs ({most})");
            return Err(Unsupported(found).into());
        }
        Ok(())
    }

    /// Lets go of what light that a plan does not have takes for the growth of cells.
    fn forget_growths(&mut self, plan: &Plan, which: SlabField) {
        let field = self.fields[which as usize].as_mut();
        if let Some(Own::Cells(cells)) = field.and_then(|field| field.lattice.own.as_mut()) {
            let light = Light::of(plan).filter(|light| light.uses_gradient);
            cells.forget_growths(light.map(|light| light.is_of_slabs && light.is_of_borders));
        }
    }

    /// What a plan with a field is drawn from, where that and its table are there.
    fn of_field(
        &self,
        plan: &Plan,
        which: SlabField,
        stop_below: f64,
        ticket: &Ticket,
    ) -> Result<Option<Drawing>, NotBegun> {
        let Some(Field { lattice, table: Some(table) }) = &self.fields[which as usize] else {
            return Ok(None);
        };
        let end = lattice.dims.map(|n| n as f64 - 0.5);
        let clip = plan.inside.clip.half_spaces(&plan.frame.lattice);
        let rays = Rays::new(plan, end, &clip);
        let along = plan.inside.along;
        let composites = along == AlongRay::Composite;
        let shown = if composites { &table.visible[..] } else { &[] };
        let masks = self.threads.run(|| {
            let shown = (lattice.dims, shown);
            Masks::new(&rays, &lattice.bricks, shown, ticket)
        })?;
        let own = lattice.own.as_ref().filter(|own| own.lands());
        let asked = if composites { Asked::of(plan.mode.classify) } else { Asked::Faces };
        let land = |own: &Own| self.threads.run(|| own.land((&rays, asked), ticket));
        let landed = own.map(land).transpose()?;
        let light = Light::of(plan).filter(|_| composites);
        if let (Some(Own::Cells(cells)), Some(light)) = (own, &light)
            && light.uses_gradient
        {
            let for_light = light.is_of_slabs && light.is_of_borders;
            self.threads.run(|| cells.make_growths(for_light, ticket))?;
        }
        let of_field = OfField {
            which,
            masks,
            landed,
            asked,
            light,
            surfaces: Surfaces::of(plan),
            along,
            cut: plan.cut.clone().filter(|_| self.draws_cuts()),
        };
        let of = Of::Field(Box::new(of_field));
        Ok(Some(Drawing { of, ..Self::drawing(plan, rays, stop_below) }))
    }

    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    fn drawing(plan: &Plan, rays: Rays, stop_below: f64) -> Drawing {
        Drawing {
            of: Of::Nothing,
            rule: Rule {
                middle: plan.mode.classify.takes_one_value(),
                published: plan.mode.opacity_model == OpacityModel::Published,
                back_to_front: rays.back_to_front,
                // Far to near nothing is hidden before it is drawn.
                stop_below: if rays.back_to_front { 0.0 } else { stop_below as f32 },
            },
            rays,
        }
    }

    /// Lets go of kernels that are not drawn any more.
    pub fn clear_kernels(&mut self) {
        self.kernels = None;
    }

    /// Draws some tiles of the picture that was begun, on all threads: each thread one at least, and none more after so many
    /// milliseconds, as a few may take longer than all before them. Says which is the next.
    ///
    /// # Errors
    /// [`Cancelled`]: no tile is begun after it, and the picture is to be begun anew.
    pub fn draw_tiles(
        &mut self,
        tiles: Range<u32>,
        most_ms: f64,
        ticket: &Ticket,
    ) -> Result<u32, Cancelled> {
        let start = Instant::now();
        let Some(Picture { pixels, drawing: Some(drawing), .. }) = &mut self.picture else {
            return Ok(tiles.end);
        };
        let Drawing { of, rays, rule } = &*drawing;
        let coarser = self.coarser.as_ref();
        let (kernels, polygons, rule) = (self.kernels.as_ref(), self.polygons.as_ref(), *rule);
        let what = match of {
            Of::Field(of) => {
                let Some(Field { lattice, table: Some(table) }) = &self.fields[of.which as usize]
                else {
                    return Ok(tiles.end);
                };
                let scene = Scene {
                    rays,
                    masks: &of.masks,
                    lattice,
                    landed: of.landed.as_ref().map(|landed| (landed, of.asked)),
                    levels: coarser
                        .zip(of.cut.as_deref())
                        .map(|(means, cut)| Levels::new(lattice, means, cut)),
                    table,
                    light: of.light.as_ref(),
                    surfaces: of.surfaces.as_ref(),
                    kernels,
                    polygons,
                    rule,
                };
                match of.along {
                    AlongRay::Composite => What::Slabs(scene),
                    along => What::Values(scene, along),
                }
            }
            Of::Samples(grid) => {
                let splats = match (grid, &self.samples) {
                    (Some(grid), Some(samples)) => Splats::Samples(grid, samples),
                    _ if kernels.is_none() && polygons.is_none() => return Ok(tiles.end),
                    _ => Splats::Nothing,
                };
                What::Splatted(Splatted { rays, splats, kernels, polygons, rule })
            }
            Of::Nodes(nodes) => {
                let splats = Splats::Nodes(nodes);
                What::Splatted(Splatted { rays, splats, kernels, polygons, rule })
            }
            Of::Nothing if kernels.is_none() && polygons.is_none() => return Ok(tiles.end),
            Of::Nothing => What::Alone(Alone { rays, kernels, polygons, rule }),
        };
        let level = self.level;
        self.loop_name = Some(what.loop_name(level));
        let capped = AtomicU64::new(0);
        let first = tiles.start as usize;
        let pixels = &mut pixels[first * TILE_PIXELS..tiles.end as usize * TILE_PIXELS];
        let left = Mutex::new((first..).zip(pixels.chunks_mut(TILE_PIXELS)));
        // One after the other, so that what was begun in time is all that comes before the next.
        let next_tile = || left.lock().unwrap_or_else(PoisonError::into_inner).next();
        self.threads.run(|| {
            rayon::broadcast(|_| {
                let mut found = 0;
                while !ticket.is_cancelled()
                    && let Some((tile, out)) = next_tile()
                {
                    found += draw_tile(level, &what, tile, out);
                    if start.elapsed().as_secs_f64() * 1e3 > most_ms {
                        break;
                    }
                }
                capped.fetch_add(found, Ordering::Relaxed);
            });
        });
        let next = next_tile().map_or(tiles.end, |(tile, _)| tile as u32);
        self.capped += capped.into_inner();
        let stage = match what {
            What::Slabs(_) => "walk_slabs",
            What::Values(..) => "project_values",
            What::Splatted(Splatted { splats: Splats::Nodes(_), .. }) => "composite_nodes",
            What::Splatted(_) => "gather_samples",
            What::Alone(_) => "composite_kernels",
        };
        self.note_stage(stage, start);
        ticket.look()?;
        Ok(next)
    }

    /// What the stages of the picture took so far: names, milliseconds, and how often each ran.
    pub fn stages(&self) -> &[(&'static str, f64, u32)] {
        &self.stages
    }

    /// The compiled loop that draws the picture; `None` where there is nothing to be drawn.
    pub fn loop_name(&self) -> Option<&'static str> {
        self.loop_name
    }

    fn note_stage(&mut self, name: &'static str, start: Instant) {
        let ms = start.elapsed().as_secs_f64() * 1e3;
        match self.stages.iter_mut().find(|stage| stage.0 == name) {
            Some(stage) => (stage.1, stage.2) = (stage.1 + ms, stage.2 + 1),
            None => self.stages.push((name, ms, 1)),
        }
    }

    /// Opacities of the picture that were over 1, and lowered to it.
    pub fn capped(&self) -> u64 {
        self.capped
    }

    /// The picture: premultiplied linear RGBA, rows from the top; and its size.
    pub fn light(&self) -> (Vec<Pixel>, [u32; 2]) {
        (self.by_rows(|pixel| *pixel), self.picture.as_ref().map_or([0; 2], |picture| picture.size))
    }

    /// The picture as sRGB bytes with straight alpha, over a background; rows from the top.
    pub fn srgb_bytes(&self, background: Option<LinearRgb>) -> Vec<u8> {
        self.by_rows(srgb_encoder(background)).into_flattened()
    }

    /// Each pixel of the picture made something else, in rows from the top.
    fn by_rows<T: Copy + Default + Send>(&self, make: impl Fn(&Pixel) -> T + Sync) -> Vec<T> {
        let Some(Picture { size, pixels, .. }) = &self.picture else { return Vec::new() };
        let [width, height] = size.map(|n| n as usize);
        let tile = TILE as usize;
        let across = width.div_ceil(tile);
        let mut made = vec![T::default(); width * height];
        self.threads.run(|| {
            parallel::each(made.chunks_mut(width.max(1)).enumerate(), |(y, row)| {
                for (i, part) in row.chunks_mut(tile).enumerate() {
                    let start = ((y / tile) * across + i) * TILE_PIXELS + y % tile * tile;
                    for (made, pixel) in part.iter_mut().zip(&pixels[start..]) {
                        *made = make(pixel);
                    }
                }
            });
        });
        made
    }

    /// Bytes of memory that it holds.
    pub fn size_bytes(&self) -> u64 {
        let of_field = |field: &Field| {
            field.lattice.size_bytes() + field.table.as_ref().map_or(0, Table::size_bytes)
        };
        let of_picture = |picture: &Picture| {
            size_of_val(&picture.pixels[..]) as u64
                + picture.drawing.as_ref().map_or(0, Drawing::size_bytes)
        };
        self.fields.iter().flatten().map(of_field).sum::<u64>()
            + self.coarser.iter().flatten().map(Lattice::size_bytes).sum::<u64>()
            + self.samples.as_ref().map_or(0, Samples::size_bytes)
            + self.picture.as_ref().map_or(0, of_picture)
            + self.kernel_bytes()
            + self.polygon_bytes()
    }

    /// Of them, those of lights and shading tables, and those of what lets the inside be seen.
    pub fn effect_bytes(&self) -> [u64; 2] {
        let drawing = self.picture.as_ref().and_then(|picture| picture.drawing.as_ref());
        drawing.map_or([0; 2], |drawing| [drawing.shading_bytes(), drawing.inside_bytes()])
    }

    /// Of them, those of kernels of lists.
    pub fn kernel_bytes(&self) -> u64 {
        self.kernels.as_ref().map_or(0, Kernels::size_bytes)
    }

    /// Of them, those of polygons.
    pub fn polygon_bytes(&self) -> u64 {
        self.polygons.as_ref().map_or(0, Polygons::size_bytes)
    }

    /// The most that it held.
    pub fn peak_bytes(&self) -> u64 {
        self.most_bytes
    }

    fn note_bytes(&mut self) {
        self.most_bytes = self.most_bytes.max(self.size_bytes());
    }
}

/// Tiles of a picture.
pub fn tile_count(size: [u32; 2]) -> u32 {
    size[0].div_ceil(TILE) * size[1].div_ceil(TILE)
}
