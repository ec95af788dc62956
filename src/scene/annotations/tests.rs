//! Layouts of whole scenes.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::*;
use crate::core::{Camera, Projection, Srgb8, Ticket};
use crate::scene::{
    AlongRay, Amounts, Colours, Index, Isosurface, SampleSource, Shading, VectorLayer, opening,
};
use crate::transfer::{ColourMap, ColourSource, Region, RegionShape, TransferFunction};
use crate::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

/// Every letter is so wide, ems.
const LETTER: f64 = 0.55;

fn width_of(text: &str) -> f64 {
    LETTER * text.chars().count() as f64
}

fn scene_of(lattice: Lattice, range: [f64; 2]) -> Scene {
    let count = lattice.len();
    let value = |i: usize| range[0] + (range[1] - range[0]) * i as f64 / (count - 1) as f64;
    let samples = Samples::Float64((0..count).map(value).collect());
    let volume = ScalarVolume::from_samples("density", lattice, samples).unwrap();
    let mut scene = opening(SampleSource::default(), Arc::new(volume), None);
    *scene.transfer_mut().expect("a field") = TransferFunction::of(
        vec![(range[0], 0.0), (range[1], 0.8)],
        ColourSource::Map { map: ColourMap::Viridis, range },
    );
    scene
}

fn scene() -> Scene {
    scene_of(Lattice::unit([8; 3]), [0.0, 200.0])
}

fn all() -> Annotations {
    let mut all = Annotations::NONE;
    Annotation::ALL.into_iter().for_each(|which| *all.switch(which) = true);
    all
}

fn only(which: Annotation) -> Annotations {
    let mut only = Annotations::NONE;
    *only.switch(which) = true;
    only
}

fn laid_out(annotations: Annotations, scene: &Scene, size: [u32; 2]) -> Layout {
    lay_out(annotations, scene, None, size, &width_of)
}

/// The words of a layout and the room of their figures.
fn words(layout: &Layout) -> Vec<(String, Area)> {
    let found = layout.primitives.iter().filter_map(|primitive| match primitive {
        Primitive::Text { at, size, text, .. } => {
            let extent = DVec2::new(size * width_of(text), size * 0.7);
            Some((text.clone(), Area::new(*at - DVec2::new(0.0, extent.y), extent)))
        }
        _ => None,
    });
    found.collect()
}

fn views() -> Vec<Camera> {
    let lattice = Lattice::unit([8; 3]);
    let directions = [
        DVec3::new(-1.0, 1.0, -1.0),
        DVec3::Y,
        DVec3::NEG_Z,
        DVec3::new(0.02, 0.9, -0.1),
        DVec3::new(0.7, -0.3, 0.6),
    ];
    let mut views = Vec::new();
    for direction in directions {
        let camera = crate::scene::framing_camera(&lattice, direction, DVec3::Z);
        for zoom in [0.4, 1.0, 3.0] {
            let camera = camera.zoomed(zoom, DVec2::new(320.0, 240.0), [640.0, 480.0]);
            let projection = Projection::Perspective { view_angle: 0.6 };
            views.extend([camera, Camera { projection, ..camera }]);
        }
    }
    views
}

#[test]
fn words_never_overlap_and_never_leave_the_picture() {
    for size in [[480, 360], [360, 480], [200, 160], [1280, 800], [3000, 500]] {
        let picture = Area::new(DVec2::ZERO, DVec2::from(size.map(f64::from)));
        for camera in views() {
            let scene = Scene { camera, ..scene() };
            let words = words(&laid_out(all(), &scene, size));
            for (i, (text, area)) in words.iter().enumerate() {
                assert!(picture.holds(area), "{size:?}: {text} at {area:?}");
                for (other, its) in &words[i + 1..] {
                    assert!(!area.meets(its), "{size:?} {camera:?}: {text} and {other}");
                }
            }
        }
    }
}

#[test]
fn nothing_is_said_to_be_there_that_has_no_room() {
    let ordinary = laid_out(all(), &scene(), [480, 360]);
    assert_eq!(ordinary.left_out, []);
    let tiny = laid_out(all(), &scene(), [40, 30]);
    assert!(tiny.left_out.contains(&Annotation::ScalarBar), "{:?}", tiny.left_out);
    assert!(tiny.left_out.contains(&Annotation::Trihedron), "{:?}", tiny.left_out);
    let nothing = laid_out(Annotations::NONE, &scene(), [480, 360]);
    assert_eq!(nothing, Layout::default());
    // A box that is not on the picture.
    let mut away = scene();
    away.camera.focal_point += DVec3::splat(500.0);
    assert_eq!(laid_out(all(), &away, [480, 360]).left_out, [Annotation::Axes]);
}

/// Colours count most, then lengths, then directions; the box gives way.
#[test]
fn small_pictures_have_what_counts_most_and_nothing_in_its_way() {
    use Annotation::{Axes, ScalarBar, ScaleBar, Trihedron};
    for (size, left_out) in [
        ([480, 360], &[][..]),
        ([280, 210], &[Axes]),
        ([200, 160], &[Trihedron, Axes]),
        ([160, 120], &[ScalarBar, Trihedron, Axes]),
        ([300, 100], &[ScalarBar, Trihedron]),
    ] {
        let scene = scene();
        let layout = laid_out(all(), &scene, size);
        assert_eq!(layout.left_out, left_out, "{size:?}");
        let middle = Area {
            low: DVec2::from(size.map(f64::from)) * DVec2::new(0.35, 0.3),
            high: DVec2::from(size.map(f64::from)) * DVec2::new(0.64, 0.6),
        };
        let in_the_way = words(&layout).into_iter().filter(|(_, area)| area.meets(&middle));
        assert_eq!(in_the_way.count(), 0, "{size:?}");
        // Alone it has its room.
        assert_eq!(laid_out(only(Axes), &scene, size).left_out, [], "{size:?}");
        assert_eq!(laid_out(only(ScaleBar), &scene, size).left_out, [], "{size:?}");
    }
    let says_opacity = |size| {
        let layout = laid_out(only(ScalarBar), &scene(), size);
        assert_eq!(layout.left_out, [], "{size:?}");
        words(&layout).iter().any(|(text, _)| text == "opacity")
    };
    assert!(says_opacity([280, 210]) && !says_opacity([200, 160]), "colours before opacities");
    let mut far = scene();
    far.camera.projection = Projection::Perspective { view_angle: 0.5 };
    assert_eq!(laid_out(only(ScaleBar), &far, [160, 120]).left_out, [ScaleBar], "long words");
}

#[test]
fn opacities_that_are_none_have_no_scale_and_a_picture_of_nothing_no_bar() {
    let mut scene = scene();
    scene.transfer_mut().expect("a field").opacity = vec![(0.0, 0.0)];
    let layout = laid_out(only(Annotation::ScalarBar), &scene, [800, 600]);
    assert_eq!(layout, Layout::default());
    scene.inside.isosurfaces = vec![Isosurface { value: 50.0, opacity: 1.0, colour: None }];
    let texts = |scene: &Scene| -> Vec<String> {
        let layout = laid_out(only(Annotation::ScalarBar), scene, [800, 600]);
        words(&layout).into_iter().map(|(text, _)| text).collect()
    };
    let found = texts(&scene);
    assert!(found.contains(&"density".to_owned()) && !found.contains(&"opacity".to_owned()));
    // Ten to the minus fifth, and not ten.
    scene.transfer_mut().expect("a field").opacity = vec![(0.0, 8e-6)];
    let found = texts(&scene);
    let at = found.iter().position(|text| text == "1×10").expect("an opacity");
    assert_eq!(found[at + 1], "−5", "{found:?}");
}

#[test]
fn the_scale_bar_is_as_long_as_it_says() {
    for scale in [4.0, 0.003, 7e8] {
        for size in [[480, 360], [1600, 1200]] {
            let mut scene = scene();
            scene.camera.parallel_scale = scale;
            let layout = laid_out(only(Annotation::ScaleBar), &scene, size);
            // Its line is the longest.
            let longest = layout.primitives.iter().filter_map(|primitive| match primitive {
                Primitive::Line { ends: [a, b], .. } => Some(a.distance(*b)),
                _ => None,
            });
            let pixels = longest.fold(0.0, f64::max);
            let length = pixels * 2.0 * scale / f64::from(size[1]);
            let words = words(&layout);
            let number = words[0].0.replace('−', "-").replace("×10", "e");
            let exponent =
                if number.ends_with('e') { words[1].0.replace('−', "-") } else { String::new() };
            let said: f64 = format!("{number}{exponent}").parse().unwrap();
            assert!((length / said - 1.0).abs() < 1e-9, "{length} {said}");
            assert!(pixels <= 0.22 * f64::from(size[0]) && pixels > 0.08 * f64::from(size[0]));
            assert!(words.iter().all(|(text, _)| !text.contains("focal")), "{words:?}");
        }
    }
    let mut scene = scene();
    scene.camera.projection = Projection::Perspective { view_angle: 0.5 };
    let words = words(&laid_out(only(Annotation::ScaleBar), &scene, [640, 480]));
    assert!(words.iter().any(|(text, _)| text.ends_with("units at the focal plane")), "{words:?}");
}

#[test]
fn lengths_have_the_unit_that_the_file_gives_them_in() {
    let mut volume = (**scene().volume().unwrap()).clone();
    volume.unit = Some("mm".to_owned());
    let scene = opening(SampleSource::default(), Arc::new(volume), None);
    let of = |which| words(&laid_out(only(which), &scene, [640, 480]));
    let found = of(Annotation::ScaleBar);
    assert!(found.iter().any(|(text, _)| text == " mm"), "{found:?}");
    let found = of(Annotation::Axes);
    assert!(found.iter().any(|(text, _)| text == "x, mm"), "{found:?}");
}

/// A row of a scalar bar and its colour.
type Row = (Area, Srgb8);

/// The rows of a scalar bar, and its numbers with where they are from the top.
fn bar(layout: &Layout) -> (Vec<Row>, Vec<(f64, f64)>) {
    let rows = layout.primitives.iter().filter_map(|primitive| match primitive {
        Primitive::Rectangle { area, ink } if ink.opacity == 1.0 => Some((*area, ink.colour)),
        _ => None,
    });
    // The first is the frame.
    let rows: Vec<_> = rows.skip(1).collect();
    let right = rows[0].0.high.x;
    let numbers = words(layout).into_iter().filter(|(_, area)| area.low.x > right);
    let numbers = numbers.filter_map(|(text, area)| {
        let value = text.replace('−', "-").parse().ok()?;
        Some((value, f64::midpoint(area.low.y, area.high.y)))
    });
    (rows, numbers.collect())
}

#[test]
fn the_scalar_bar_has_each_value_where_its_colour_is() {
    let scene = scene_of(Lattice::unit([8; 3]), [-50.0, 150.0]);
    let layout = laid_out(only(Annotation::ScalarBar), &scene, [800, 600]);
    let (rows, numbers) = bar(&layout);
    assert!(numbers.len() >= 4, "{numbers:?}");
    for (value, y) in numbers {
        let (_, found) =
            rows.iter().find(|(area, _)| area.low.y <= y && y <= area.high.y + 1.0).unwrap();
        let expected = scene
            .transfer()
            .expect("a field")
            .colour_at(value)
            .0
            .map(crate::core::colour::srgb_from_linear);
        for (found, expected) in found.0.iter().zip(expected) {
            // A row of pixels is half a value high: measured 2.1 of 255.
            assert!(
                (f64::from(*found) - 255.0 * expected).abs() < 4.0,
                "{value}: {found} {expected}"
            );
        }
    }
    let words = words(&layout);
    assert!(
        words.iter().any(|(text, _)| text == "density")
            && words.iter().any(|(t, _)| t == "opacity")
    );
}

#[test]
fn reversed_and_steplike_colours_have_a_bar_all_the_same() {
    let mut scene = scene();
    scene.transfer_mut().expect("a field").colour =
        ColourSource::Map { map: ColourMap::Gray, range: [200.0, 0.0] };
    let (rows, numbers) = bar(&laid_out(only(Annotation::ScalarBar), &scene, [800, 600]));
    assert!(
        numbers.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 > pair[1].1),
        "{numbers:?}"
    );
    assert!(rows[0].1.0[0] < 5 && rows[rows.len() - 1].1.0[0] > 250, "great values are black");
    scene.transfer_mut().expect("a field").colour =
        ColourSource::Map { map: ColourMap::Gray, range: [80.0, 80.0] };
    let (rows, numbers) = bar(&laid_out(only(Annotation::ScalarBar), &scene, [800, 600]));
    assert_eq!(rows.iter().map(|(_, c)| c.0[0]).collect::<Vec<_>>(), [255, 0], "one step");
    assert!(numbers.iter().any(|(value, _)| *value == 200.0), "{numbers:?}");
}

#[test]
fn the_bar_ends_where_the_data_do_and_projections_have_no_opacities_beside_it() {
    let mut scene = scene();
    scene.transfer_mut().expect("a field").colour =
        ColourSource::Map { map: ColourMap::Gray, range: [-100.0, 150.0] };
    let layout = laid_out(only(Annotation::ScalarBar), &scene, [800, 600]);
    let (_, numbers) = bar(&layout);
    let values: Vec<f64> = numbers.iter().map(|(value, _)| *value).collect();
    assert_eq!(values[0], 0.0, "the data are from 0 to 200: {values:?}");
    assert!((130.0..=150.0).contains(&values[values.len() - 1]), "and the colours to 150");
    let has_opacities = |layout: &Layout| words(layout).iter().any(|(text, _)| text == "opacity");
    assert!(has_opacities(&layout));
    scene.inside.along = AlongRay::Maximum;
    assert!(!has_opacities(&laid_out(only(Annotation::ScalarBar), &scene, [800, 600])));
}

#[test]
fn colours_by_a_table_have_that_tables_bar() {
    let mut scene = scene();
    let stops = vec![(0.0, Srgb8::BLACK), (40.0, Srgb8::WHITE)];
    scene.shading = Shading {
        reflection: Some(Colours { index: Index::GradientStrength, stops }),
        opacity: Some(Amounts { index: Index::Value, points: vec![(0.0, 0.1)] }),
        ..Shading::default()
    };
    let layout = laid_out(only(Annotation::ScalarBar), &scene, [800, 600]);
    let found: Vec<String> = words(&layout).into_iter().map(|(text, _)| text).collect();
    assert!(found.contains(&"density, gradient strength".to_owned()), "{found:?}");
    assert!(
        found.contains(&"40".to_owned()) && !found.contains(&"opacity".to_owned()),
        "{found:?}"
    );
    // Regions have several opacities for one value.
    let region = Region {
        shape: RegionShape::Rectangle,
        values: [0.0, 9.0],
        strengths: [0.0, 1.0],
        softness: 0.5,
        opacity: 0.5,
        colour: None,
    };
    scene.shading = Shading { regions: vec![region], ..Shading::default() };
    let found = words(&laid_out(only(Annotation::ScalarBar), &scene, [800, 600]));
    assert!(found.iter().all(|(text, _)| text != "opacity"), "{found:?}");
    // A mode that shows no tables has the transfer function's.
    scene.splat = crate::scene::SplatSettings::SHADE_FIRST;
    let found = words(&laid_out(only(Annotation::ScalarBar), &scene, [800, 600]));
    assert!(
        found.iter().any(|(text, _)| text == "density") && found.iter().any(|(t, _)| t == "200")
    );
}

#[test]
fn vectors_alone_have_the_bar_of_their_lengths() {
    let vectors = (0..27).map(|i| Vec3::X * i as f32).collect::<Vec<_>>();
    let places = Places::Lattice(Lattice::unit([3; 3]));
    let field = VectorField::new("flow", places, vectors.into(), &Ticket::new()).unwrap();
    let mut layer = VectorLayer::new(Arc::new(field));
    let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 25.0] };
    layer.settings.transfer = TransferFunction::of(vec![(0.0, 0.5)], colour);
    let mut scene = scene().with(layer.clone());
    scene.show_field(false);
    let texts = |scene: &Scene| -> Vec<String> {
        let layout = laid_out(only(Annotation::ScalarBar), scene, [800, 600]);
        words(&layout).into_iter().map(|(text, _)| text).collect()
    };
    let found = texts(&scene);
    assert!(
        found.contains(&"flow, length".to_owned()) && found.contains(&"25".to_owned()),
        "{found:?}"
    );
    // A second field has a bar of its own, beside.
    let second = VectorField { name: "other".into(), ..VectorField::clone(&layer.field) };
    let mut scene = scene.with(VectorLayer::beside_another(Arc::new(second)));
    let found = texts(&scene);
    for title in ["flow, length", "other, length"] {
        assert!(found.contains(&title.to_owned()), "{found:?}");
    }
    let narrow = laid_out(only(Annotation::ScalarBar), &scene, [160, 120]);
    assert_eq!(narrow.left_out, [Annotation::ScalarBar], "no room for both");
    // One colour is no map: nothing says more by a bar of it.
    let white = ColourSource::Stops(vec![(0.0, Srgb8::WHITE), (25.0, Srgb8::WHITE)]);
    scene.vectors_mut()[1].1.transfer.colour = white;
    assert!(!texts(&scene).contains(&"other, length".to_owned()));
}

/// Vectors beside a field, and second ones among them.
fn beside() -> [Scene; 2] {
    let vectors = (0..27).map(|i| Vec3::X * i as f32).collect::<Vec<_>>();
    let places = Places::Lattice(Lattice::unit([3; 3]));
    let field = VectorField::new("flow", places, vectors.into(), &Ticket::new()).unwrap();
    let second = VectorField { name: "other".into(), ..field.clone() };
    let one = scene().with(VectorLayer::new(Arc::new(field)));
    let two = one.clone().with(VectorLayer::beside_another(Arc::new(second)));
    [one, two]
}

/// Frames of bars, and the rows of one colour within them.
fn bars(layout: &Layout) -> Vec<Area> {
    let mut bars: Vec<Area> = Vec::new();
    for primitive in &layout.primitives {
        match primitive {
            Primitive::Rectangle { area, ink }
                if ink.opacity == 1.0 && !bars.iter().any(|bar| bar.holds(area)) =>
            {
                bars.push(*area);
            }
            _ => {}
        }
    }
    bars
}

#[test]
fn vectors_beside_a_field_have_a_bar_each_and_none_covers_another() {
    // Side by side, and one below the other where that has no room.
    for (size, most) in [
        ([1280, 800], 3),
        ([480, 360], 3),
        ([280, 210], 3),
        ([200, 160], 2),
        ([150, 480], 3),
        ([160, 120], 0),
        ([3000, 500], 3),
    ] {
        for (scene, titles) in
            beside().iter().zip([&["density", "flow"][..], &["density", "flow", "other"]])
        {
            if titles.len() > most {
                let layout = laid_out(only(Annotation::ScalarBar), scene, size);
                assert_eq!(layout.left_out, [Annotation::ScalarBar], "{size:?}");
                continue;
            }
            for annotations in [only(Annotation::ScalarBar), all()] {
                let layout = laid_out(annotations, scene, size);
                let bars = bars(&layout);
                let words = words(&layout);
                assert!(!layout.left_out.contains(&Annotation::ScalarBar), "{size:?}");
                assert_eq!(bars.len(), titles.len(), "{size:?}: {bars:?}");
                for title in titles {
                    let begins = &title[..4];
                    let count = words.iter().filter(|(text, _)| text.starts_with(begins)).count();
                    assert_eq!(count, 1, "{size:?}: {title} in {words:?}");
                }
                for (i, bar) in bars.iter().enumerate() {
                    assert!(bars[i + 1..].iter().all(|other| !bar.meets(other)), "{size:?}");
                    assert!(words.iter().all(|(_, area)| !bar.meets(area)), "{size:?}");
                }
            }
        }
    }
    // A field without any opacity has none of its own.
    let [mut scene, _] = beside();
    scene.transfer_mut().expect("a field").opacity = vec![(0.0, 0.0)];
    let layout = laid_out(only(Annotation::ScalarBar), &scene, [480, 360]);
    assert!(words(&layout).iter().all(|(text, _)| text != "density"));
    assert_eq!(bars(&layout).len(), 1);
}

#[test]
fn ticks_of_the_box_are_where_the_world_says() {
    // Spacing, origin and a quarter turn: x of the world is −y of the lattice.
    let lattice = Lattice {
        dims: [21, 11, 5],
        spacing: DVec3::new(2.0, 3.0, 10.0),
        origin: DVec3::new(100.0, -7.0, 0.0),
        direction: DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z),
    };
    for perspective in [false, true] {
        let mut scene = scene_of(lattice, [0.0, 1.0]);
        scene.camera = crate::scene::framing_camera(&lattice, DVec3::NEG_Z, DVec3::Y);
        scene.camera.parallel_scale *= 1.5;
        if perspective {
            scene.camera.projection = Projection::Perspective { view_angle: 0.6 };
        }
        let size = [900, 700];
        let layout = laid_out(only(Annotation::Axes), &scene, size);
        let (words, top) = (words(&layout), 45.0);
        assert!(words.iter().any(|(text, _)| text == "x") && words.iter().any(|(t, _)| t == "y"));
        let mut compared = 0;
        for (text, area) in words {
            let Ok(value) = text.replace('−', "-").parse::<f64>() else { continue };
            let middle = area.low.midpoint(area.high);
            // Below the box numbers are of x, left of it of y; seen from above, on its upper face.
            let y_low = -7.0 - 1.0;
            let x_low = 100.0 - 3.0 * 10.5;
            let at = |x: f64, y: f64| {
                let view = scene.camera.to_view(DVec3::new(x, y, top));
                scene.camera.pixel_from_view(view, size.map(f64::from)).unwrap()
            };
            let (on_x, on_y) = (at(value, y_low), at(x_low, value));
            let is_of_x = (middle.x - on_x.x).abs() < 1.0 && middle.y > on_x.y;
            let is_of_y = (middle.y - on_y.y).abs() < 1.0 && middle.x < on_y.x;
            assert!(is_of_x || is_of_y, "{text} at {middle}: {on_x} {on_y}");
            compared += 1;
        }
        assert!(compared >= 6, "{compared}");
    }
}

#[test]
fn patients_have_their_letters() {
    let scene = scene();
    let words = |space| -> Vec<String> {
        let layout = lay_out(all(), &scene, Some(space), [900, 700], &width_of);
        words(&layout).into_iter().map(|(text, _)| text).collect()
    };
    let patient = words("left-posterior-superior");
    for expected in ["L", "P", "S", "x (L)", "y (P)", "z (S)"] {
        assert!(patient.iter().any(|text| text == expected), "{expected}: {patient:?}");
    }
    let other = words("scanner-xyz");
    assert_eq!(other.iter().filter(|text| *text == "x").count(), 2, "{other:?}");
}

#[test]
fn pictures_twice_as_large_are_annotated_alike() {
    let (small, large) =
        (laid_out(all(), &scene(), [960, 720]), laid_out(all(), &scene(), [1920, 1440]));
    let texts = |layout: &Layout| words(layout).into_iter().map(|(t, _)| t).collect::<Vec<_>>();
    assert_eq!(texts(&small), texts(&large));
    for ((text, a), (_, b)) in words(&small).into_iter().zip(words(&large)) {
        assert!((a.low * 2.0 - b.low).length() < 4.0, "{text}: {a:?} {b:?}");
    }
}

/// Numbers that name things had a bar of all that lies between them.
#[test]
fn names_have_a_colour_and_a_number_each() {
    let lattice = Lattice::unit([6; 3]);
    let names = [2_u8, 5, 7];
    let samples =
        Samples::UInt8((0..216).map(|i| if i % 2 == 0 { 0 } else { names[i % 3] }).collect());
    let volume = ScalarVolume::from_samples("organs", lattice, samples).unwrap();
    let scene = crate::scene::first_look(SampleSource::default(), Arc::new(volume), None);
    let layout = laid_out(only(Annotation::ScalarBar), &scene, [640, 480]);
    let words: Vec<String> = words(&layout).into_iter().map(|(text, _)| text).collect();
    assert_eq!(words, ["organs", "2", "5", "7"]);
    let transfer = scene.transfer().unwrap();
    for name in names {
        let [r, g, b] =
            transfer.colour_at(f64::from(name)).0.map(crate::core::colour::srgb_from_linear);
        let byte = |c: f64| (c * 255.0).round() as u8;
        let expected = Srgb8([r, g, b].map(byte));
        let patch = layout.primitives.iter().filter(|primitive| {
            matches!(primitive, Primitive::Rectangle { ink, .. } if ink.colour == expected)
        });
        assert_eq!(patch.count(), 1, "{name}");
    }
}
