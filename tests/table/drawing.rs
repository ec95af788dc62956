//! Every row drawn once, one after the other, on one device; and by the native engine, where that draws it.

use std::sync::{LazyLock, Mutex, PoisonError};

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, GpuError, Renderer, Wishes};
use voxsplat::hierarchy::Cut;
use voxsplat::plan::Plan;
use voxsplat::scene::Scene;
use voxsplat::task::draw::{DrawError, Drawer};
use voxsplat::task::engines::{Canvas as _, EngineChoice, EngineKind, Engines};

use crate::rows::{Row, rows};
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
}

/// A row, and what became of it: a picture, or why there is none.
pub(crate) struct Drawn {
    pub(crate) row: Row,
    pub(crate) scene: Scene,
    pub(crate) outcome: Result<Picture, String>,
    /// The same by the native engine, of rows that it supports.
    pub(crate) native: Option<Result<Picture, String>>,
}

/// All of the table on one device.
pub(crate) struct Table {
    pub(crate) adapter: String,
    pub(crate) rows: Vec<Drawn>,
    drawers: Mutex<[Drawer; 2]>,
}

impl Table {
    /// Draws a row once more.
    pub(crate) fn draw(
        &self,
        engine: EngineKind,
        row: &Row,
        scene: &Scene,
    ) -> Result<Picture, String> {
        let mut drawers = self.drawers.lock().unwrap_or_else(PoisonError::into_inner);
        draw(&mut drawers[engine as usize], row, scene)
    }
}

/// The native engine, and no adapter.
pub(crate) fn native() -> Drawer {
    let engines = Engines::new(EngineChoice::Native.into(), Wishes::default());
    Drawer::with(engines.expect("a processor"))
}

/// Whether the native engine draws a row by itself.
pub(crate) fn is_native(drawer: &Drawer, row: &Row, scene: &Scene) -> bool {
    let engine = || drawer.engine_of(&Plan::of(scene, row.size), row.rung);
    scenes::refusal(scene).is_none() && engine() == EngineKind::Native
}

/// The table, drawn by whoever asks first; `None` where there is no device and that is allowed.
pub(crate) fn table() -> Option<&'static Table> {
    static TABLE: LazyLock<Option<Table>> = LazyLock::new(|| {
        let context = context()?;
        let adapter = context.adapter_name.clone();
        let mut drawer = Drawer::new(Renderer::new(context));
        drawer.keeps_cut = true;
        let mut native = native();
        native.keeps_cut = true;
        let drawn = |row: Row| {
            let scene = row.scene();
            let outcome = draw(&mut drawer, &row, &scene);
            let natively =
                is_native(&native, &row, &scene).then(|| draw(&mut native, &row, &scene));
            Drawn { row, scene, outcome, native: natively }
        };
        let rows = rows().into_iter().map(drawn).collect();
        Some(Table { adapter, rows, drawers: Mutex::new([native, drawer]) })
    });
    TABLE.as_ref()
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
            println!("skipped the table: {error}");
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
        let drawn = drawer.draw(&plan, row.rung, &mut ())?;
        Ok(Picture {
            size: drawn.size,
            light: drawer.engines.read_light()?,
            shown: drawer.engines.present(scenes::background(scene))?,
            cut: drawer.take_cut().map(|(cut, _)| cut),
        })
    };
    picture().map_err(|error| error.to_string())
}
