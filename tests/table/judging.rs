//! Every row against the float64 reference.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use rayon::prelude::*;
use voxsplat::accuracy::{Difference, psnr_from_rmse};
use voxsplat::reference::Reference;
use voxsplat::scene::{Classify, Scene, SplatSettings, View, Visibility};

use crate::drawing::{Drawn, Picture, table};
use crate::rows::{Judged, Row};
use crate::scenes;

/// `DECIBELS NAME` a line: how near each row must be, about 1.5 dB less than what was measured.
const FLOORS: &str = include_str!("floors.txt");
/// A floor so far under what is measured would let too much pass,
const MOST_UNDER: f64 = 6.0;
/// but for pictures that are nearer than this, which is single precision's last digits.
const PRECISE: f64 = 90.0;

type Light = Vec<[f64; 4]>;

fn wide(picture: &Picture) -> Light {
    picture.light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// How near a picture is, dB: the lesser of colour's and alpha's. No number where they cannot be compared.
fn nearness(found: &Light, expected: &Light) -> f64 {
    let rmse = |d: Difference| d.rmse.max(d.rmse_alpha);
    Difference::between(found, expected).map_or(f64::NAN, |d| psnr_from_rmse(rmse(d)))
}

/// The reference's picture of what a row shows, as large as it was drawn.
fn expected(row: &Row, scene: &Scene, picture: &Picture) -> Light {
    let size = picture.size.map(|n| n as usize);
    let reference = match (&picture.cut, row.judged) {
        (Some(cut), Judged::AsCut) => {
            let scene = scenes::in_mode(scene, mode_of_cut(row.mode));
            Reference::of_kernels(scenes::kernels_of(cut, &scene), &scene, size, false)
        }
        (_, Judged::In(mode)) => {
            let scene = scenes::in_mode(scene, mode);
            let view = View::new(&scene, picture.size);
            let rays = view.rays_per_side(mode.kernel, mode.extent) as usize;
            Reference::supersampled(&scene, size, rays, false)
        }
        _ => panic!("{}: expected a cut", row.name()),
    };
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

/// A row that was drawn, and how near it is to the reference.
struct Measured {
    drawn: &'static Drawn,
    expected: Light,
    decibels: f64,
}

impl Measured {
    fn name(&self) -> String {
        self.drawn.row.name()
    }

    fn light(&self) -> Light {
        self.drawn.outcome.as_ref().map(wide).unwrap_or_default()
    }
}

/// Every row that there is a picture of.
fn measured() -> &'static [Measured] {
    static MEASURED: LazyLock<Vec<Measured>> = LazyLock::new(|| {
        let Some(table) = table() else { return Vec::new() };
        let measure = |drawn: &'static Drawn| {
            let Drawn { row, scene, outcome } = drawn;
            let picture = outcome.as_ref().ok().filter(|_| row.judged != Judged::Refused)?;
            let expected = expected(row, scene, picture);
            let decibels = nearness(&wide(picture), &expected);
            Some(Measured { drawn, expected, decibels })
        };
        table.rows.par_iter().filter_map(measure).collect()
    });
    &MEASURED
}

/// What each row must be at least, dB, by its name.
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
    let Some(table) = table() else { return };
    let floors = floors();
    let mut faults = Vec::new();
    for Drawn { row, outcome, .. } in &table.rows {
        if let (Err(error), true) = (outcome, row.judged != Judged::Refused) {
            faults.push(format!("{}: {error}", row.name()));
        }
    }
    for one in measured() {
        let (name, decibels) = (one.name(), one.decibels);
        println!("measured {name}: {decibels:.1} dB");
        match floors.get(name.as_str()) {
            Some(&floor) if decibels >= floor => {}
            Some(floor) => faults.push(format!("{name}: {decibels:.1} dB, under {floor}")),
            None => faults.push(format!("{name}: {decibels:.1} dB, and no floor in floors.txt")),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A floor that nothing falls under is none.
#[test]
fn floors_are_near_what_is_measured_and_of_rows_that_are_there() {
    if table().is_none() {
        return;
    }
    let mut floors = floors();
    let mut faults = Vec::new();
    for one in measured() {
        let name = one.name();
        let Some(floor) = floors.remove(name.as_str()) else { continue };
        if one.decibels < PRECISE && one.decibels > floor + MOST_UNDER {
            faults.push(format!("{name}: {:.1} dB, far over {floor}", one.decibels));
        }
        let nothing = nearness(&vec![[0.0; 4]; one.expected.len()], &one.expected);
        if nothing > floor - MOST_UNDER {
            faults.push(format!("{name}: an empty picture has {nothing:.1} dB, of {floor}"));
        }
    }
    faults.extend(floors.keys().map(|name| format!("{name}: a floor of no row")));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A picture in another place: a column further to the right.
#[test]
fn a_picture_that_is_a_pixel_beside_its_place_is_refused() {
    let floors = floors();
    let mut passed = Vec::new();
    for one in measured() {
        let mut light = one.light();
        light.rotate_right(1);
        let floor = floors.get(one.name().as_str()).copied().unwrap_or(f64::INFINITY);
        if nearness(&light, &one.expected) >= floor {
            passed.push(one.name());
        }
    }
    assert!(passed.is_empty(), "{}", passed.join("\n"));
}
