//! One device for all tests, and what they make scenes of and judge pictures by.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, GpuError, OctreeBuilder, Renderer, Wishes};
use voxsplat::plan::Plan;
use voxsplat::reference::Rays;
use voxsplat::scene::{Look, PolygonLayer, Scene, VectorLayer};
use voxsplat::task::draw::{Drawer, Drawn, Rung};
use voxsplat::task::engines::{EngineChoice, EngineKind, Engines};
use voxsplat::volume::ScalarVolume;

pub(crate) use crate::hard_scenes::scenes::*;

/// Whether what is drawn sample by sample is drawn as triangles, unless a mode asks for tiles.
pub(crate) const DRAWS_TRIANGLES: bool = true;

/// The software adapter where there is one: it is the same everywhere, and tolerances were measured on it.
pub(crate) fn adapter() -> AdapterChoice {
    static FOUND: LazyLock<AdapterChoice> =
        LazyLock::new(|| match Context::new(&AdapterChoice::Software, Wishes::default()) {
            Err(GpuError::NoAdapter { .. }) => AdapterChoice::Auto,
            _ => AdapterChoice::Software,
        });
    FOUND.clone()
}

/// What is wished for where octrees are to be the host's on every adapter.
pub(crate) const ON_HOST: Wishes = Wishes {
    float32_blending: true,
    timestamps: true,
    octrees: Some(OctreeBuilder::Host),
    most_binding_bytes: None,
};

/// A device of our own, or `None` where there is none and that is allowed.
pub(crate) fn context(wishes: Wishes) -> Option<Context> {
    match Context::new(&adapter(), wishes) {
        Ok(context) => Some(context),
        Err(error) if std::env::var("VOXSPLAT_GPU").is_ok_and(|v| v == "allow-skip") => {
            let test = std::thread::current().name().unwrap_or("a test").to_owned();
            println!("skipped {test}: {error}");
            None
        }
        Err(error) => panic!("{error} (or set VOXSPLAT_GPU=allow-skip)"),
    }
}

/// The device that tests share, locked.
pub(crate) struct Shared(MutexGuard<'static, Option<Drawer>>);

impl Deref for Shared {
    type Target = Drawer;

    fn deref(&self) -> &Drawer {
        self.0.as_ref().expect("made before it is handed out")
    }
}

impl DerefMut for Shared {
    fn deref_mut(&mut self) -> &mut Drawer {
        self.0.as_mut().expect("made before it is handed out")
    }
}

/// The one device that tests share, for as long as the guard lives.
pub(crate) fn drawer() -> Option<Shared> {
    static SHARED: Mutex<Option<Drawer>> = Mutex::new(None);
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if shared.is_none() {
        *shared = context(Wishes::default()).map(|c| Drawer::new(Renderer::new(c)));
    }
    shared.is_some().then_some(Shared(shared))
}

/// A scene's field of values.
pub(crate) fn volume_of(scene: &Scene) -> &Arc<ScalarVolume> {
    scene.volume().expect("a field")
}

/// With these vectors and no others, beside the field or not as it is.
pub(crate) fn with_vectors(
    mut scene: Scene,
    layers: impl IntoIterator<Item = VectorLayer>,
) -> Scene {
    scene.keep(|layer| !matches!(layer.look, Look::Vectors(_)));
    layers.into_iter().fold(scene, Scene::with)
}

/// With its vectors beside its field.
pub(crate) fn beside_field(mut scene: Scene) -> Scene {
    scene.show_field(true);
    scene
}

/// With its vectors and without its field.
pub(crate) fn without_field(mut scene: Scene) -> Scene {
    scene.show_field(false);
    scene
}

/// With these polygons and no others.
pub(crate) fn with_polygons(
    mut scene: Scene,
    layers: impl IntoIterator<Item = PolygonLayer>,
) -> Scene {
    scene.keep(|layer| !matches!(layer.look, Look::Polygons(_)));
    layers.into_iter().fold(scene, Scene::with)
}

/// The finished picture, of the device; or where the adapter ended loops, as software adapters do, and it was refused,
/// of the native engine.
pub(crate) fn drawn_or_refused(
    drawer: &mut Drawer,
    scene: &Scene,
    size: [u32; 2],
) -> (Light, EngineKind) {
    let plan = Plan::of(scene, size);
    drawer.prepare(&plan, &Ticket::new()).expect("the device prepares");
    let Err(error) = drawer.draw(&plan, Rung::Full, &mut ()) else {
        let light = drawer.engines.gpu().expect("a device").read_light().expect("read back");
        return (wide(&light), EngineKind::Gpu);
    };
    assert_eq!(error, GpuError::EndedLoops.into());
    assert!(drawer.engines.gpu().expect("a device").context().ends_loops);
    let engines = Engines::new(EngineChoice::Native.into(), Wishes::default());
    let mut native = Drawer::with(engines.expect("no device is asked for"));
    native.prepare(&plan, &Ticket::new()).expect("prepared");
    native.draw(&plan, Rung::Full, &mut ()).expect("drawn");
    (wide(&native.engines.native.light().0), EngineKind::Native)
}

/// The device's picture of a rung.
pub(crate) fn drawn(
    drawer: &mut Drawer,
    scene: &Scene,
    size: [u32; 2],
    rung: Rung,
) -> (Light, Drawn) {
    let plan = Plan::of(scene, size);
    drawer.prepare(&plan, &Ticket::new()).expect("the device prepares");
    let drawn = drawer.draw(&plan, rung, &mut ()).expect("the device draws");
    (
        wide(&drawer.engines.gpu().expect("a device").read_light().expect("the device reads back")),
        drawn,
    )
}

/// The mean of `n` × `n` rays a pixel.
pub(crate) fn supersampled(scene: &Scene, size: [u32; 2], n: usize) -> Light {
    let fine = size.map(|s| s * n as u32);
    let rays = reference(scene, fine, Rays::Local);
    let width = fine[0] as usize;
    let mut means = vec![[0.0; 4]; (size[0] * size[1]) as usize];
    for (i, ray) in rays.iter().enumerate() {
        let pixel = (i / width / n) * size[0] as usize + i % width / n;
        for c in 0..4 {
            means[pixel][c] += ray[c] / (n * n) as f64;
        }
    }
    means
}
