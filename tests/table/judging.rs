//! Every row against the float64 reference.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use voxsplat::accuracy::{Difference, psnr_from_rmse};
use voxsplat::hierarchy::Cut;
use voxsplat::plan::FieldCut;
use voxsplat::reference::Reference;
use voxsplat::scene::{Classify, Scene, SplatSettings, View, Visibility};
use voxsplat::task::draw::Rung;
use voxsplat::task::engines::EngineKind;

use crate::drawing::{Drawn, ENGINES, Picture, Table, table};
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

/// The reference's picture of a cut of the field.
fn expected_of_bricks(cut: &FieldCut, Drawn { row, scene, .. }: &Drawn) -> Light {
    let reference = Reference::new(scene, row.size.map(|n| n as usize));
    let bricks: usize = cut.dims.iter().product();
    let reference = reference.expect("a mode with meaning");
    reference.of_cut(scene, cut.dims, &cut.levels()[..bricks]).picture()
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
        let measure = |(drawn, expected): (&'static Drawn, Option<Light>)| {
            let of = |engine| {
                let picture = drawn.by(engine)?.as_ref().ok()?;
                let expected = match (&expected, drawn.row.judged, &picture.cut) {
                    (Some(expected), ..) => expected.clone(),
                    (None, Judged::In(mode), _) => expected_in(mode, &drawn.scene, picture.size),
                    (None, Judged::AsCut, Some(cut)) => expected_of(cut, drawn),
                    (None, Judged::AsBricks, _) => {
                        expected_of_bricks(picture.bricks.as_ref()?, drawn)
                    }
                    _ => return None,
                };
                let decibels = nearness(&wide(picture), &expected);
                Some(Measured { drawn, engine, picture, expected, decibels })
            };
            ENGINES.into_iter().filter_map(of).collect()
        };
        table.rows.par_iter().zip(expected).flat_map_iter::<_, Vec<_>>(measure).collect()
    });
    &MEASURED
}

/// The table, once everything in it is measured: drawing goes on beside that.
fn table_and_measured() -> &'static Table {
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

/// What is wrong with what became of a row by an engine, whatever its picture is like.
fn fault_of(drawn: &Drawn, engine: EngineKind) -> Option<String> {
    let is_drawn = drawn.row.judged != Judged::Refused;
    let fault = match drawn.by(engine) {
        // Splats as triangles are the other engine's, and nothing else is.
        None if engine == EngineKind::Native && is_drawn && !drawn.row.is_of_triangles() => {
            "not drawn, though it is of no triangles"
        }
        Some(_) if engine == EngineKind::Native && is_drawn && drawn.row.is_of_triangles() => {
            "drawn, though it is of triangles"
        }
        Some(Err(error)) if is_drawn || engine == EngineKind::Native => error.as_str(),
        Some(Ok(Picture { cut: None, .. })) if drawn.row.judged == Judged::AsCut => {
            "no cut was drawn"
        }
        Some(Ok(Picture { bricks, .. })) if drawn.row.judged == Judged::AsBricks => match bricks {
            None => "no cut was drawn",
            Some(cut) if cut.counts().iter().filter(|&&n| n > 0).count() < 2 => "one level alone",
            Some(_) => return None,
        },
        _ => return None,
    };
    Some(format!("{} by {}: {fault}", drawn.row.name(), engine.name()))
}

#[test]
fn every_row_is_as_near_to_the_reference_as_it_was() {
    let table = table_and_measured();
    let floors = floors();
    let of_row = |drawn: &'static Drawn| {
        ENGINES.into_iter().filter_map(move |engine| fault_of(drawn, engine))
    };
    let mut faults: Vec<String> = table.rows.iter().flat_map(of_row).collect();
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
    let table = table_and_measured();
    let (mut skipped, mut faults) = (0, Vec::new());
    for drawn in table.rows.iter().filter(|drawn| drawn.row.judged == Judged::Refused) {
        let outcome = drawn.by(EngineKind::Gpu);
        let found = match outcome {
            Some(outcome) => outcome.as_ref().err().map_or("a picture", String::as_str).to_owned(),
            None => match scenes::refusal(&drawn.scene) {
                Some(refusal) => refusal,
                // What only the device refuses is not known without one.
                None => {
                    skipped += 1;
                    continue;
                }
            },
        };
        let is_sentence = found.starts_with("expected ")
            && found.contains(", found ")
            && found.contains("; ")
            && !found.ends_with('.')
            && !found.contains('\n');
        faults.extend((!is_sentence).then(|| format!("{}: {found}", drawn.row.name())));
    }
    if skipped > 0 {
        println!("skipped {skipped} rows that only the GPU engine refuses");
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A floor that nothing falls under is none.
#[test]
fn floors_are_near_what_is_measured_and_of_rows_that_are_there() {
    let table = table_and_measured();
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
    if table.adapter.is_none() {
        // Those of what was not drawn are not known to be too many.
        for row in table.rows.iter().map(|drawn| &drawn.row) {
            let name = row.name();
            left.remove(format!("{name} by {}", EngineKind::Gpu.name()).as_str());
            left.remove(name.as_str());
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
    let table = table_and_measured();
    let passed = passed(|one| {
        let Drawn { row, scene, .. } = one.drawn;
        let thinner = scenes::thinner(scene, 1.02);
        (row.rung == Rung::Full && row.parts.is_empty() && one.decibels > LIKE_IT).then(|| {
            let drawn = table.draw(one.engine, row, &thinner).and_then(Result::ok);
            drawn.map(|picture| wide(&picture)).unwrap_or_default()
        })
    });
    assert!(passed.is_empty(), "{}", passed.join("\n"));
}
