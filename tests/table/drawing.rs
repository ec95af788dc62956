//! Every row drawn once, one after the other, on one device.

use std::sync::{LazyLock, Mutex, PoisonError};

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, GpuError, Renderer, Wishes};
use voxsplat::hierarchy::Cut;
use voxsplat::plan::Plan;
use voxsplat::scene::Scene;
use voxsplat::task::draw::{DrawError, Drawer};

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
}

/// All of the table on one device.
pub(crate) struct Table {
    pub(crate) adapter: String,
    pub(crate) rows: Vec<Drawn>,
    drawer: Mutex<Drawer>,
}

impl Table {
    /// Draws a row once more.
    pub(crate) fn draw(&self, row: &Row, scene: &Scene) -> Result<Picture, String> {
        let mut drawer = self.drawer.lock().unwrap_or_else(PoisonError::into_inner);
        draw(&mut drawer, row, scene)
    }
}

/// The table, drawn by whoever asks first; `None` where there is no device and that is allowed.
pub(crate) fn table() -> Option<&'static Table> {
    static TABLE: LazyLock<Option<Table>> = LazyLock::new(|| {
        let context = context()?;
        let adapter = context.adapter_name.clone();
        let mut drawer = Drawer::new(Renderer::new(context));
        drawer.keeps_cut = true;
        let drawn = |row: Row| {
            let scene = row.scene();
            let outcome = draw(&mut drawer, &row, &scene);
            Drawn { row, scene, outcome }
        };
        let rows = rows().into_iter().map(drawn).collect();
        Some(Table { adapter, rows, drawer: Mutex::new(drawer) })
    });
    TABLE.as_ref()
}

/// The software adapter where there is one: it is the same everywhere, and floors were measured on it.
fn context() -> Option<Context> {
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

fn draw(drawer: &mut Drawer, row: &Row, scene: &Scene) -> Result<Picture, String> {
    if let Some(refusal) = scenes::refusal(scene) {
        return Err(refusal);
    }
    let mut picture = || -> Result<Picture, DrawError> {
        let plan = Plan::of(scene, row.size);
        drawer.prepare(&plan, &Ticket::new())?;
        let drawn = drawer.draw(&plan, row.rung, &mut ())?;
        Ok(Picture {
            size: drawn.size,
            light: drawer.engines.gpu().expect("a device").read_light()?,
            shown: drawer.engines.gpu().expect("a device").present(scenes::background(scene))?,
            cut: drawer.take_cut().map(|(cut, _)| cut),
        })
    };
    picture().map_err(|error| error.to_string())
}
