//! Which colour is which value, and how opaque that is.

use glam::DVec2;

use super::primitives::{Area, FIGURE, Ink, Primitive, Sheet};
use super::ticks::{Number, round_above, ticks};
use super::{MARGIN, scale_bar};
use crate::core::Srgb8;
use crate::core::colour::srgb_from_linear;
use crate::kernel::Kernel;
use crate::scene::{AlongRay, Index, PolygonLayer, Scene, Shading, VectorLayer};
use crate::transfer::{ColourSource, Kind, TransferFunction};
use crate::vector::{ColourBy, VectorSettings};
use crate::volume::{ScalarVolume, Statistics};

/// Height of the bar, as a part of the picture's height, and its limits, ems.
const SHARE: f64 = 0.55;
const LEAST_HEIGHT: f64 = 6.0;
const MOST_HEIGHT: f64 = 24.0;
/// Widths of the colours and of the opacities, ems.
const COLOURS: f64 = 1.2;
const OPACITIES: f64 = 2.6;
/// Length of a tick, and its distance to its number, ems.
const TICK: f64 = 0.35;
const GAP: f64 = 0.3;
/// How far to the left a first bar may reach, and each that stands beside it: parts of the picture's width.
const REACH: [f64; 3] = [0.66, 0.4, 0.2];
/// Between two bars, ems.
const BESIDE: f64 = 1.5;
/// Between two ticks at least, ems.
const BETWEEN: f64 = 3.0;
/// Height of the colour of one name at most, and of a number beside one at least, ems.
const NAME: f64 = 1.6;
const LEAST_NAME: f64 = 1.1;
/// Room above the bar for its title, and below it for what the opacities are, ems.
const ABOVE: f64 = 1.6;
const BELOW: f64 = 2.0;
/// Size of the words below, and greatest width of the title, ems.
const SMALL: f64 = 0.8;
const TITLE: f64 = 16.0;

/// What colours, and opacities where they are looked up by the same, are at an index.
struct Legend<'a> {
    title: String,
    range: [f64; 2],
    colour: Box<dyn Fn(f64) -> [f64; 3] + 'a>,
    opacity: Option<Box<dyn Fn(f64) -> f64 + 'a>>,
    /// Numbers that name things, where the values are such, from below: the index is the place in this list.
    names: Vec<f64>,
}

impl<'a> Legend<'a> {
    /// Of the scalar field, by the function that it is drawn with, where something of it is seen, and of each field of vectors. Where one of these
    /// has but one colour, that is no map, and gets a bar only where there is nothing else.
    fn all_of(scene: &'a Scene, drawn: Option<&'a TransferFunction>) -> Vec<Self> {
        let shows_field = scene.shows_field() && !shows_nothing(scene);
        let field = scene.volume().zip(drawn).filter(|_| shows_field);
        let field = field.map(|(volume, transfer)| Self::of(scene, volume, transfer));
        let mut all: Vec<Self> = field.into_iter().collect();
        for layer in scene.vectors() {
            if all.is_empty() || has_several(&layer.settings.transfer.colour) {
                all.push(Self::of_vectors(layer));
            }
        }
        // Where the field has a bar, it is that of the surfaces in its colours, too.
        let is_new = |layer: &PolygonLayer| layer.field_colours.is_none() || !shows_field;
        all.extend(scene.polygons().into_iter().filter(is_new).filter_map(Self::of_surface));
        all
    }

    /// Of polygons that are coloured by numbers on them.
    fn of_surface(layer: PolygonLayer) -> Option<Self> {
        let colours = layer.colours()?;
        let array = layer.mesh.arrays().get(layer.array()?)?;
        // Of lines and arrows there is more than one kind, and more than one length.
        let title = match array.name == "length" {
            true => format!("{}, length", layer.mesh.name()),
            false => array.name.clone(),
        };
        let [a, b] = colours.range();
        let within = |range: [f64; 2]| match (array.name == "length", array.range()) {
            (true, Some(own)) => within(range, own),
            _ => range,
        };
        let colour = Box::new(move |at: f64| colours.srgb_at(at).to_linear().0);
        let range = within([a.min(b), a.max(b)]);
        Some(Self { title, range, colour, opacity: None, names: Vec::new() })
    }

    /// Of the scalar field.
    fn of(scene: &'a Scene, volume: &ScalarVolume, transfer: &'a TransferFunction) -> Self {
        let shown = Shading::is_shown_by(&scene.splat);
        let table = scene.shading.reflection.as_ref().filter(|_| shown);
        let index = table.map_or(Index::Value, |table| table.index);
        let title = match index {
            Index::Value => match Kind::of(&volume.statistics).unit() {
                Some(unit) => format!("{}, {unit}", volume.name),
                None => volume.name.clone(),
            },
            Index::GradientStrength => format!("{}, gradient strength", volume.name),
            Index::GradientElevation => "gradient elevation, °".to_owned(),
            Index::GradientAzimuth => "gradient azimuth, °".to_owned(),
            Index::ViewDepth => "depth in the view".to_owned(),
        };
        let range = match table {
            Some(table) => [table.stops.first(), table.stops.last()]
                .map(|stop| stop.map_or(0.0, |(value, _)| *value)),
            None => transfer.colour.range(),
        };
        let statistics = &volume.statistics;
        let range = match [range[0].min(range[1]), range[0].max(range[1])] {
            // A step, of which either side is to be seen.
            [low, high] if low == high && index == Index::Value => {
                [low.min(statistics.min), high.max(statistics.max)]
            }
            range if index == Index::Value => within(range, [statistics.min, statistics.max]),
            range => range,
        };
        let opacities = scene.shading.opacity.as_ref().filter(|_| shown);
        // The greatest value along a ray is seen whatever its opacity.
        let projects = scene.inside.along != AlongRay::Composite;
        // Regions have different ones for one value.
        let by_value = !shown || scene.shading.painted().is_empty();
        let opacity: Option<Box<dyn Fn(f64) -> f64>> = match opacities {
            Some(table) if table.index == index && !has_none(&table.points) => {
                Some(Box::new(|at| table.at(at)))
            }
            None if index == Index::Value
                && by_value
                && !has_none(&transfer.opacity)
                && !projects =>
            {
                Some(Box::new(|at| transfer.opacity_at(at)))
            }
            _ => None,
        };
        let names = match table {
            None if scene.splat.kernel == Kernel::Nearest => names(transfer),
            _ => Vec::new(),
        };
        if !names.is_empty() {
            let range = [-0.5, names.len() as f64 - 0.5];
            let of_names = names.clone();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let name =
                move |at: f64| of_names[(at.round().max(0.0) as usize).min(of_names.len() - 1)];
            let colour = Box::new(move |at: f64| transfer.colour_at(name(at)).0);
            return Self { title, range, colour, opacity: None, names };
        }
        let colour: Box<dyn Fn(f64) -> [f64; 3]> = match table {
            Some(table) => Box::new(|at| table.at(at)),
            None => Box::new(|at| transfer.colour_at(at).0),
        };
        Self { title, range, colour, opacity, names }
    }

    fn of_vectors(layer: VectorLayer) -> Self {
        let VectorSettings { transfer, colour_by, opacity_by, .. } = layer.settings;
        let name = &layer.field.name;
        let title = match colour_by {
            ColourBy::Magnitude => format!("{name}, length"),
            ColourBy::X => "x".to_owned(),
            ColourBy::Y => "y".to_owned(),
            ColourBy::Z => "z".to_owned(),
            ColourBy::Scalar => format!("{name}, by scalar"),
        };
        let [a, b] = transfer.colour.range();
        let opacity: Option<Box<dyn Fn(f64) -> f64>> = match opacity_by == colour_by {
            true => {
                let transfer = transfer.clone();
                Some(Box::new(move |at| transfer.opacity_at(at)))
            }
            false => None,
        };
        let range = match colour_by {
            ColourBy::Magnitude => {
                let Statistics { min, max, .. } = layer.field.statistics;
                within([a.min(b), a.max(b)], [min, max])
            }
            _ => [a.min(b), a.max(b)],
        };
        let colour = Box::new(move |at| transfer.colour_at(at).0);
        Self { title, range, colour, opacity, names: Vec::new() }
    }

    /// The index at a height of 0..=1 over the lower end.
    fn at(&self, share: f64) -> f64 {
        self.range[0] * (1.0 - share) + self.range[1] * share
    }

    /// The height of an index over the lower end.
    fn share(&self, index: f64) -> f64 {
        let [low, high] = self.range;
        // Halved, so that ±1e308 does not overflow.
        let share = (index / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0);
        if share.is_nan() { 0.5 } else { share }
    }

    fn ink(&self, index: f64) -> Ink {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
        let byte = |linear: f64| (srgb_from_linear(linear).clamp(0.0, 1.0) * 255.0).round() as u8;
        Ink { colour: Srgb8((self.colour)(index).map(byte)), opacity: 1.0 }
    }
}

/// Colours without those of values that are nowhere.
fn within([low, high]: [f64; 2], [least, most]: [f64; 2]) -> [f64; 2] {
    let within = [low.max(least), high.min(most)];
    if within[0] < within[1] { within } else { [low, high] }
}

/// The names that have a colour each, where a function has nothing but such: steps, and one name between two of them.
fn names(transfer: &TransferFunction) -> Vec<f64> {
    let ColourSource::Stops(stops) = &transfer.colour else { return Vec::new() };
    let steps = stops.chunks(2).map(|step| match step {
        [(from, colour), (to, same)] if colour == same => Some(f64::midpoint(*from, *to)),
        _ => None,
    });
    steps.collect::<Option<Vec<f64>>>().unwrap_or_default()
}

/// Whether there are several colours, and so a map of them.
fn has_several(colours: &ColourSource) -> bool {
    match colours {
        ColourSource::Map { .. } => true,
        ColourSource::Stops(stops) => stops.windows(2).any(|pair| pair[0].1 != pair[1].1),
    }
}

/// Whether nothing of a scene has the field's colours: no opacity anywhere, and no surface.
fn shows_nothing(scene: &Scene) -> bool {
    let inside = scene.inside.shown_by(&scene.splat);
    let has_surfaces = !inside.isosurfaces.is_empty() || !inside.slices.is_empty();
    if has_surfaces || inside.along != AlongRay::Composite {
        return false;
    }
    let shown = Shading::is_shown_by(&scene.splat);
    match scene.shading.opacity.as_ref().filter(|_| shown) {
        Some(table) => has_none(&table.points),
        None if shown && !scene.shading.painted().is_empty() => false,
        None => scene.transfer().is_none_or(|transfer| has_none(&transfer.opacity)),
    }
}

/// Whether no point of opacities is above 0, and so nothing between or beyond them.
fn has_none(points: &[(f64, f64)]) -> bool {
    points.iter().all(|(_, alpha)| *alpha <= 0.0)
}

/// Lays it out at the right edge, above the scale bar where there `has_below`, and those of further fields
/// beside it, or else below one another; whether there is room, if need be where the scale bar would be, or
/// without the opacities. Where nothing has colours there is none.
pub(super) fn lay_out(sheet: &mut Sheet<'_>, scene: &Scene, has_below: bool) -> bool {
    let drawn = scene.drawn_transfer();
    let mut legends = Legend::all_of(scene, drawn.as_deref());
    let before = sheet.mark();
    for with_opacities in [true, false] {
        if !with_opacities {
            legends.iter_mut().for_each(|legend| legend.opacity = None);
        }
        for has_below in if has_below { &[true, false][..] } else { &[false] } {
            for lay_out_all in [lay_out_beside, lay_out_stacked] {
                if lay_out_all(sheet, &legends, *has_below) {
                    return true;
                }
                sheet.return_to(before);
            }
        }
    }
    false
}

/// What lies below the bars, ems.
fn room_below(has_below: bool) -> f64 {
    if has_below { scale_bar::HEIGHT + 1.0 } else { MARGIN }
}

/// The column at which the rightmost bar ends.
fn rightmost(sheet: &Sheet<'_>) -> f64 {
    (sheet.picture.size().x - MARGIN * sheet.em).round()
}

/// The first at the right, and each further one to the left of those before.
fn lay_out_beside(sheet: &mut Sheet<'_>, legends: &[Legend<'_>], has_below: bool) -> bool {
    let size = sheet.picture.size();
    let rows = Rows { from: 0.0, to: size.y, below: room_below(has_below), share: SHARE };
    let mut right = rightmost(sheet);
    legends.iter().zip(REACH).all(|(legend, reach)| {
        // The middle is for the picture; a further bar may come nearer to it.
        match lay_out_one(sheet, legend, &rows, [reach * size.x, right]) {
            Some(left) => {
                right = (left - BESIDE * sheet.em).round();
                true
            }
            None => false,
        }
    })
}

/// Each below those before, in pictures that are too narrow for them beside one another.
fn lay_out_stacked(sheet: &mut Sheet<'_>, legends: &[Legend<'_>], has_below: bool) -> bool {
    let size = sheet.picture.size();
    let below = room_below(has_below);
    let each = (size.y - below * sheet.em) / legends.len() as f64;
    let columns = [REACH[0] * size.x, rightmost(sheet)];
    legends.iter().enumerate().all(|(i, legend)| {
        let from = (i as f64 * each).round();
        let rows = Rows { from, to: from + each, below: 0.0, share: 1.0 };
        lay_out_one(sheet, legend, &rows, columns).is_some()
    })
}

/// Where a bar stands from top to bottom.
struct Rows {
    /// Rows of pixels that are its own.
    from: f64,
    to: f64,
    /// Room that is left free below it, ems.
    below: f64,
    /// Of its rows as much as it takes where nothing else limits it.
    share: f64,
}

/// Lays one out between two columns of pixels; the one where it begins, or `None` without room.
fn lay_out_one(
    sheet: &mut Sheet<'_>,
    legend: &Legend<'_>,
    &Rows { from, to, below, share }: &Rows,
    [least, right]: [f64; 2],
) -> Option<f64> {
    let em = sheet.em;
    let room = to - from - (MARGIN + ABOVE + BELOW + below) * em;
    let height = (share * (to - from)).min(MOST_HEIGHT * em).min(room).round();
    let height = match legend.names.len() {
        0 => height,
        count => height.min((count as f64 * NAME * em).max(LEAST_HEIGHT * em)),
    };
    if height < LEAST_HEIGHT * em {
        return None;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few")]
    let most = (height / (BETWEEN * em)) as u32;
    let ticks = match legend.names.len() {
        0 => ticks(legend.range[0], legend.range[1], most),
        // Each beside its colour, or where they are many, every second, and so on.
        count => {
            let apart = (count as f64 * LEAST_NAME * em / height).ceil().max(1.0) as usize;
            let all = legend.names.iter().enumerate().step_by(apart);
            all.map(|(i, name)| (i as f64, Number::alone(*name))).collect()
        }
    };
    let numbers = ticks.iter().map(|(_, number)| sheet.number_width(number)).fold(0.0, f64::max);
    let bar_right = (right - numbers - (TICK + GAP) * em).round();
    let bar_left = bar_right - (COLOURS * em).round();
    let left = bar_left - if legend.opacity.is_some() { (OPACITIES * em).round() } else { 0.0 };
    // In the middle, or as far up as what is below asks for.
    let lowest = to - (BELOW + below) * em - height;
    let highest = from + (MARGIN + ABOVE) * em;
    let top = (from + (to - from - height) / 2.0).min(lowest).max(highest).round();
    let title = elided(&legend.title, (TITLE * em).min(right - least) / em, sheet.width_of);
    let title_width = em * (sheet.width_of)(&title);
    let area = Area {
        low: DVec2::new(left.min(right - title_width), top - (ABOVE - 0.4) * em),
        high: DVec2::new(right, top + height + BELOW * em),
    };
    if left < least || !sheet.is_free(&area) {
        return None;
    }
    let begins = area.low.x;
    sheet.take(area);
    let ink = sheet.inks.ink;
    sheet.words(DVec2::new(right - title_width, top - 0.7 * em).round(), &title, 1.0, ink);
    let bar = Area { low: DVec2::new(bar_left, top), high: DVec2::new(bar_right, top + height) };
    if let Some(opacity) = &legend.opacity {
        let area = Area { low: DVec2::new(left, top), high: DVec2::new(bar_left, top + height) };
        opacities(sheet, legend, opacity, area);
    }
    colours(sheet, legend, bar);
    let y_of = |index: f64| top + (1.0 - legend.share(index)) * height;
    for (index, number) in &ticks {
        let y = y_of(*index);
        let ends = [DVec2::new(bar_right, y), DVec2::new(bar_right + TICK * em, y)];
        sheet.line(ends, sheet.hair(), ink);
        let at = DVec2::new(bar_right + (TICK + GAP) * em, y + FIGURE / 2.0 * em);
        sheet.number(at, number, ink);
    }
    Some(begins)
}

/// The colours, one row of pixels after another, and a frame around them.
fn colours(sheet: &mut Sheet<'_>, legend: &Legend<'_>, bar: Area) {
    let hair = sheet.hair();
    sheet.rectangle(bar.grown(2.0 * hair), Ink { opacity: 0.5, ..sheet.inks.halo });
    sheet.rectangle(bar.grown(hair), sheet.inks.ink);
    let height = bar.size().y;
    let (mut from, mut before) = (0.0, None);
    let mut row = 0.0;
    while row < height {
        let ink = legend.ink(legend.at(1.0 - (row + 0.5) / height));
        if let Some(same) = before.filter(|same| *same != ink) {
            push_rows(sheet, bar, [from, row], same);
            from = row;
        }
        before = Some(ink);
        row += 1.0;
    }
    if let Some(last) = before {
        push_rows(sheet, bar, [from, height], last);
    }
}

fn push_rows(sheet: &mut Sheet<'_>, bar: Area, [from, to]: [f64; 2], ink: Ink) {
    let area = Area {
        low: DVec2::new(bar.low.x, bar.low.y + from),
        high: DVec2::new(bar.high.x, bar.low.y + to),
    };
    sheet.rectangle(area, ink);
}

/// The opacities as a curve that grows away from the colours, up to a round opacity.
fn opacities(sheet: &mut Sheet<'_>, legend: &Legend<'_>, opacity: &dyn Fn(f64) -> f64, area: Area) {
    let (em, hair, ink) = (sheet.em, sheet.hair(), sheet.inks.ink);
    let size = area.size();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels")]
    let rows = size.y.max(1.0) as usize;
    let at_row = |row: f64| opacity(legend.at(1.0 - row / rows as f64)).clamp(0.0, 1.0);
    let found: Vec<f64> = (0..=rows).map(|row| at_row(row as f64)).collect();
    let most = round_above(found.iter().copied().fold(0.0, f64::max).max(1e-6));
    sheet.rectangle(area, Ink { opacity: 0.45, ..sheet.inks.halo });
    let x_of = |alpha: f64| area.high.x - alpha / most * (size.x - 2.0 * hair);
    let y_of = |row: usize| area.low.y + row as f64 / rows as f64 * size.y;
    for row in 0..rows {
        let alpha = f64::midpoint(found[row], found[row + 1]);
        if alpha > 0.0 {
            let low = DVec2::new(x_of(alpha), y_of(row));
            let rest = Area { low, high: DVec2::new(area.high.x, y_of(row + 1)) };
            sheet.rectangle(rest, Ink { opacity: 0.3, ..ink });
        }
    }
    let points: Vec<DVec2> =
        found.iter().enumerate().map(|(row, alpha)| DVec2::new(x_of(*alpha), y_of(row))).collect();
    for ends in straightened(&points) {
        sheet.primitives.push(Primitive::Line { ends, width: 1.3 * hair, ink });
    }
    let faint = Ink { opacity: 0.4, ..ink };
    let corner = DVec2::new(area.low.x, area.high.y);
    let left = Area { low: area.low, high: DVec2::new(area.low.x + hair, area.high.y) };
    let lower = Area { low: corner - DVec2::new(0.0, hair), high: area.high };
    sheet.rectangle(left, faint);
    sheet.rectangle(Area { low: lower.low + DVec2::new(hair, 0.0), ..lower }, faint);
    // What its edges are.
    let small = SMALL * em;
    let y = area.high.y + (0.45 + FIGURE * SMALL) * em;
    let number = Number::alone(most);
    let least = Number::alone(0.0);
    let width = |text: &str| small * (sheet.width_of)(text);
    let zero_at = area.high.x - width(&least.text) / 2.0;
    sheet.scaled_number(DVec2::new(area.low.x, y), &number, SMALL, ink);
    if number.raised.is_empty() {
        sheet.words(DVec2::new(zero_at, y), &least.text, SMALL, ink);
    }
    let below = DVec2::new(area.low.x, y + 1.15 * small);
    sheet.words(below, "opacity", SMALL, ink);
}

/// The fewest straight lines through points, to a quarter of a pixel.
fn straightened(points: &[DVec2]) -> Vec<[DVec2; 2]> {
    let mut lines = Vec::new();
    let mut first = 0;
    while first + 1 < points.len() {
        let is_straight = |last: usize| {
            let (a, along) = (points[first], points[last] - points[first]);
            let length = along.length();
            points[first..=last]
                .iter()
                .all(|p| length > 0.0 && (along.perp_dot(*p - a) / length).abs() < 0.25)
        };
        let mut last = first + 1;
        while last + 1 < points.len() && is_straight(last + 1) {
            last += 1;
        }
        lines.push([points[first], points[last]]);
        first = last;
    }
    lines
}

/// Words no wider than so many ems, with an ellipsis where they are cut.
fn elided(text: &str, most: f64, width_of: &dyn Fn(&str) -> f64) -> String {
    if width_of(text) <= most {
        return text.to_owned();
    }
    let letters: Vec<char> = text.chars().collect();
    let cut = |n: usize| letters[..n].iter().chain(&['…']).collect::<String>();
    let fitting = (0..letters.len()).rev().find(|&n| width_of(&cut(n)) <= most);
    cut(fitting.unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_titles_end_in_an_ellipsis() {
        let width = |text: &str| text.chars().count() as f64;
        assert_eq!(elided("density", 7.0, &width), "density");
        assert_eq!(elided("density", 6.0, &width), "densi…");
        assert_eq!(elided("density", 0.0, &width), "…");
    }

    #[test]
    fn few_lines_go_through_many_points_on_them() {
        let bent: Vec<DVec2> =
            (0..=100).map(|i: i32| DVec2::new(f64::from((i - 40).abs()), f64::from(i))).collect();
        let lines = straightened(&bent);
        assert_eq!(lines, [[bent[0], bent[40]], [bent[40], bent[100]]]);
        assert!(straightened(&bent[..1]).is_empty());
    }
}
