//! Every row drawn once, one after the other, by the native engine where that draws it, and on one device where there is one.

use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, GpuError, Renderer, Wishes};
use voxsplat::hierarchy::Cut;
use voxsplat::plan::{FieldCut, Plan};
use voxsplat::scene::Scene;
use voxsplat::task::draw::{DrawError, Drawer, Rung};
use voxsplat::task::engines::{Canvas as _, EngineChoice, EngineKind, Engines};

use crate::rows::{Judged, Row, rows};
use crate::scenes;

/// What was drawn.
pub(crate) struct Picture {
    pub(crate) size: [u32; 2],
    /// Linear premultiplied RGBA.
    pub(crate) light: Vec<[f32; 4]>,
    /// The sRGB bytes that are shown.
    pub(crate) shown: Vec<u8>,
    /// What it was drawn from, where that was a cut.
    pub(crate) cut: Option<Cut>,
    /// The same where it was one of the field.
    pub(crate) bricks: Option<Arc<FieldCut>>,
}

/// Both engines, in the order in which they are judged.
pub(crate) const ENGINES: [EngineKind; 2] = [EngineKind::Gpu, EngineKind::Native];

/// A row, and what became of it by each engine: a picture, or why there is none.
pub(crate) struct Drawn {
    pub(crate) row: Row,
    pub(crate) scene: Scene,
    /// `None` where there is no adapter.
    gpu: Option<Result<Picture, String>>,
    /// `None` of rows that it does not draw.
    native: Option<Result<Picture, String>>,
}

impl Drawn {
    /// By an engine, where that was to draw it.
    pub(crate) fn by(&self, engine: EngineKind) -> Option<&Result<Picture, String>> {
        match engine {
            EngineKind::Gpu => self.gpu.as_ref(),
            EngineKind::Native => self.native.as_ref(),
        }
    }
}

/// All of the table.
pub(crate) struct Table {
    /// The adapter, if there is one.
    pub(crate) adapter: Option<String>,
    pub(crate) rows: Vec<Drawn>,
    drawers: Mutex<Drawers>,
}

struct Drawers {
    native: Drawer,
    gpu: Option<Drawer>,
}

impl Table {
    /// Draws a row once more; `None` where there is no such engine.
    pub(crate) fn draw(
        &self,
        engine: EngineKind,
        row: &Row,
        scene: &Scene,
    ) -> Option<Result<Picture, String>> {
        let mut drawers = self.drawers.lock().unwrap_or_else(PoisonError::into_inner);
        match engine {
            EngineKind::Gpu => Some(draw(drawers.gpu.as_mut()?, row, scene)),
            EngineKind::Native => Some(draw(&mut drawers.native, row, scene)),
        }
    }
}

/// The native engine, and no adapter.
fn native() -> Drawer {
    let engines = Engines::new(EngineChoice::Native.into(), Wishes::default());
    Drawer::with(engines.expect("a processor"))
}

/// Whether the native engine draws a row by itself.
fn is_native(drawer: &Drawer, row: &Row, scene: &Scene) -> bool {
    let engine = || drawer.engine_of(&Plan::of(scene, row.size), row.rung);
    scenes::refusal(scene).is_none() && engine() == EngineKind::Native
}

/// The table, drawn by whoever asks first; by the native engine alone where there is no device and that is allowed.
pub(crate) fn table() -> &'static Table {
    static TABLE: LazyLock<Table> = LazyLock::new(|| {
        let context = context();
        let adapter = context.as_ref().map(|context| context.adapter_name.clone());
        let mut gpu = context.map(|context| Drawer::new(Renderer::new(context)));
        let mut native = native();
        native.keeps_cut = true;
        if let Some(gpu) = &mut gpu {
            gpu.keeps_cut = true;
        }
        let drawn = |row: Row| {
            let scene = row.scene();
            let by_gpu = gpu.as_mut().map(|gpu| draw(gpu, &row, &scene));
            let natively =
                is_native(&native, &row, &scene).then(|| draw(&mut native, &row, &scene));
            Drawn { row, scene, gpu: by_gpu, native: natively }
        };
        let rows: Vec<Drawn> = rows().into_iter().map(drawn).collect();
        if gpu.is_none() {
            let is_to_be = |drawn: &&Drawn| drawn.row.judged != Judged::Refused;
            let left: Vec<&Drawn> = rows.iter().filter(is_to_be).collect();
            let alone = left.iter().filter(|drawn| drawn.native.is_none()).count();
            println!(
                "skipped {} rows by the GPU engine, {alone} of which no other draws",
                left.len()
            );
        }
        Table { adapter, rows, drawers: Mutex::new(Drawers { native, gpu }) }
    });
    &TABLE
}

/// The software adapter where there is one: it is the same everywhere, and floors were measured on it.
pub(crate) fn context() -> Option<Context> {
    let found = match Context::new(&AdapterChoice::Software, Wishes::default()) {
        Err(GpuError::NoAdapter { .. }) => Context::new(&AdapterChoice::Auto, Wishes::default()),
        found => found,
    };
    match found {
        Ok(context) => Some(context),
        Err(error) if std::env::var("VOXSPLAT_GPU").is_ok_and(|v| v == "allow-skip") => {
            println!("skipped the GPU engine: {error}");
            None
        }
        Err(error) => panic!("{error} (or set VOXSPLAT_GPU=allow-skip)"),
    }
}

/// Draws a row.
pub(crate) fn draw(drawer: &mut Drawer, row: &Row, scene: &Scene) -> Result<Picture, String> {
    if let Some(refusal) = scenes::refusal(scene) {
        return Err(refusal);
    }
    let mut picture = || -> Result<Picture, DrawError> {
        let plan = Plan::of(scene, row.size);
        drawer.prepare(&plan, &Ticket::new())?;
        let bricks = match row.rung {
            Rung::Bricks { max_error } => drawer.find_cut(&plan, max_error)?,
            _ => None,
        };
        let drawn = drawer.draw(&plan, row.rung, &mut ())?;
        Ok(Picture {
            size: drawn.size,
            light: drawer.engines.read_light()?,
            shown: drawer.engines.present(scenes::background(scene))?,
            cut: drawer.take_cut().map(|(cut, _)| cut),
            bricks,
        })
    };
    picture().map_err(|error| error.to_string())
}
