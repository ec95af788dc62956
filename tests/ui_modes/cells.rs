//! The octree's cells over the picture, the budget's presets, and what the status line says of them.

use std::sync::Arc;

use eframe::egui::{Key, Modifiers, PointerButton, ViewportId, vec2};
use voxsplat::app::settings::BudgetPreset;
use voxsplat::scene::{Cell, Cells, View, WhyWhole};
use voxsplat::task::engine::{CellsRequest, Effort, FoundCells};

use crate::ui_support::{Bench, Painter};

/// The cells that were asked for, after the first `count` times.
fn asked_since(bench: &Bench, count: usize) -> Vec<Option<CellsRequest>> {
    bench.engine.cells()[count..].to_vec()
}

#[test]
fn cells_cost_nothing_until_they_are_shown_and_nothing_once_they_are_hidden() {
    let mut bench = Bench::opened();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 30.0));
    bench.settle();
    assert!(bench.engine.cells().is_empty(), "nobody asked");
    let pictures = bench.request_count();

    bench.harness.key_press(Key::G);
    bench.settle();
    let asked = asked_since(&bench, 0);
    let [Some(first)] = &asked[..] else { panic!("{} times", asked.len()) };
    assert_eq!((first.max_error, first.scene.camera), (1.0, bench.camera()));
    assert_eq!(first.size, bench.last_request().size);
    // Another error is other cells and the same picture.
    bench.set_slider("Octree error", 0.25);
    let asked = asked_since(&bench, 1);
    let [Some(finer)] = &asked[..] else { panic!("{} times", asked.len()) };
    assert_eq!(finer.max_error, 0.25);
    assert_eq!(bench.request_count(), pictures, "no picture is drawn for it");
    // While the view moves the engine hands out what it draws; at rest the slider's error is back.
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 30.0));
    assert_eq!(asked_since(&bench, 2).len(), 0);
    bench.settle();
    let asked = asked_since(&bench, 2);
    let [Some(turned)] = &asked[..] else { panic!("{} times", asked.len()) };
    assert_eq!(turned.scene.camera, bench.camera());
    // At rest with cells on screen nothing is repainted.
    for _ in 0..60 {
        bench.harness.step();
        let output = &bench.harness.output().viewport_output[&ViewportId::ROOT];
        assert_eq!(output.repaint_delay, std::time::Duration::MAX);
    }

    bench.harness.key_press(Key::G);
    bench.settle();
    let asked = asked_since(&bench, 3);
    assert!(matches!(asked[..], [None]), "forgotten once: {}", asked.len());
    let scene = bench.window().scene().expect("something is open");
    assert!(bench.window().cells().shown(scene).is_none(), "nothing is kept");
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 30.0));
    bench.settle();
    assert_eq!(asked_since(&bench, 4).len(), 0);
}

#[test]
fn the_cell_under_the_cursor_says_why_it_is_not_split() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::G);
    bench.settle();
    let words = "Level 3: 8 × 8 × 8 = 512 voxels";
    assert!(!bench.shows(words));
    bench.hover(bench.viewport().center());
    bench.harness.run_steps(40);
    assert!(bench.shows(words));
    assert!(bench.shows("Error 0.031, asked for 1.0"));
    assert!(bench.shows("Not split: its error is small enough"));
    assert!(bench.shows("Opacity 9.5 % a unit distance"));
    // Beside the volume there is none.
    bench.hover(bench.viewport().left_top() + vec2(60.0, 90.0));
    bench.harness.run_steps(40);
    assert!(!bench.shows(words));
}

#[test]
fn cells_of_another_volume_are_not_shown() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::G);
    bench.settle();
    let shown = |bench: &Bench| {
        let scene = bench.window().scene().expect("something is open");
        bench.window().cells().shown(scene).map(Arc::clone)
    };
    let old = shown(&bench).expect("cells of the first volume");
    bench.open("other.nrrd");
    bench.settle();
    bench.engine.hand_out((*old).clone());
    bench.harness.run_steps(2);
    assert!(shown(&bench).is_none(), "they lie elsewhere");
}

/// The lines follow the camera in the very pass in which it moves, whatever the engine does.
#[test]
fn cells_lie_where_the_present_camera_sees_them() {
    let mut bench = Bench::rendered(1.0, Painter::Processor);
    let plain = bench.harness.render().expect("a software adapter is installed");
    bench.harness.key_press(Key::G);
    bench.settle();
    for by in [vec2(0.0, 0.0), vec2(25.0, 10.0)] {
        if by != vec2(0.0, 0.0) {
            bench.drag(PointerButton::Primary, Modifiers::NONE, by);
            // The cell under the cursor has brighter lines of its own.
            bench.harness.remove_cursor();
            bench.harness.step();
        }
        let scene = bench.window().scene().expect("something is open").clone();
        let found = bench.window().cells().shown(&scene).expect("cells").clone();
        let size = bench.last_request().size;
        let screen = bench.harness.render().expect("a software adapter is installed");
        let viewport = bench.viewport();
        let mut changed = 0;
        let lines = View::new(&scene, size).cell_on_picture(&found.cells.cells[0]);
        assert_eq!(lines.len(), 12);
        for [a, b] in &lines {
            let middle = (*a + *b) / 2.0;
            let at = [f64::from(viewport.left()) + middle.x, f64::from(viewport.top()) + middle.y];
            let [x, y] = at.map(|c| c as u32);
            changed += u32::from(screen.get_pixel(x, y) != plain.get_pixel(x, y));
        }
        assert!(changed >= 11, "{changed} of 12 edges after {by}");
    }
}

#[test]
fn what_is_left_out_is_said() {
    let bench = Bench::opened();
    let volume = Arc::clone(bench.window().scene().expect("something is open").volume().unwrap());
    let cell = Cell {
        low: [0; 3],
        size: [1; 3],
        level: 0,
        error: 0.0,
        extinction: 1.0,
        colour: [0; 3],
        why: WhyWhole::Voxel,
    };
    let words_of = |total, asked_error, is_drawn, is_faint| {
        let cells = Cells::from_cells(vec![cell; 2], total, 0.125);
        let found = FoundCells { volume: Arc::clone(&volume), cells, asked_error, is_drawn };
        voxsplat::app::cells::caption_words(&found, is_faint).replace('\u{a0}', " ")
    };
    let found = |total, asked_error, is_drawn| words_of(total, asked_error, is_drawn, false);
    let words = "Octree, error 0.125 · 2 of 12 345 cells drawn, largest first";
    assert_eq!(found(12_345, 0.125, false), words);
    assert_eq!(found(2, 0.125, true), "This picture's octree, error 0.125 · 2 cells");
    let words = "Octree, error 0.125, the least for a million cells · 2 cells";
    assert_eq!(found(2, 0.01, false), words);
    assert_eq!(
        words_of(2, 0.125, false, true),
        "Octree, error 0.125 · 2 cells, faint where they crowd"
    );
}

#[test]
fn a_preset_is_a_budget_and_a_budget_may_be_a_preset() {
    let mut bench = Bench::opened();
    let preset = |bench: &Bench| bench.window().settings().preset();
    assert_eq!(preset(&bench), Some(BudgetPreset::Interactive));
    for (name, budget_ms) in [("A fifth of a second", 200.0), ("5 seconds", 5000.0)] {
        bench.choose("While moving", name);
        assert_eq!(bench.window().settings().budget_ms, budget_ms);
        let asked = bench.request_count();
        bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
        let moved = bench.requests_since(asked);
        assert!(!moved.is_empty());
        assert!(moved.iter().all(|r| r.effort == Effort::Moving { budget_ms }), "{name}");
        bench.settle();
    }
    bench.choose("While moving", "Full");
    assert!(bench.window().settings().full_quality_while_moving);
    bench.choose("While moving", "Interactive (25 ms)");
    assert!(!bench.window().settings().full_quality_while_moving);
    assert_eq!(bench.window().settings().budget_ms, 25.0);
    for budget_ms in [1.0, 10_000.0] {
        bench.set_slider("Frame budget", budget_ms);
        assert_eq!(bench.window().settings().budget_ms, budget_ms);
        assert_eq!(preset(&bench), None);
    }
    bench.set_slider("Frame budget", 200.0);
    assert_eq!(preset(&bench), Some(BudgetPreset::FifthOfASecond));
}

#[test]
fn while_moving_the_line_says_what_was_spent_and_what_comes_next() {
    let mut bench = Bench::opened();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    assert!(bench.tells("Moving · ") && bench.tells(" · error about 2.8 %"));
    bench.settle();
    // A click beside it would close what the line keeps; a key turns the view, too.
    bench.open_details();
    bench.harness.key_press(Key::Num4);
    bench.harness.step();
    bench.harness.step();
    assert!(bench.tells("It took 12 of 25 ms"));
    assert!(bench.tells("the full picture follows in 84 ms"));
    bench.settle();
    assert!(bench.tells("The full picture: every voxel that shows"), "it stays open");
    assert!(!bench.tells("follows in"), "nothing comes after full");
}
