//! `voxsplat probe`.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::flags::ProbeFlags;
use super::flow::FlowFlags;
use super::render::{refuse_among_triangles, with_layers};
use super::vectors::Vectors;
use super::{Destination, Failure, note, notes, open};
use crate::core::{Ticket, plain_number, plain_numbers};
use crate::io::mesh::drawn_name;
use crate::rbf::few_digits;
use crate::scene::{AlongRay, Scene, VectorLayer, axis_letters};
use crate::task::probe::{
    self, FIRST_SEEN, Look, Met, Point, ProbedVector, Seen, VectorPlace, look,
};
use crate::volume::{Component, Field, ScalarVolume};

/// What scripts read.
#[derive(Debug, Serialize)]
struct Report {
    /// Column and row of the pixel; `None` where a place was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    at: Option<[u32; 2]>,
    /// Opacity that the ray was to gather; `None` where values are projected, and of a place that was asked for.
    share: Option<f64>,
    /// Names of the world's axes.
    axes: [&'static str; 3],
    /// World length that the opacity is of.
    unit_distance: f64,
    /// `None` where nothing is seen.
    point: Option<ReportedPoint>,
    /// Opacity of the whole ray, where it is less than `share`.
    gathered: Option<f64>,
}

#[derive(Debug, Serialize)]
struct ReportedPoint {
    met: Met,
    world: [f64; 3],
    index: [f64; 3],
    /// The file's cell that it lies in, where the field is drawn on its cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    cell: Option<u32>,
    value: f64,
    gradient: [f64; 3],
    gradient_length: f64,
    opacity: f64,
    /// The nearest of each field of vectors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    vectors: Vec<ReportedVector>,
}

#[derive(Debug, Serialize)]
struct ReportedVector {
    field: String,
    #[serde(flatten)]
    place: VectorPlace,
    world: [f64; 3],
    vector: [f64; 3],
    length: f64,
}

/// What is asked about.
#[derive(Debug, Clone, Copy)]
enum Asked {
    Pixel([u32; 2]),
    Place([f64; 3]),
}

impl Asked {
    fn of(flags: &ProbeFlags) -> Result<Self, Failure> {
        let [width, height] = flags.resolution;
        let found = match (flags.at, flags.point) {
            (Some([column, row]), None) if column >= width || row >= height => {
                return Err(Failure::Usage(format!(
                    "expected a pixel of the picture with --at, from 0,0 to {},{}, found {column},{row}; choose \
                     one, or a larger --resolution",
                    width - 1,
                    height - 1
                )));
            }
            (Some(pixel), None) => return Ok(Self::Pixel(pixel)),
            (None, Some(place)) => return Ok(Self::Place(place)),
            (None, None) => "neither; give one of them",
            (Some(_), Some(_)) => "both; leave one of them out",
        };
        Err(Failure::Usage(format!(
            "expected a pixel with --at X,Y or a place with --point X,Y,Z, found {found}"
        )))
    }

    fn pixel(self) -> Option<[u32; 2]> {
        match self {
            Self::Pixel(pixel) => Some(pixel),
            Self::Place(_) => None,
        }
    }
}

pub(super) fn run(flags: &ProbeFlags) -> Result<(), Failure> {
    let splat = flags.mode.resolve().map_err(|error| Failure::Usage(error.to_string()))?;
    let asked = Asked::of(flags)?;
    let projection = flags.inside.projection.filter(|along| *along != AlongRay::Composite);
    refuse_nowhere(projection, flags.share)?;
    refuse_among_triangles(&splat, &flags.vectors, &flags.polygons, &FlowFlags::default())?;
    flags.vectors.refuse_loop("probe")?;
    open::check_name(&flags.input.file)?;
    let input = open::grid(&flags.input, flags.scene.field.as_deref())?;
    for warning in &input.warnings {
        note(warning);
    }
    let mode = open::Mode::of(&flags.mode, splat, flags.mode.are_given());
    let mode = mode.with_levels(flags.inside.asks_for_levels());
    let scene = open::scene(&input, &flags.scene, mode)?;
    let splat = scene.splat;
    let shading = flags.shading.resolve(&scene, &splat);
    let shading = shading.map_err(|error| Failure::Usage(error.to_string()))?;
    let volume = open::volume(&scene)?;
    if matches!(asked, Asked::Place(_)) && !scene.shows_field() {
        return Err(Failure::Usage(
            "expected a field of values with --point, found a surface or points by themselves; add --kernel \
             ellipsoids, which has values about points, or ask about a pixel with --at"
                .to_owned(),
        ));
    }
    let inside = flags.inside.resolve_in(&flags.scene, volume, &splat).map_err(Failure::Usage)?;
    inside.beside(volume).iter().for_each(|what| note(what));
    let hiding = flags.mode.of_hiding();
    let idle = notes::idle_beside_projection(&inside, &flags.scene, &flags.shading, hiding);
    idle.iter().for_each(|what| note(what));
    let vectors = match flags.vectors.layer(&input, &scene, true, false)? {
        None => own_vectors(&input)?,
        layer => layer,
    };
    let polygons = flags.polygons.layers((&input.grid.lattice, input.grid.space.as_deref()))?;
    // Vectors beside values that are projected are told all the same.
    let scene = Scene { shading, inside, ..scene };
    let scene = with_layers(scene, &flags.scene, vectors, polygons)?;
    let names: Vec<String> =
        scene.vectors().into_iter().map(|layer| layer.field.name.clone()).collect();
    let unit_distance = scene.opacity_unit_distance();
    let share = flags.share.unwrap_or(FIRST_SEEN);
    let seen = match asked {
        Asked::Pixel(pixel) => {
            let question = Look { scene, size: flags.resolution, pixel, share };
            look(&question).map_err(Failure::failed)?
        }
        Asked::Place(place) => Seen::Point(told_at(&scene, place, &input.path)?),
    };
    let axes = axis_letters(input.grid.space.as_deref());
    let report = Report {
        at: asked.pixel(),
        share: asked.pixel().and(projection.is_none().then_some(share)),
        axes,
        unit_distance,
        point: match seen {
            Seen::Point(point) => Some(reported(&point, &names)),
            Seen::Beside | Seen::Average | Seen::TooLittle { .. } => None,
        },
        gathered: match seen {
            Seen::Beside if projection.is_none() => Some(0.0),
            Seen::TooLittle { gathered } => Some(gathered),
            Seen::Beside | Seen::Average | Seen::Point(_) => None,
        },
    };
    let text = if flags.json {
        serde_json::to_string_pretty(&report).map_err(Failure::failed)?
    } else {
        sentences(&report, seen)
    };
    Destination::Stdout("what is seen").write(format!("{text}\n").as_bytes())
}

/// What there is at a place.
fn told_at(scene: &Scene, place: [f64; 3], path: &Path) -> Result<Point, Failure> {
    let found = probe::at(scene, DVec3::from(place)).map_err(Failure::failed)?;
    found.ok_or_else(|| match open::volume(scene) {
        Ok(volume) => Failure::Failed(format!("{}: {}", nowhere(volume, place), path.display())),
        Err(failure) => failure,
    })
}

/// Says where a field has values, to who asked beside it.
fn nowhere(volume: &ScalarVolume, [x, y, z]: [f64; 3]) -> String {
    let ends = volume.lattice.dims.map(|n| [-0.5, n as f64 - 0.5]);
    let corners = (0..8).map(|corner: usize| {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| ends[axis][corner >> axis & 1]);
        volume.lattice.world_from_index(DVec3::new(x, y, z))
    });
    let [low, high] = volume.own_bounds.unwrap_or_else(|| {
        corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], corner| {
            [low.min(corner), high.max(corner)]
        })
    });
    let along = ["x", "y", "z"].into_iter().zip(low.to_array().into_iter().zip(high.to_array()));
    #[expect(clippy::cast_possible_truncation, reason = "told, with as few digits as say it")]
    let words = along.map(|(axis, (low, high))| {
        format!("{axis} {} to {}", plain_number(low as f32), plain_number(high as f32))
    });
    let words = words.collect::<Vec<_>>().join(", ");
    format!(
        "expected a place with a value with --point, in a box of the world coordinates {words}, found {}, \
         where there is none; choose another",
        plain_numbers([x, y, z]).replace(' ', "")
    )
}

/// Refuses what has no one point, and what no point goes by.
fn refuse_nowhere(projection: Option<AlongRay>, share: Option<f64>) -> Result<(), Failure> {
    if projection == Some(AlongRay::Average) {
        return Err(Failure::Usage(
            "expected --projection composite, maximum or minimum with probe, found average, which lies at \
             no one point of a ray; choose one of the others"
                .to_owned(),
        ));
    }
    match (projection, share) {
        (Some(along), Some(_)) => Err(Failure::Usage(format!(
            "expected no --share with --projection {}, whose point goes by values and no opacity, found \
             both; leave one of the two out",
            along.name()
        ))),
        _ => Ok(()),
    }
}

/// The vectors that a file opens with, of which the nearest is told though its lengths are what is looked at.
fn own_vectors(input: &open::Input) -> Result<Option<Vectors>, Failure> {
    // Three numbers may be a point's own colour.
    let are_vectors = |field: &&Field| {
        field.components == 3 && drawn_name(field, Component::usual(field.components)).is_some()
    };
    let Some(field) = input.grid.fields.first().filter(are_vectors) else {
        return Ok(None);
    };
    let vectors = input.grid.vectors(field, &Ticket::new());
    let vectors = vectors.map_err(|error| Failure::Failed(input.about(&error.to_string())))?;
    let layer = (input.source(&field.name), VectorLayer::new(Arc::new(vectors)));
    Ok(Some(Vectors { layers: vec![layer], alone: false, phase: 0.0 }))
}

fn reported(point: &Point, names: &[String]) -> ReportedPoint {
    let vectors = point.vectors.iter().zip(names).filter_map(|(found, name)| {
        let ProbedVector { place, world, vector, length } = (*found)?;
        let (world, vector) = (world.to_array(), vector.to_array());
        Some(ReportedVector { field: name.clone(), place, world, vector, length })
    });
    ReportedPoint {
        met: point.met,
        world: point.world.to_array(),
        index: point.index.to_array(),
        cell: point.cell,
        value: point.value,
        gradient: point.gradient.to_array(),
        gradient_length: point.gradient.length(),
        opacity: point.opacity,
        vectors: vectors.collect(),
    }
}

fn sentences(report: &Report, seen: Seen) -> String {
    let share = few_digits(100.0 * report.share.unwrap_or_default());
    let point = match seen {
        Seen::Average => return "nothing: a mean lies at no one point".to_owned(),
        Seen::Beside if report.share.is_none() => {
            return "nothing: the ray meets no value of the volume".to_owned();
        }
        Seen::Beside => return "nothing: the ray passes the volume by".to_owned(),
        Seen::TooLittle { gathered } => {
            let gathered = few_digits(100.0 * gathered);
            return format!(
                "nothing: the ray gathers {gathered} % opacity, less than the {share} % that count \
                 as seen (--share)"
            );
        }
        Seen::Point(point) => point,
    };
    let three = |v: DVec3| told(v.to_array()).join(" ");
    let [x, y, z] = report.axes;
    if point.met == Met::Vectors {
        // Of the field, which is not shown, nothing is told.
        let seen = format!("Seen              {}", met_words(point.met, &share));
        let world = format!("World ({x} {y} {z})     {}", three(point.world));
        return [vec![world, seen], vector_lines(report)].concat().join("\n");
    }
    if point.met == Met::Polygon && point.gradient.x.is_nan() {
        let mut lines = vec![format!("World ({x} {y} {z})     {}", three(point.world))];
        if point.value.is_finite() {
            lines.push(format!("Value             {}", told_one(point.value)));
        }
        lines.push(format!("Seen              {}", met_words(point.met, &share)));
        return [lines, vector_lines(report)].concat().join("\n");
    }
    let place = match point.cell {
        Some(cell) => format!("Cell              {cell}"),
        None => format!("Index             {}", three(point.index)),
    };
    let mut lines = vec![
        format!("World ({x} {y} {z})     {}", three(point.world)),
        place,
        format!("Value             {}", told_one(point.value)),
        format!("Gradient ({x} {y} {z})  {}", three(point.gradient)),
        format!("Gradient length   {} a world unit", told_one(point.gradient.length())),
        format!(
            "Opacity           {} in {} world units",
            told_one(point.opacity),
            plain_number(report.unit_distance)
        ),
    ];
    if point.met != Met::Asked {
        lines.push(format!("Seen              {}", met_words(point.met, &share)));
    }
    lines.extend(vector_lines(report));
    lines.join("\n")
}

/// Numbers of one kind to six decimals, or all by powers of ten where these would be nothing but zeros, or mostly made up.
fn told<const N: usize>(numbers: [f64; N]) -> [String; N] {
    let greatest = numbers.iter().map(|n| n.abs()).fold(0.0, f64::max);
    let is_plain = greatest == 0.0 || !greatest.is_finite() || (1e-3..1e9).contains(&greatest);
    numbers.map(|n| if is_plain { format!("{n:.6}") } else { format!("{n:.6e}") })
}

fn told_one(number: f64) -> String {
    let [told] = told([number]);
    told
}

/// The nearest vector of each field.
fn vector_lines(report: &Report) -> Vec<String> {
    let [x, y, z] = report.axes;
    let found = report.point.iter().flat_map(|point| &point.vectors);
    let lines = found.flat_map(|found| {
        let ReportedVector { field, place, vector, length, .. } = found;
        let [u, v, w] = told(*vector);
        let length = told_one(*length);
        let place = match place {
            VectorPlace::Index([i, j, k]) => format!("nearest at index {i} {j} {k}"),
            VectorPlace::Cell(cell) => format!("in cell {cell}"),
        };
        [
            format!("Vector ({x} {y} {z})    {u} {v} {w}"),
            format!("Its length        {length}, of {field}, {place}"),
        ]
    });
    lines.collect()
}

/// In or on what a point is, and why it is this one.
fn met_words(met: Met, share: &str) -> String {
    let on = match met {
        Met::Maximum => return "at the greatest value of the ray".to_owned(),
        Met::Minimum => return "at the least value of the ray".to_owned(),
        Met::Matter => String::new(),
        Met::Vectors => "among vectors, ".to_owned(),
        surface => format!("on {}, ", surface.name()),
    };
    format!("{on}where the ray has gathered {share} % opacity")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_whatever_their_size() {
        assert_eq!(told([0.5, 0.0, -2e-9]), ["0.500000", "0.000000", "-0.000000"]);
        assert_eq!(told([2e-9, 0.0, -1e-9]), ["2.000000e-9", "0.000000e0", "-1.000000e-9"]);
        assert_eq!((told_one(1e300), told_one(0.0)), ("1.000000e300".into(), "0.000000".into()));
        assert_eq!(
            (told_one(f64::NAN), told_one(123456789.5)),
            ("NaN".into(), "123456789.500000".into())
        );
    }
}
