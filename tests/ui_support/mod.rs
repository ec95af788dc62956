//! Stand-ins for the engine, the readers and the desktop, and a hand on the window.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use eframe::egui::{
    Context, DroppedFile, Event, FullOutput, KeyboardShortcut, Modifiers, MouseWheelSource,
    MouseWheelUnit, PointerButton, Pos2, Rect, TextureId, TexturesDelta, TouchPhase, Vec2,
    ViewportCommand, ViewportId, vec2,
};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::app::document::{Library, RawLayout, ReadFailure, ReadGrid, Slice, Source};
use voxsplat::app::drawer::Drawer;
use voxsplat::app::file_dialog::FileDialog;
use voxsplat::app::measuring::{ChartPoint, Measurer, Stepped};
use voxsplat::app::pacing::News;
use voxsplat::app::saving::SaveRequest;
use voxsplat::app::settings::Settings;
use voxsplat::app::software::Canvas;
use voxsplat::app::{Parts, Window};
use voxsplat::cells::{self, Listing};
use voxsplat::core::{Camera, Ticket};
use voxsplat::io::Series;
use voxsplat::scene::{
    Cell, Cells, FirstLook, Lighting, Orientation, Shading, SplatSettings, Visibility, WhyWhole,
};
use voxsplat::task::engine::Effort;
use voxsplat::task::engine::{
    CellsRequest, EngineChoice, EngineKind, EngineState, FoundCells, FrameReport, FrameRequest,
    HeldBytes, Next, Picture, Refined, SecondPicture, SecondRequest,
};
use voxsplat::task::estimate::Checked;
use voxsplat::task::level::LevelOfDetail;
use voxsplat::task::still::Convergence;
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction, presets};
use voxsplat::volume::{
    Association, Field, Grid, LabelName, Lattice, Samples, ScalarType, ScalarVolume, Shape,
    Statistics,
};

/// Length of every file that the stand-in readers know.
pub(crate) const RAW_BYTES: u64 = 64;
/// Time that passes from one pass to the next.
const STEP_SECS: f32 = 1.0 / 60.0;
/// Passes after which a view counts as resting, with some to spare.
const STEPS_TO_REST: usize = 14;

/// Draws a gradient for every request at once, and remembers what was asked.
#[derive(Default)]
pub(crate) struct GradientEngine {
    requests: Mutex<Vec<FrameRequest>>,
    untaken: Mutex<Option<Arc<Picture>>>,
    newest: Mutex<Option<Arc<Picture>>>,
    seconds: Mutex<Vec<Option<SecondRequest>>>,
    untaken_second: Mutex<Option<Arc<SecondPicture>>>,
    cells: Mutex<Vec<Option<CellsRequest>>>,
    untaken_cells: Mutex<Option<Arc<FoundCells>>>,
    /// The engine that was chosen.
    engine: Mutex<EngineChoice>,
    /// Whether pipelines are said to be made for each picture.
    pub(crate) makes_pipelines: AtomicBool,
    /// Whether pictures are kept back.
    pub(crate) keeps_back: AtomicBool,
}

impl GradientEngine {
    /// The picture of the last request.
    pub(crate) fn newest(&self) -> Arc<Picture> {
        self.newest.lock().expect("no thread died holding it").clone().expect("something was drawn")
    }

    /// Hands out the picture of the last request again, of one grey.
    pub(crate) fn hand_out_grey(&self, byte: u8) {
        let mut picture = (*self.newest()).clone();
        picture.rgba.chunks_exact_mut(4).for_each(|pixel| pixel[..3].fill(byte));
        *self.untaken.lock().expect("no thread died holding it") = Some(Arc::new(picture));
    }

    /// The cells that were asked for, in order; `None` where they were to be forgotten.
    pub(crate) fn cells(&self) -> Vec<Option<CellsRequest>> {
        self.cells.lock().expect("no thread died holding it").clone()
    }

    /// The engine that was chosen last.
    pub(crate) fn engine(&self) -> EngineChoice {
        *self.engine.lock().expect("no thread died holding it")
    }

    /// Hands out cells that nobody has asked for.
    pub(crate) fn hand_out(&self, found: FoundCells) {
        *self.untaken_cells.lock().expect("no thread died holding it") = Some(Arc::new(found));
    }

    /// What was asked for beside the pictures, in order.
    pub(crate) fn seconds(&self) -> Vec<Option<SecondRequest>> {
        self.seconds.lock().expect("no thread died holding it").clone()
    }
}

struct GradientDrawer(Arc<GradientEngine>);

impl Drawer for GradientDrawer {
    fn request(&self, request: FrameRequest) {
        let mut picture = gradient(&request);
        picture.report.made_pipelines = self.0.makes_pipelines.load(Ordering::SeqCst);
        let picture = Arc::new(picture);
        *self.0.untaken.lock().expect("no thread died holding it") = Some(Arc::clone(&picture));
        *self.0.newest.lock().expect("no thread died holding it") = Some(picture);
        self.0.requests.lock().expect("no thread died holding it").push(request);
    }

    fn take_picture(&self) -> Option<Arc<Picture>> {
        let keeps_back = self.0.keeps_back.load(Ordering::SeqCst);
        let mut untaken = self.0.untaken.lock().expect("no thread died holding it");
        if keeps_back { None } else { untaken.take() }
    }

    fn request_second(&self, request: Option<SecondRequest>) {
        let drawn = request.clone().map(|SecondRequest { scene, size, first }| {
            let effort = Effort::Moving { budget_ms: 1.0 };
            let mut picture = gradient(&FrameRequest { scene, size, effort });
            // Darker than the first by an eighth of the bytes' range.
            picture.rgba.iter_mut().for_each(|byte| *byte = byte.saturating_sub(SECOND_DARKER));
            picture.rgba.iter_mut().skip(3).step_by(4).for_each(|alpha| *alpha = 255);
            let picture = Arc::new(picture);
            Arc::new(SecondPicture { picture, first, rmse: Some(0.03), greatest: Some(0.125) })
        });
        *self.0.untaken_second.lock().expect("no thread died holding it") = drawn;
        self.0.seconds.lock().expect("no thread died holding it").push(request);
    }

    fn take_second(&self) -> Option<Arc<SecondPicture>> {
        self.0.untaken_second.lock().expect("no thread died holding it").take()
    }

    fn request_cells(&self, request: Option<CellsRequest>) {
        let found = request.as_ref().map(|request| Arc::new(one_cell(request)));
        *self.0.untaken_cells.lock().expect("no thread died holding it") = found;
        self.0.cells.lock().expect("no thread died holding it").push(request);
    }

    fn take_cells(&self) -> Option<Arc<FoundCells>> {
        self.0.untaken_cells.lock().expect("no thread died holding it").take()
    }

    fn state(&self) -> EngineState {
        EngineState::Idle
    }

    fn adapter_name(&self) -> Option<String> {
        Some("gradients (test)".to_owned())
    }

    fn engine_choice(&self) -> EngineChoice {
        *self.0.engine.lock().expect("no thread died holding it")
    }

    fn choose_engine(&self, engine: EngineChoice) {
        *self.0.engine.lock().expect("no thread died holding it") = engine;
    }
}

/// The whole volume as one cell.
fn one_cell(request: &CellsRequest) -> FoundCells {
    let volume = Arc::clone(request.scene.volume().expect("a field"));
    let cell = Cell {
        low: [0; 3],
        size: volume.lattice.dims.map(|n| n as u32),
        level: 3,
        error: 0.0312,
        extinction: 0.1,
        colour: [u16::MAX, 0, 0],
        why: WhyWhole::ErrorSmallEnough,
    };
    let cells = Cells::from_cells(vec![cell], 1, request.max_error);
    FoundCells { volume, cells, asked_error: request.max_error, is_drawn: false }
}

/// The bytes of the last gradient; most pictures are as large as the one before.
static LAST_GRADIENT: Mutex<([u32; 2], Vec<u8>)> = Mutex::new(([0; 2], Vec::new()));

fn gradient_of(size: [u32; 2]) -> Vec<u8> {
    let mut last = LAST_GRADIENT.lock().expect("no thread died holding it");
    if last.0 != size {
        let [width, height] = size;
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                rgba.extend_from_slice(&[x as u8, y as u8, (x * 7 + y * 13) as u8, 255]);
            }
        }
        *last = (size, rgba);
    }
    last.1.clone()
}

fn gradient(request: &FrameRequest) -> Picture {
    let rgba = gradient_of(request.size);
    let moving = matches!(request.effort, Effort::Moving { .. });
    let converge_ms = match request.effort {
        Effort::Rest { converge_ms, .. } => converge_ms,
        Effort::Moving { .. } => 0.0,
    };
    let can_converge = request.scene.splat.visibility == Visibility::Slabs && converge_ms > 0.0;
    // Whoever insists gets it; nothing else is quick enough.
    let converged = can_converge && converge_ms == f64::INFINITY;
    let refined = can_converge.then_some(Refined {
        convergence: Convergence {
            slabs_per_voxel: if converged { 8.0 } else { request.scene.splat.slabs_per_voxel },
            last_difference: converged.then_some(0.00079),
        },
        left_ms: if converged { 0.0 } else { 12_000.0 },
    });
    let level = match (moving, refined) {
        (true, _) => LevelOfDetail::Octree { max_error: 0.01 },
        (false, Some(refined)) if converged => LevelOfDetail::Refined(refined.convergence),
        (false, _) => LevelOfDetail::FULL,
    };
    let report = FrameReport {
        engine: EngineKind::Gpu,
        not_native: None,
        native_loop: Some("gradients (loop)"),
        level,
        kernels: Some(voxsplat::task::engine::KernelCounts { drawn: 500, active: 500 }),
        vector_splats: (!request.scene.shows_field()).then_some(321),
        own_kernels: None,
        left_out_functions: None,
        left_out_of_quick: None,
        kernels_total: 512,
        backend: voxsplat::scene::Backend::Raster,
        frame_ms: 12.0,
        budget_ms: match request.effort {
            Effort::Moving { budget_ms } => Some(budget_ms),
            Effort::Rest { .. } => None,
        },
        next: moving.then_some(Next { is_full: true, ms: 84.0, rmse: None }),
        progress: if moving { 0.0 } else { 1.0 },
        estimated_rmse: moving.then_some(0.0282),
        remaining_rmse: None,
        remaining_thought: None,
        checked: (!moving).then_some(Checked { estimated_rmse: 0.0282, measured_rmse: 0.0316 }),
        refined,
        smoothed_ms: None,
        effects: match Shading::is_shown_by(&request.scene.splat) {
            true => request.scene.shading.effects(),
            false => Vec::new(),
        },
        held: Some(HeldBytes {
            all: 52_400_000,
            shading: 17_000,
            inside: 0,
            vectors: 0,
            polygons: 0,
        }),
        made_pipelines: false,
        awaits_cut: false,
        remaining_within_db: 3.0,
        octree: None,
    };
    Picture { size: request.size, requested_size: request.size, rgba, report }
}

/// How much darker the second picture is than the first, in bytes.
pub(crate) const SECOND_DARKER: u8 = 32;

/// What the stand-in for measuring was asked.
#[derive(Default)]
pub(crate) struct MeasureLog {
    /// Charts begun.
    pub(crate) started: AtomicUsize,
    /// Steps that a cancelled ticket stopped.
    pub(crate) stopped: AtomicUsize,
    /// Steps taken to their end.
    pub(crate) steps: AtomicUsize,
    /// The third step waits until it is cancelled.
    pub(crate) holds: AtomicBool,
}

impl MeasureLog {
    /// One of the counts.
    pub(crate) fn count(which: &AtomicUsize) -> usize {
        which.load(Ordering::SeqCst)
    }
}

/// The points that the stand-in finds, one a step; the last cannot be drawn.
pub(crate) fn chart_points() -> Vec<ChartPoint> {
    let exact = SplatSettings::EXACT;
    let slabs = |slabs_per_voxel| Some(SplatSettings { slabs_per_voxel, ..exact });
    let sheets = SplatSettings { visibility: Visibility::Sheets, ..SplatSettings::SHADE_FIRST };
    let point = |name: &str, ms, db, settings| ChartPoint {
        name: name.to_owned(),
        ms,
        db,
        ci: 0.3,
        settings,
        on_front: true,
        failed: None,
    };
    vec![
        point("classic", 20.0, 30.0, Some(SplatSettings::SHADE_FIRST)),
        point("exact, half", 100.0, 40.0, slabs(0.5)),
        ChartPoint { on_front: false, ..point("exact at half the size", 150.0, 35.0, None) },
        point("exact", 300.0, 45.0, slabs(1.0)),
        point("exact, double", 900.0, 55.0, slabs(2.0)),
        ChartPoint {
            failed: Some("sheets cannot be drawn".to_owned()),
            on_front: false,
            ..point("sheets", 0.0, 0.0, Some(sheets))
        },
    ]
}

struct OnePointAStep {
    found: usize,
    log: Arc<MeasureLog>,
}

impl Measurer for OnePointAStep {
    fn step(&mut self, ticket: &Ticket) -> Stepped {
        while self.found == 2 && self.log.holds.load(Ordering::SeqCst) {
            if ticket.is_cancelled() {
                self.log.stopped.fetch_add(1, Ordering::SeqCst);
                return Stepped::Stopped;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        self.found += 1;
        self.log.steps.fetch_add(1, Ordering::SeqCst);
        if self.found < chart_points().len() { Stepped::More } else { Stepped::Done }
    }

    fn points(&self) -> Vec<ChartPoint> {
        chart_points()[..self.found].to_vec()
    }

    fn fraction(&self) -> f32 {
        self.found as f32 / chart_points().len() as f32
    }
}

/// Knows a few names; see `read`.
#[derive(Default)]
struct NamedFiles {
    slices: Mutex<Vec<u64>>,
}

impl Library for NamedFiles {
    fn read(&self, source: &Source, ticket: &Ticket) -> Result<ReadGrid, ReadFailure> {
        let name = source.name();
        match name.as_str() {
            "bad.nrrd" => {
                let text = "expected a header, found nonsense: bad.nrrd";
                Err(ReadFailure::Refused(text.to_owned()))
            }
            "panics.nrrd" => std::panic::resume_unwind(Box::new("a bug in a reader")),
            "slow.nrrd" => loop {
                if ticket.checkpoint(1, 3).is_err() {
                    return Err(ReadFailure::Cancelled);
                }
                std::thread::sleep(Duration::from_millis(2));
            },
            "mystery.bin" if matches!(source, Source::File(_)) => {
                let text = "nobody knows this content: mystery.bin";
                Err(ReadFailure::NotRecognised(text.to_owned()))
            }
            "vector.nrrd" => Ok(grid([8; 3], "v", 3)),
            // A folder of scans: the files of each tell nothing of the others.
            "study" => {
                let named = |name: &str, is_open| Series {
                    name: name.to_owned(),
                    path: format!("study/{name}.dcm").into(),
                    slices: 8,
                    is_open,
                };
                let series = vec![named("scout", false), named("thorax", true)];
                Ok(ReadGrid { series, ..grid([8; 3], "thorax", 1) })
            }
            "ring.vtu" => {
                let grid = voxsplat::volume::demo::open("mesh", Some(4)).expect("a demo");
                Ok(ReadGrid::of(grid))
            }
            // The same points, each by itself.
            "points.csv" => {
                let mut grid = voxsplat::volume::demo::open("mesh", Some(4)).expect("a demo");
                if let Shape::Unstructured(cells) = &grid.shape {
                    let points = cells.points().to_vec();
                    let vertices = 0..u32::try_from(points.len()).expect("a few");
                    let listing = Listing {
                        types: vec![1; points.len()],
                        starts: (0..=points.len()).collect(),
                        corners: vertices.collect(),
                        points,
                        ..Listing::default()
                    };
                    let cells = cells::Cells::new(listing).expect("points");
                    grid.shape = Shape::Unstructured(Arc::new(cells));
                }
                Ok(ReadGrid::of(grid))
            }
            // A solid block of points.
            "block.csv" => {
                let at = |i: usize| [i % 9, i / 9 % 9, i / 81].map(|n| n as f64 - 4.0);
                let points = (0..729).map(|i| glam::DVec3::from(at(i))).collect();
                let listing = Listing { points, starts: vec![0], ..Listing::default() };
                let shape =
                    Shape::Unstructured(Arc::new(cells::Cells::new(listing).expect("points")));
                let heat = Field {
                    name: "heat".into(),
                    components: 1,
                    association: Association::Point,
                    samples: Arc::new(Samples::Float32((0..729).map(|i| i as f32).collect())),
                };
                let grid = Grid::shaped([729, 1, 1], shape, vec![heat]).expect("a grid");
                Ok(ReadGrid::of(grid))
            }
            // A block of 5 × 4 × 3 points that leans more the higher it is.
            "bent.vts" => {
                let place = |i: usize| {
                    let [x, y, z] = [i % 5, i / 5 % 4, i / 20].map(|n| n as f64);
                    glam::DVec3::new(x + 0.3 * z * z, y, z)
                };
                let shape = Shape::Curvilinear((0..60).map(place).collect());
                let heat = Field {
                    name: "heat".into(),
                    components: 1,
                    association: Association::Point,
                    samples: Arc::new(Samples::Float32((0..60).map(|i| i as f32).collect())),
                };
                let grid = Grid::shaped([5, 4, 3], shape, vec![heat]).expect("a grid");
                Ok(ReadGrid::of(grid))
            }
            // A square of two triangles, with a number on each corner and one on each triangle.
            "sheet.vtp" => {
                let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
                let listing = Listing {
                    points: corners.map(|[x, y]| glam::DVec3::new(x, y, 0.0)).to_vec(),
                    types: vec![5; 2],
                    starts: vec![0, 3, 6],
                    corners: vec![0, 1, 2, 0, 2, 3],
                    ..Listing::default()
                };
                let cells = cells::Cells::new(listing).expect("triangles");
                let field = |name: &str, association, values: Vec<f32>| Field {
                    name: name.into(),
                    components: 1,
                    association,
                    samples: Arc::new(Samples::Float32(values)),
                };
                let fields = vec![
                    field("heat", Association::Point, vec![0.0, 1.0, 3.0, 2.0]),
                    field("load", Association::Cell, vec![10.0, 20.0]),
                ];
                let shape = Shape::Unstructured(Arc::new(cells));
                let grid = Grid::shaped([4, 1, 1], shape, fields).expect("a grid");
                Ok(ReadGrid::of(grid))
            }
            // What there is much to know of.
            "noted.nrrd" => {
                let warnings = ["first", "second", "third", "fourth"];
                let warnings = warnings.map(|which| format!("the {which} thing to know")).to_vec();
                Ok(ReadGrid { warnings, ..grid([8; 3], "noted", 1) })
            }
            // What no few functions are: a fit of it goes on until it is told to end.
            "rough.nrrd" => {
                let mut rough = grid([24; 3], "rough", 1);
                let value = |i: u32| {
                    let mixed = i.wrapping_add(17).wrapping_mul(0x9e37_79b1);
                    let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca77);
                    (mixed >> 16) as u16
                };
                let samples = Samples::UInt16((0..24_u32.pow(3)).map(value).collect());
                rough.grid.fields[0].samples = Arc::new(samples);
                Ok(rough)
            }
            // Labels, one of which has a name.
            "names.nrrd" => {
                let mut names = grid([8; 3], "names", 1);
                let samples = Samples::UInt8((0..512).map(|i| [0, 0, 1, 3][i % 4]).collect());
                names.grid.fields[0].samples = Arc::new(samples);
                let name = "heart".to_owned();
                names.grid.label_names =
                    vec![LabelName { component: 0, value: 1, name, colour: None }];
                Ok(names)
            }
            // What a first look lights.
            "faces.nrrd" => Ok(grid([8; 3], "faces", 1)),
            "demo:tornado" => {
                let mut tornado = grid([8; 3], "condensation", 1);
                tornado.grid.fields.extend(grid([8; 3], "velocity", 3).grid.fields);
                Ok(tornado)
            }
            // Scalars that vectors could be put together of, and vectors beside them.
            "triples.nrrd" => {
                let mut found = grid([8; 3], "u", 1);
                for (name, components) in [("v", 1), ("w", 1), ("wind", 3), ("field", 3)] {
                    found.grid.fields.extend(grid([8; 3], name, components).grid.fields);
                }
                Ok(found)
            }
            "holed.nrrd" => {
                let mut holed = grid([8; 3], "holed", 1);
                let value = |i: u16| if i.is_multiple_of(5) { f32::NAN } else { f32::from(i) };
                let samples = Samples::Float32((0..512).map(value).collect());
                holed.grid.fields[0].samples = Arc::new(samples);
                Ok(holed)
            }
            _ => match source {
                Source::Raw(_, layout) => Ok(grid(layout.dims.map(|n| n as usize), "raw", 1)),
                _ => Ok(grid([8; 3], "ramp", 1)),
            },
        }
    }

    fn guess_raw(&self, _path: &Path) -> RawLayout {
        RawLayout { dims: [4; 3], scalar_type: ScalarType::UInt8, ..RawLayout::default() }
    }

    fn file_bytes(&self, _path: &Path) -> Result<u64, String> {
        Ok(RAW_BYTES)
    }

    fn raw_slice(&self, _path: &Path, layout: &RawLayout, z: u64) -> Result<Slice, String> {
        self.slices.lock().expect("no thread died holding it").push(z);
        let size = [layout.dims[0] as usize, layout.dims[1] as usize];
        Ok(Slice { size, grey: vec![128; size[0] * size[1]] })
    }

    fn demos(&self) -> Vec<(&'static str, &'static str)> {
        vec![("shells", "Nested shells")]
    }

    fn first_look(&self, volume: &ScalarVolume, space: Option<&str>) -> FirstLook {
        let transfer = match &*volume.name {
            "names" => presets::default_for(&volume.statistics),
            _ => default_transfer(&volume.statistics),
        };
        let orientation = Orientation::of(space);
        let view = orientation.first_view();
        let lighting = (volume.name == "faces").then(Lighting::first_look);
        let splat = SplatSettings::of_cells_or_points(volume).unwrap_or(SplatSettings::EXACT);
        FirstLook { transfer, lighting, splat, orientation, view }
    }
}

/// A transfer function that looks right at once.
fn default_transfer(statistics: &Statistics) -> TransferFunction {
    let (low, high) = (statistics.min, statistics.value_at(0.5));
    TransferFunction::of(
        vec![(low, 0.0), (high, 0.8)],
        ColourSource::Map { map: ColourMap::ALL[0], range: [low, high] },
    )
}

fn grid(dims: [usize; 3], name: &str, components: usize) -> ReadGrid {
    let count = dims.iter().product::<usize>() * components;
    let field = Field {
        name: name.to_owned(),
        components,
        association: Association::Point,
        samples: Arc::new(Samples::UInt16((0..count).map(|i| i as u16).collect())),
    };
    let grid = Grid::of(Lattice::unit(dims), vec![field]);
    ReadGrid::of(grid)
}

/// Settings in memory.
#[derive(Default)]
pub(crate) struct Storage {
    entries: HashMap<String, String>,
}

impl Storage {
    /// Everything that was stored.
    pub(crate) fn text(&self) -> String {
        self.entries.values().cloned().collect()
    }
}

impl eframe::Storage for Storage {
    fn get_string(&self, key: &str) -> Option<String> {
        self.entries.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        self.entries.insert(key.to_owned(), value);
    }

    fn remove_string(&mut self, key: &str) {
        self.entries.remove(key);
    }

    fn flush(&mut self) {}
}

/// A window with everything around it, and a hand.
pub(crate) struct Bench {
    /// The window in egui's test harness.
    pub(crate) harness: Harness<'static, Window>,
    /// Who draws.
    pub(crate) engine: Arc<GradientEngine>,
    /// Where screenshots go.
    pub(crate) pictures: tempfile::TempDir,
    /// What was measured.
    pub(crate) measured: Arc<MeasureLog>,
    /// Bytes that volumes of earlier steps may take.
    pub(crate) bytes_for_steps: Arc<AtomicU64>,
    library: Arc<NamedFiles>,
    saved: Arc<Mutex<Vec<SaveRequest>>>,
    /// Whether pictures that are saved stay at a quarter of the way.
    pub(crate) saves_slowly: Arc<AtomicBool>,
}

/// Who paints the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Painter {
    /// A software adapter.
    Adapter,
    /// The processor itself, as where there is no graphics processor.
    Processor,
}

impl Painter {
    pub(crate) const BOTH: [Self; 2] = [Self::Adapter, Self::Processor];
}

/// The window's canvas, in place of an adapter.
#[derive(Default)]
struct OnCanvas {
    canvas: Canvas,
    /// To be freed after the next frame.
    freed: Vec<TextureId>,
}

impl egui_kittest::TestRenderer for OnCanvas {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        self.canvas.set_textures(delta);
        self.freed.extend(delta.free.drain());
    }

    fn render(&mut self, ctx: &Context, output: &FullOutput) -> Result<image::RgbaImage, String> {
        let scale = output.pixels_per_point;
        let size = (ctx.content_rect().size() * scale).round();
        let primitives = ctx.tessellate(output.shapes.clone(), scale);
        let background = voxsplat::app::theme::PANEL;
        let size = [size.x as usize, size.y as usize];
        self.canvas.paint(size, scale, background, &primitives);
        self.canvas.free_textures(std::mem::take(&mut self.freed));
        let bytes = self.canvas.pixels().iter().flat_map(|pixel| {
            let [b, g, r, _] = pixel.to_le_bytes();
            [r, g, b, 255]
        });
        image::RgbaImage::from_raw(size[0] as u32, size[1] as u32, bytes.collect())
            .ok_or_else(|| "a canvas that is not full".to_owned())
    }
}

impl Bench {
    /// Nothing open.
    pub(crate) fn empty() -> Self {
        Self::new(Some("chosen.nrrd".into()), None)
    }

    /// Nothing open, and no desktop that would show a file dialog.
    pub(crate) fn without_file_dialog() -> Self {
        Self::new(None, None)
    }

    /// `good.nrrd` is open and at rest.
    pub(crate) fn opened() -> Self {
        let mut bench = Self::empty();
        bench.open("good.nrrd");
        bench.settle();
        // `run_steps` does not look, as `run` does, whether every widget has a name.
        bench.harness.check_accessibility();
        bench
    }

    /// A file of which the vectors were chosen.
    pub(crate) fn with_wind() -> Self {
        let mut bench = Self::empty();
        bench.open("triples.nrrd");
        bench.settle();
        bench.choose("Vectors", "wind");
        bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
        bench.settle();
        bench
    }

    /// The same, painted at `pixels_per_point`.
    pub(crate) fn rendered(pixels_per_point: f32, by: Painter) -> Self {
        let mut bench = Self::new(Some("chosen.nrrd".into()), Some((pixels_per_point, by)));
        bench.open("good.nrrd");
        bench.settle();
        bench
    }

    /// Nothing open, with habits of an earlier window.
    pub(crate) fn with_settings(settings: Settings) -> Self {
        Self::made(Some("chosen.nrrd".into()), None, settings)
    }

    fn new(chosen: Option<PathBuf>, painted: Option<(f32, Painter)>) -> Self {
        // What is closed at first is opened for the hand.
        let sections =
            ["Polygons and labels", "Splats"].map(|title| (title.to_owned(), true)).into();
        // Pictures of the window are compared with the engine's own: nothing is said over them.
        let knows_drag = painted.is_some();
        Self::made(chosen, painted, Settings { sections, knows_drag, ..Settings::default() })
    }

    fn made(chosen: Option<PathBuf>, painted: Option<(f32, Painter)>, settings: Settings) -> Self {
        let engine = Arc::new(GradientEngine::default());
        let library = Arc::new(NamedFiles::default());
        let pictures = tempfile::tempdir().expect("a temporary folder");
        let saved = Arc::new(Mutex::new(Vec::new()));
        let (drawer, files) = (GradientDrawer(Arc::clone(&engine)), Arc::clone(&library));
        let measured = Arc::new(MeasureLog::default());
        let begun = Arc::clone(&measured);
        let bytes_for_steps = Arc::new(AtomicU64::new(u64::MAX));
        let steps = Arc::clone(&bytes_for_steps);
        let (folder, log) = (pictures.path().to_owned(), Arc::clone(&saved));
        let saves_slowly = Arc::new(AtomicBool::new(false));
        let is_slow = Arc::clone(&saves_slowly);
        let mut builder =
            Harness::builder().with_size(vec2(1280.0, 2090.0)).with_step_dt(STEP_SECS);
        if let Some((pixels_per_point, by)) = painted {
            builder = builder.with_size(vec2(800.0, 600.0)).with_pixels_per_point(pixels_per_point);
            builder = match by {
                Painter::Adapter => builder.wgpu(),
                Painter::Processor => builder.renderer(OnCanvas::default()),
            };
        }
        let by_processor = painted.is_some_and(|(_, by)| by == Painter::Processor);
        let harness = builder.build_eframe(move |creation| {
            let ctx = &creation.egui_ctx;
            let parts = Parts {
                drawer: Box::new(drawer),
                news: Arc::new(News::new(ctx)),
                wait_for_picture: Duration::ZERO,
                screen_format: (!by_processor).then_some(wgpu::TextureFormat::Rgba8Unorm),
                library: files,
                renderer: Arc::new(move |request, ticket| {
                    log.lock().expect("no thread died holding it").push(request.clone());
                    while is_slow.load(Ordering::SeqCst) && ticket.checkpoint(1, 4).is_ok() {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    Ok(())
                }),
                measure: Arc::new(move |_, _| {
                    begun.started.fetch_add(1, Ordering::SeqCst);
                    Box::new(OnePointAStep { found: 0, log: Arc::clone(&begun) })
                }),
                bytes_for_steps: Box::new(move || steps.load(Ordering::SeqCst)),
                chooser: Box::new(move |ctx| FileDialog::answering(ctx, chosen.clone())),
                pictures_folder: Ok(folder.clone()),
            };
            Window::new(ctx, parts, settings)
        });
        Self { harness, engine, pictures, measured, bytes_for_steps, library, saved, saves_slowly }
    }

    /// The window itself.
    pub(crate) fn window(&self) -> &Window {
        self.harness.state()
    }

    /// The camera of the scene.
    pub(crate) fn camera(&self) -> Camera {
        self.window().scene().expect("something is open").camera
    }

    /// Where the viewport is.
    pub(crate) fn viewport(&self) -> Rect {
        self.harness.get_by_label("Viewport").rect()
    }

    /// Whether a text is on screen.
    pub(crate) fn shows(&self, label: &str) -> bool {
        self.harness.query_all_by_label(label).next().is_some()
    }

    /// Requests posted so far.
    pub(crate) fn request_count(&self) -> usize {
        self.engine.requests.lock().expect("no thread died holding it").len()
    }

    /// Requests posted after the first `count`.
    pub(crate) fn requests_since(&self, count: usize) -> Vec<FrameRequest> {
        self.engine.requests.lock().expect("no thread died holding it")[count..].to_vec()
    }

    /// The newest request.
    pub(crate) fn last_request(&self) -> FrameRequest {
        self.engine
            .requests
            .lock()
            .expect("no thread died holding it")
            .last()
            .cloned()
            .expect("something was asked for")
    }

    /// Slices read for the raw preview so far.
    pub(crate) fn slices(&self) -> Vec<u64> {
        self.library.slices.lock().expect("no thread died holding it").clone()
    }

    /// The picture that was saved last.
    pub(crate) fn saved(&self) -> SaveRequest {
        self.saved
            .lock()
            .expect("no thread died holding it")
            .last()
            .cloned()
            .expect("something was saved")
    }

    /// Passes until nothing is left to be done.
    pub(crate) fn settle(&mut self) {
        self.harness.remove_cursor();
        self.harness.run_steps(STEPS_TO_REST);
    }

    /// Starts to open a file.
    pub(crate) fn start_opening(&mut self, name: &str) {
        let ctx = self.harness.ctx.clone();
        self.harness.state_mut().open(&ctx, Source::File(name.into()));
    }

    /// Opens a file and waits for its end, good or bad.
    pub(crate) fn open(&mut self, name: &str) {
        self.start_opening(name);
        self.wait_until(|window| !window.is_loading());
        self.harness.run_steps(3);
        self.harness.check_accessibility();
    }

    /// Passes until something is so.
    pub(crate) fn wait_until(&mut self, so: impl Fn(&Window) -> bool) {
        let deadline = Instant::now() + Duration::from_secs(20);
        while !so(self.window()) {
            assert!(Instant::now() < deadline, "waited in vain");
            std::thread::sleep(Duration::from_millis(2));
            self.harness.step();
        }
    }

    /// Steps until a text is on screen no longer.
    pub(crate) fn wait_until_gone(&mut self, label: &str) {
        let deadline = Instant::now() + Duration::from_secs(20);
        while self.shows(label) {
            assert!(Instant::now() < deadline, "{label} stays");
            std::thread::sleep(Duration::from_millis(2));
            self.harness.step();
        }
    }

    /// Whether the pass in which a key goes down sends a command to the desktop.
    pub(crate) fn press_sends(
        &mut self,
        shortcut: KeyboardShortcut,
        command: &ViewportCommand,
    ) -> bool {
        self.harness.input_mut().events.push(Event::Key {
            key: shortcut.logical_key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: shortcut.modifiers,
        });
        self.harness.step();
        let output = &self.harness.output().viewport_output[&ViewportId::ROOT];
        output.commands.contains(command)
    }

    /// Moves the pointer.
    pub(crate) fn hover(&mut self, at: Pos2) {
        self.harness.hover_at(at);
        self.harness.run_steps(2);
    }

    /// Turns the wheel up by some notches.
    pub(crate) fn wheel(&mut self, notches: f32) {
        self.harness.event(Event::MouseWheel {
            unit: MouseWheelUnit::Line,
            delta: vec2(0.0, notches),
            phase: TouchPhase::Move,
            source: MouseWheelSource::Unknown,
            modifiers: Modifiers::NONE,
        });
        self.harness.step();
    }

    /// Drags from the middle of the viewport; the button is up again, the delay of rest not over.
    pub(crate) fn drag(&mut self, button: PointerButton, modifiers: Modifiers, by: Vec2) {
        self.drag_from(self.viewport().center(), button, modifiers, by);
    }

    /// Drags from anywhere, in two moves.
    pub(crate) fn drag_from(
        &mut self,
        at: Pos2,
        button: PointerButton,
        modifiers: Modifiers,
        by: Vec2,
    ) {
        self.hover(at);
        let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers };
        self.harness.event(Event::ModifiersChanged(modifiers));
        self.harness.event(press(at, true));
        self.harness.event(Event::PointerMoved(at + by / 2.0));
        self.harness.event(Event::PointerMoved(at + by));
        self.harness.step();
        self.harness.event(press(at + by, false));
        self.harness.event(Event::ModifiersChanged(Modifiers::NONE));
        self.harness.step();
    }

    /// Clicks once.
    pub(crate) fn click(&mut self, at: Pos2, button: PointerButton) {
        self.hover(at);
        self.press_and_release(at, button);
        self.harness.run_steps(2);
    }

    /// Clicks twice.
    pub(crate) fn double_click(&mut self, at: Pos2) {
        self.hover(at);
        self.press_and_release(at, PointerButton::Primary);
        self.press_and_release(at, PointerButton::Primary);
        self.harness.step();
    }

    fn press_and_release(&mut self, pos: Pos2, button: PointerButton) {
        for pressed in [true, false] {
            let modifiers = Modifiers::NONE;
            self.harness.event(Event::PointerButton { pos, button, pressed, modifiers });
        }
    }

    /// Gives a slider or a number its value.
    pub(crate) fn set_slider(&mut self, label: &str, value: f64) {
        let node = self
            .harness
            .get_all_by_label(label)
            .find(|node| node.accesskit_node().numeric_value().is_some())
            .unwrap_or_else(|| panic!("no number is called {label}"));
        node.set_value_accesskit(value);
        self.harness.run_steps(STEPS_TO_REST);
    }

    /// Opens what the status line keeps for a click; one that was open stays so.
    pub(crate) fn open_details(&mut self) {
        if !self.tells("Engine") {
            let is_line = |label: Option<String>| label.is_some_and(|text| text.contains(" · "));
            let role = eframe::egui::accesskit::Role::Button;
            self.harness
                .get_all_by_role(role)
                .find(|node| is_line(node.accesskit_node().label()))
                .expect("the line can be clicked")
                .click();
            self.harness.run_steps(2);
        }
    }

    /// Whether some words are on screen, within others or not.
    pub(crate) fn tells(&self, part: &str) -> bool {
        self.harness.query_all_by_label_contains(part).next().is_some()
    }

    /// Opens a list and chooses an entry.
    pub(crate) fn choose(&mut self, list: &str, entry: &str) {
        self.harness.get_by_role_and_label(eframe::egui::accesskit::Role::ComboBox, list).click();
        self.harness.run_steps(3);
        // Of things with one name, the list on top comes last.
        self.harness.get_all_by_label(entry).last().expect("in the list").click();
        self.harness.run_steps(STEPS_TO_REST);
    }

    /// Opens what is folded away under a title.
    pub(crate) fn unfold(&mut self, title: &str) {
        self.harness.get_by_label(title).scroll_to_me();
        self.harness.run_steps(STEPS_TO_REST);
        self.harness.get_by_label(title).click();
        self.harness.run_steps(STEPS_TO_REST);
    }

    /// Lets a file fall on the window.
    pub(crate) fn drop_file(&mut self, name: &str) {
        self.harness.input_mut().dropped_files.push(Arc::new(Dropped(name.into())));
        self.harness.run_steps(2);
    }
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("the stand-in readers need no bytes".to_owned())
    }
}
