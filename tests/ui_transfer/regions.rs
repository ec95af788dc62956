//! Regions of value and gradient strength by hand, and the look of NaN.

use eframe::egui::{Event, Modifiers, PointerButton, Rect, vec2};
use egui_kittest::kittest::Queryable as _;

use super::{at, click, function, undo};
use crate::ui_support::Bench;
use voxsplat::scene::Scene;
use voxsplat::transfer::{Design, Region, RegionShape};

fn regions(bench: &Bench) -> Vec<Region> {
    scene(bench).shading.regions
}

fn scene(bench: &Bench) -> Scene {
    bench.window().scene().expect("something is open").clone()
}

fn plane(bench: &Bench) -> Rect {
    bench.harness.get_by_label("Regions over value and gradient strength").rect().shrink(7.0)
}

/// The ramp has values 0 to 511, and one gradient: √(1 + 8² + 64²) a voxel.
const STRENGTH: f64 = 64.507_751;

fn with_one() -> Bench {
    let mut bench = Bench::opened();
    click(&mut bench, "Add region");
    for _ in 0..100 {
        if bench.shows("Values across, gradients upwards: pull at a side or the middle") {
            return bench;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
        bench.harness.run_steps(1);
    }
    panic!("gradients are never counted");
}

#[test]
fn regions_are_added_pulled_shaped_and_removed_by_hand() {
    let bench = &mut with_one();
    let curve = function(bench);
    let first = regions(bench)[0];
    assert_eq!(first.validate(), Ok(()));
    assert!(first.strengths[0] == 0.0 && first.values[0] < 255.5 && 255.5 < first.values[1]);
    assert_eq!(regions(&Bench::opened()), []);
    // The axis ends a tenth beyond the only gradient, or where the region does.
    let rect = plane(bench);
    let top = first.strengths[1].max(1.1 * STRENGTH);
    let place =
        |value: f64, strength: f64| at(rect, (value / 511.0) as f32, 1.0 - (strength / top) as f32);
    let middle = first.strengths[1] / 2.0;
    let right = place(first.values[1], middle);
    bench.drag_from(right, PointerButton::Primary, Modifiers::NONE, vec2(0.1 * rect.width(), 0.0));
    let wider = regions(bench)[0];
    assert!((wider.values[1] - first.values[1] - 51.1).abs() < 2.0, "{wider:?}");
    assert_eq!((wider.values[0], wider.strengths), (first.values[0], first.strengths));
    bench.settle();
    let inside = place(first.values[0] + 20.0, middle);
    bench.drag_from(inside, PointerButton::Primary, Modifiers::NONE, vec2(-20.0, -10.0));
    let moved = regions(bench)[0];
    assert!(moved.values[0] < wider.values[0] && moved.strengths[0] > 0.0, "{moved:?}");
    let width = |region: &Region| region.values[1] - region.values[0];
    assert!((width(&moved) - width(&wider)).abs() < 1e-9);
    bench.choose("Region shape", "Ellipse");
    bench.set_slider("Region opacity", 0.75);
    bench.set_slider("Region gradients from", 12.0);
    click(bench, "Region's own colour");
    let ellipse = regions(bench)[0];
    assert_eq!((ellipse.shape, ellipse.opacity), (RegionShape::Ellipse, 0.75));
    assert!(ellipse.strengths[0] == 12.0 && ellipse.colour.is_some());
    bench.settle();
    bench.double_click(at(plane(bench), 0.95, 0.2));
    bench.harness.run_steps(2);
    assert_eq!(regions(bench).len(), 2);
    undo(bench);
    assert_eq!(regions(bench), [ellipse]);
    bench.harness.check_accessibility();
    click(bench, "Remove region");
    assert!(regions(bench).is_empty() && function(bench) == curve, "the curve was waiting");
    undo(bench);
    assert_eq!(regions(bench), [ellipse]);
}

#[test]
fn regions_are_copied_pasted_and_taken_away_by_presets() {
    let mut bench = with_one();
    let design = Design { regions: regions(&bench), ..function(&bench).into() };
    assert!(design.to_text().contains("\"shape\":\"rectangle\""));
    bench.harness.event(Event::Copy);
    bench.harness.run_steps(3);
    bench.choose("Preset", "Simulation");
    assert!(regions(&bench).is_empty());
    bench.harness.event(Event::Paste(design.to_text()));
    bench.harness.run_steps(3);
    assert_eq!(regions(&bench), design.regions);
    // The shading's presets are another thing.
    bench.choose("Shading preset", "Lights");
    assert_eq!(regions(&bench), design.regions);
    click(&mut bench, "Remove all regions");
    assert!(regions(&bench).is_empty() && scene(&bench).shading.lighting.is_some());
}

#[test]
fn nan_has_a_row_only_where_there_is_any() {
    let mut bench = Bench::opened();
    assert!(!bench.shows("Opacity of NaN"));
    bench.open("holed.nrrd");
    bench.set_slider("Opacity of NaN", 0.4);
    assert_eq!(function(&bench).no_data.opacity, 0.4);
    bench.choose("Preset", "Simulation");
    assert_eq!(function(&bench).no_data.opacity, 0.4, "presets say nothing of it");
    undo(&mut bench);
    undo(&mut bench);
    assert_eq!(function(&bench).no_data.opacity, 0.0);
    bench.harness.check_accessibility();
}
