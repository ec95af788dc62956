//! What draws the scenes that are hard to draw here: the native engine, and no adapter.

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Wishes};
use voxsplat::plan::Plan;
use voxsplat::scene::Scene;
use voxsplat::task::draw::{Drawer, Drawn, Rung};
use voxsplat::task::engines::{Choice, EngineChoice, EngineKind, Engines};

use crate::hard_scenes::scenes::{Light, wide};

/// What is drawn sample by sample is gathered by rays.
pub(crate) const DRAWS_TRIANGLES: bool = false;

/// One of a test's own. It is there on every machine.
pub(crate) fn drawer() -> Option<Drawer> {
    let adapter = AdapterChoice::Named("no such adapter".to_owned());
    let choice = Choice { engine: EngineChoice::Native, adapter };
    let engines = Engines::new(choice, Wishes::default());
    Some(Drawer::with(engines.expect("no device is asked for")))
}

/// The picture of a rung.
pub(crate) fn drawn(
    drawer: &mut Drawer,
    scene: &Scene,
    size: [u32; 2],
    rung: Rung,
) -> (Light, Drawn) {
    let plan = Plan::of(scene, size);
    drawer.prepare(&plan, &Ticket::new()).expect("it prepares");
    let drawn = drawer.draw(&plan, rung, &mut ()).expect("it draws");
    assert_eq!(drawer.engines.drew(), EngineKind::Native);
    (wide(&drawer.engines.native.light().0), drawn)
}

/// The finished picture: none is refused.
pub(crate) fn drawn_or_refused(
    drawer: &mut Drawer,
    scene: &Scene,
    size: [u32; 2],
) -> (Light, EngineKind) {
    (drawn(drawer, scene, size, Rung::Full).0, EngineKind::Native)
}
