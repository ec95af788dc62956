//! Every row against the float64 reference.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use voxsplat::accuracy::{Difference, psnr_from_rmse};
use voxsplat::hierarchy::Cut;
use voxsplat::reference::Reference;
use voxsplat::scene::{Classify, Scene, SplatSettings, View, Visibility};
use voxsplat::task::draw::Rung;
use voxsplat::task::engines::EngineKind;

use crate::drawing::{Drawn, Picture, Table, table};
use crate::rows::{Judged, Row, rows};
use crate::scenes;

/// `DECIBELS NAME` a line: how near each row must be, about 1.5 dB less than what was measured.
const FLOORS: &str = include_str!("floors.txt");
/// A floor so far under what is measured would let too much pass,
const MOST_UNDER: f64 = 6.0;
/// but for pictures that are nearer than this, which is single precision's last digits.
const PRECISE: f64 = 90.0;

/// Pictures that are nearer than this are as the reference's but for rounding, and tables' steps.
const LIKE_IT: f64 = 60.0;
/// Rows under this have little but their bits: splats about the eye, which are drawn as seen in their middles, and
/// the coarsest cuts.
const ABOUT_THE_EYE: f64 = 28.0;

type Light = Vec<[f64; 4]>;

fn wide(picture: &Picture) -> Light {
    picture.light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// How near a picture is, dB: the lesser of colour's and alpha's. No number where they cannot be compared.
fn nearness(found: &Light, expected: &Light) -> f64 {
    let rmse = |d: Difference| d.rmse.max(d.rmse_alpha);
    Difference::between(found, expected).map_or(f64::NAN, |d| psnr_from_rmse(rmse(d)))
}

/// The reference's picture in the mode that a row is held to, so large.
fn expected_in(mode: SplatSettings, scene: &Scene, size: [u32; 2]) -> Light {
    let scene = scenes::in_mode(scene, mode);
    let rays = View::new(&scene, size).rays_per_side(mode.kernel, mode.extent) as usize;
    let reference = Reference::supersampled(&scene, size.map(|n| n as usize), rays, false);
    reference.expect("a mode with meaning").picture()
}

/// The reference's picture of the kernels of a cut.
fn expected_of(cut: &Cut, Drawn { row, scene, .. }: &Drawn) -> Light {
    let scene = scenes::in_mode(scene, mode_of_cut(row.mode));
    let kernels = scenes::kernels_of(cut, &scene);
    let reference = Reference::of_kernels(kernels, &scene, row.size.map(|n| n as usize), false);
    reference.expect("a mode with meaning").picture()
}

/// What the kernels of a cut are laid down in: nodes lie in no sheet of the lattice, and only what is shaded
/// first has cuts in slabs.
fn mode_of_cut(mode: SplatSettings) -> SplatSettings {
    match mode.visibility {
        Visibility::Slabs if mode.classify == Classify::Before => mode,
        Visibility::Slabs => mode.previewed(),
        _ => SplatSettings { visibility: Visibility::EverySample, ..mode },
    }
}

/// A row that an engine drew, and how near it is to the reference.
struct Measured {
    drawn: &'static Drawn,
    engine: EngineKind,
    picture: &'static Picture,
    expected: Light,
    decibels: f64,
}

impl Measured {
    fn name(&self) -> String {
        self.drawn.row.name()
    }

    /// With the engine.
    fn full_name(&self) -> String {
        format!("{} by {}", self.name(), self.engine.name())
    }

    fn width(&self) -> usize {
        self.picture.size[0] as usize
    }

    fn light(&self) -> Light {
        wide(self.picture)
    }
}

/// Every row that there is a picture of. What does not wait for the pictures is found while they are drawn.
fn measured() -> &'static [Measured] {
    static MEASURED: LazyLock<Vec<Measured>> = LazyLock::new(|| {
        let early = |row: &Row| match (row.judged, row.rung) {
            (Judged::In(mode), Rung::Full) => Some(expected_in(mode, &row.scene(), row.size)),
            _ => None,
        };
        // In threads of their own: what draws shares its work out, too, and is not to wait for these.
        let threads = ThreadPoolBuilder::new().build().expect("threads");
        let expected = || threads.install(|| rows().par_iter().map(early).collect::<Vec<_>>());
        let (table, expected) = std::thread::scope(|scope| {
            let expected = scope.spawn(expected);
            (table(), expected.join().expect("the reference draws"))
        });
        let Some(table) = table else { return Vec::new() };
        let measure = |(drawn, expected): (&'static Drawn, Option<Light>)| {
            let of = |engine, outcome: &'static Result<Picture, String>| {
                let picture = outcome.as_ref().ok()?;
                let expected = match (&expected, drawn.row.judged, &picture.cut) {
                    (Some(expected), ..) => expected.clone(),
                    (None, Judged::In(mode), _) => expected_in(mode, &drawn.scene, picture.size),
                    (None, Judged::AsCut, Some(cut)) => expected_of(cut, drawn),
                    _ => return None,
                };
                let decibels = nearness(&wide(picture), &expected);
                Some(Measured { drawn, engine, picture, expected, decibels })
            };
            let natively = drawn.native.as_ref();
            let natively = natively.and_then(|outcome| of(EngineKind::Native, outcome));
            [of(EngineKind::Gpu, &drawn.outcome), natively].into_iter().flatten().collect()
        };
        table.rows.par_iter().zip(expected).flat_map_iter::<_, Vec<_>>(measure).collect()
    });
    &MEASURED
}

/// The table, where there is one, once everything in it is measured: drawing goes on beside that.
fn table_and_measured() -> Option<&'static Table> {
    measured();
    table()
}

/// What a row must be at least, dB: by its engine, where that has a floor of its own.
fn floor_of(one: &Measured, floors: &BTreeMap<&'static str, f64>) -> Option<f64> {
    let own = floors.get(one.full_name().as_str());
    own.or_else(|| floors.get(one.name().as_str())).copied()
}

/// What each row must be at least, dB, by its name, or that and its engine.
fn floors() -> BTreeMap<&'static str, f64> {
    let lines = FLOORS.lines().filter(|line| !line.starts_with('#'));
    let pair = |line: &'static str| {
        let (floor, name) = line.trim().split_once(' ').expect("a floor, and a name");
        (name, floor.parse().expect("a number"))
    };
    lines.map(pair).collect()
}

#[test]
fn every_row_is_as_near_to_the_reference_as_it_was() {
    let Some(table) = table_and_measured() else { return };
    let floors = floors();
    let mut faults = Vec::new();
    for Drawn { row, outcome, native, .. } in &table.rows {
        if let Some(Err(error)) = native {
            faults.push(format!("{} by native: {error}", row.name()));
        }
        match (outcome, row.judged) {
            (Err(error), Judged::In(_) | Judged::AsCut) => {
                faults.push(format!("{}: {error}", row.name()));
            }
            (Ok(Picture { cut: None, .. }), Judged::AsCut) => {
                faults.push(format!("{}: no cut was drawn", row.name()));
            }
            _ => {}
        }
    }
    for one in measured() {
        let (name, decibels) = (one.full_name(), one.decibels);
        println!("measured {name}: {decibels:.1} dB");
        match floor_of(one, &floors) {
            Some(floor) if decibels >= floor => {}
            Some(floor) => faults.push(format!("{name}: {decibels:.1} dB, under {floor}")),
            None => faults.push(format!("{name}: {decibels:.1} dB, and no floor in floors.txt")),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What means nothing is said in one sentence: what was expected, what was found, what to try.
#[test]
fn what_is_refused_is_refused_in_a_sentence() {
    let Some(table) = table_and_measured() else { return };
    let refused = table.rows.iter().filter(|drawn| drawn.row.judged == Judged::Refused);
    let faults = refused.filter_map(|Drawn { row, outcome, .. }| {
        let found = outcome.as_ref().err().map_or("a picture", String::as_str);
        let is_sentence = found.starts_with("expected ")
            && found.contains(", found ")
            && found.contains("; ")
            && !found.ends_with('.')
            && !found.contains('\n');
        (!is_sentence).then(|| format!("{}: {found}", row.name()))
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A floor that nothing falls under is none.
#[test]
fn floors_are_near_what_is_measured_and_of_rows_that_are_there() {
    if table_and_measured().is_none() {
        return;
    }
    let floors = floors();
    let mut left: BTreeSet<&str> = floors.keys().copied().collect();
    let mut faults = Vec::new();
    for one in measured() {
        let Some(floor) = floor_of(one, &floors) else { continue };
        let name = one.full_name();
        left.remove(name.as_str());
        left.remove(one.name().as_str());
        if one.decibels < PRECISE && one.decibels > floor + MOST_UNDER {
            faults.push(format!("{name}: {:.1} dB, far over {floor}", one.decibels));
        }
        let nothing = nearness(&vec![[0.0; 4]; one.expected.len()], &one.expected);
        if nothing > floor - MOST_UNDER {
            faults.push(format!("{name}: an empty picture has {nothing:.1} dB, of {floor}"));
        }
    }
    faults.extend(left.iter().map(|name| format!("{name}: a floor of no row")));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Names of rows whose pictures, made wrong on purpose, are passed.
fn passed(wrong: impl Fn(&Measured) -> Option<Light>) -> Vec<String> {
    let floors = floors();
    let passes = |one: &&Measured| {
        let floor = floor_of(one, &floors).unwrap_or(f64::INFINITY);
        wrong(one).is_some_and(|light| nearness(&light, &one.expected) >= floor)
    };
    measured().iter().filter(passes).map(Measured::full_name).collect()
}

#[test]
fn a_picture_the_wrong_way_round_is_refused() {
    let passed = passed(|one| {
        let mut light = one.light();
        light.chunks_mut(one.width()).for_each(<[_]>::reverse);
        (one.decibels > ABOUT_THE_EYE).then_some(light)
    });
    assert!(passed.is_empty(), "{}", passed.join("\n"));
}

/// A pixel further to the right, where the reference is met but for rounding.
#[test]
fn a_picture_beside_its_place_is_refused() {
    let passed = passed(|one| {
        let mut light = one.light();
        light.chunks_mut(one.width()).for_each(|row| row.rotate_right(1));
        (one.decibels > LIKE_IT).then_some(light)
    });
    assert!(passed.is_empty(), "{}", passed.join("\n"));
}

/// By a fiftieth, of fields alone: some of what may lie beside them has none.
#[test]
fn a_picture_of_less_extinction_is_refused() {
    let Some(table) = table_and_measured() else { return };
    let passed = passed(|one| {
        let Drawn { row, scene, .. } = one.drawn;
        let thinner = scenes::thinner(scene, 1.02);
        (row.rung == Rung::Full && row.parts.is_empty() && one.decibels > LIKE_IT).then(|| {
            table.draw(one.engine, row, &thinner).map(|picture| wide(&picture)).unwrap_or_default()
        })
    });
    assert!(passed.is_empty(), "{}", passed.join("\n"));
}
