//! The box around the volume, with ticks in world units along three of its edges.

use glam::{DVec2, DVec3};

use super::SMALL;
use super::primitives::{Area, FIGURE, Ink, Sheet};
use super::ticks::{Number, ticks};
use crate::core::Camera;
use crate::scene::{Scene, axis_letters};
use crate::volume::Lattice;

/// Length of a tick, and its distance to its number, ems.
const TICK: f64 = 0.4;
const GAP: f64 = 0.35;
/// Between two ticks at least, ems.
const BETWEEN: f64 = 4.0;
/// Edges shorter than this on the picture have no ticks, ems.
const SHORT: f64 = 6.0;
/// How far lines end before what else is there, ems.
const BESIDE_LINES: f64 = 0.2;
/// How plain the outline of the box is, and its edges before the volume.
const OUTLINE_OPACITY: f64 = 0.55;
const BEFORE_OPACITY: f64 = 0.3;
/// Numbers stand within the box only where so many more of them have room there.
const WORTH_WITHIN: usize = 2;
/// What is nearer to the eye than this part of the focal point's distance is cut off.
const NEAR: f64 = 1e-3;

/// A box along the world's axes, as a camera sees it.
struct Seen<'a> {
    low: DVec3,
    high: DVec3,
    camera: &'a Camera,
    size: [f64; 2],
    /// For the lower and the upper face across each axis, whether it is seen from outside.
    facing: [[bool; 2]; 3],
}

/// An edge of the box: along `axis`, at the lower or upper end of the two others in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    axis: usize,
    ends: [usize; 2],
}

impl<'a> Seen<'a> {
    fn new(lattice: &Lattice, camera: &'a Camera, size: DVec2) -> Self {
        let [low, high] = lattice.world_bounds();
        let facing = [0, 1, 2].map(|axis: usize| {
            [0, 1].map(|end: usize| {
                let face = if end == 0 { low[axis] } else { high[axis] };
                let outwards = if end == 0 { -1.0 } else { 1.0 };
                let to_eye = match camera.eye_distance() {
                    None => -camera.direction[axis],
                    Some(_) => camera.view_origin()[axis] - face,
                };
                // Faces seen from their edge are not seen.
                let scale = (high - low).length() * 1e-9;
                let least = if camera.eye_distance().is_some() { scale } else { 1e-9 };
                outwards * to_eye > least
            })
        });
        Self { low, high, camera, size: size.to_array(), facing }
    }

    /// The two axes across one, in their order.
    fn across(axis: usize) -> [usize; 2] {
        [[1, 2], [0, 2], [0, 1]][axis]
    }

    /// The point of an edge at a world coordinate along its axis.
    fn at(&self, edge: Edge, coordinate: f64) -> DVec3 {
        let mut point = DVec3::ZERO;
        point[edge.axis] = coordinate;
        for (axis, end) in Self::across(edge.axis).into_iter().zip(edge.ends) {
            point[axis] = if end == 0 { self.low[axis] } else { self.high[axis] };
        }
        point
    }

    /// Faces beside an edge that are seen: on none it is hidden, on one it is part of the outline.
    fn seen_beside(&self, edge: Edge) -> usize {
        let beside = Self::across(edge.axis).into_iter().zip(edge.ends);
        beside.filter(|(axis, end)| self.facing[*axis][*end]).count()
    }

    /// Where a world point is on the picture; `None` at or behind the eye.
    fn pixel(&self, world: DVec3) -> Option<DVec2> {
        let view = self.camera.to_view(world);
        let is_near = self.camera.eye_distance().is_some_and(|distance| view.z < NEAR * distance);
        self.camera.pixel_from_view(view, self.size).filter(|_| !is_near)
    }

    /// An edge on the picture, without what is behind the eye.
    fn line(&self, edge: Edge) -> Option<[DVec2; 2]> {
        let ends = [self.low, self.high].map(|corner| self.at(edge, corner[edge.axis]));
        let Some(distance) = self.camera.eye_distance() else {
            return Some([self.pixel(ends[0])?, self.pixel(ends[1])?]);
        };
        let depths = ends.map(|end| self.camera.to_view(end).z);
        // A little farther, so that rounding leaves the ends before the eye.
        let near = 1.001 * NEAR * distance;
        let cut = |i: usize| {
            let (here, there) = (depths[i], depths[1 - i]);
            match here >= near {
                true => Some(ends[i]),
                false if there >= near => {
                    let share = (near - here) / (there - here);
                    Some(ends[i].lerp(ends[1 - i], share))
                }
                false => None,
            }
        };
        Some([self.pixel(cut(0)?)?, self.pixel(cut(1)?)?])
    }

    fn edges() -> impl Iterator<Item = Edge> {
        (0..3).flat_map(|axis| (0..4).map(move |i| Edge { axis, ends: [i & 1, i >> 1] }))
    }
}

/// An edge that ticks and numbers may stand along.
struct Ruler {
    edge: Edge,
    /// Away from the box.
    outwards: DVec2,
    /// Ticks on the picture: where, and their numbers.
    marks: Vec<(DVec2, Number)>,
}

/// Lays the box and its ticks out; whether there is any of it on the picture, and in a small one whether
/// nothing else stands in its way.
pub(super) fn lay_out(sheet: &mut Sheet<'_>, scene: &Scene, space: Option<&str>) -> bool {
    let size = sheet.picture.size();
    let seen = Seen::new(&scene.lattice(), &scene.camera, size);
    let is_small = size.min_element() < SMALL * sheet.em;
    let mut lines = Seen::edges().filter(|edge| seen.seen_beside(*edge) > 0);
    if is_small && lines.any(|edge| seen.line(edge).is_some_and(|line| is_crossed(sheet, line))) {
        return false;
    }
    let mut is_seen = false;
    // What lies behind the volume would be drawn before it.
    for (faces, opacity) in [(2, BEFORE_OPACITY), (1, OUTLINE_OPACITY)] {
        let ink = Ink { opacity, ..sheet.inks.ink };
        for edge in Seen::edges().filter(|edge| seen.seen_beside(*edge) == faces) {
            if let Some(line) = seen.line(edge) {
                is_seen |= free_line(sheet, line, ink);
            }
        }
    }
    let letters = axis_letters(space);
    let unit = scene.volume().and_then(|volume| volume.unit.as_deref());
    let rulers: Vec<Ruler> = (0..3).filter_map(|axis| ruler(sheet, &seen, axis)).collect();
    for ruler in &rulers {
        let name = ["x", "y", "z"][ruler.edge.axis];
        let letter = letters[ruler.edge.axis];
        let title = if letter == name { name.to_owned() } else { format!("{name} ({letter})") };
        let title = unit.map_or(title.clone(), |unit| format!("{title}, {unit}"));
        write(sheet, &seen, ruler, &title);
    }
    is_seen
}

/// Whether something that was laid out before stands in the way of a line.
fn is_crossed(sheet: &Sheet<'_>, ends: [DVec2; 2]) -> bool {
    sheet.taken().any(|taken| taken.grown(BESIDE_LINES * sheet.em).part_of(ends).is_some())
}

/// A line where nothing stands that was laid out before; whether any of it is on the picture.
fn free_line(sheet: &mut Sheet<'_>, ends: [DVec2; 2], ink: Ink) -> bool {
    let around = sheet.picture.grown(4.0 * sheet.hair());
    let Some(part) = around.part_of(ends) else { return false };
    let mut parts = vec![part];
    for taken in sheet.taken() {
        let Some([enter, leave]) = taken.grown(BESIDE_LINES * sheet.em).part_of(ends) else {
            continue;
        };
        parts = parts
            .into_iter()
            .flat_map(|[a, b]| [[a, b.min(enter)], [a.max(leave), b]])
            .filter(|[a, b]| a < b)
            .collect();
    }
    let at = |share: f64| ends[0].lerp(ends[1], share);
    for [a, b] in parts {
        sheet.line([at(a), at(b)], sheet.hair(), ink);
    }
    true
}

/// The edge along an axis whose numbers are read best: one of the outline, with the most of its ticks
/// on the picture, below the box rather than above it, and at its left rather than its right.
fn ruler(sheet: &Sheet<'_>, seen: &Seen<'_>, axis: usize) -> Option<Ruler> {
    let middle = seen.pixel(seen.low.midpoint(seen.high));
    let candidates = Seen::edges()
        .filter(|edge| edge.axis == axis && seen.seen_beside(*edge) == 1)
        .filter_map(|edge| {
            let ends = seen.line(edge)?;
            let along = (ends[1] - ends[0]).try_normalize()?;
            let part = sheet.picture.part_of(ends)?;
            let length = (ends[1] - ends[0]).length();
            if length * (part[1] - part[0]) < SHORT * sheet.em {
                return None;
            }
            let across = along.perp();
            let inwards = middle? - ends[0];
            let outwards = if across.dot(inwards) > 0.0 { -across } else { across };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few")]
            let most = (length / (BETWEEN * sheet.em)).clamp(1.0, 400.0) as u32;
            let placed = |marks: Vec<(f64, Number)>| -> Vec<(DVec2, Number)> {
                let marks = marks.into_iter();
                let on_edge =
                    marks.filter_map(|(at, number)| Some((seen.pixel(seen.at(edge, at))?, number)));
                on_edge
                    .filter(|(at, _)| sheet.picture.holds(&Area { low: *at, high: *at }))
                    .collect()
            };
            let ends = [seen.low[axis], seen.high[axis]];
            let mut marks = placed(ticks(ends[0], ends[1], most));
            if marks.len() < 2 {
                marks = placed(ends.map(|end| (end, Number::alone(end))).to_vec());
            }
            // What ties is decided by the edge's number, so that it stays where it is.
            let liking = marks.len().min(3) as f64 + 0.9 * outwards.y - 0.6 * outwards.x;
            // One number alone tells no scale.
            (marks.len() > 1).then_some((liking, Ruler { edge, outwards, marks }))
        });
    let better = |a: (f64, Ruler), b: (f64, Ruler)| if b.0 > a.0 + 1e-6 { b } else { a };
    candidates.reduce(better).map(|(_, ruler)| ruler)
}

/// Room for words of a size beside a point, so far from it.
fn beside(at: DVec2, towards: DVec2, distance: f64, size: DVec2) -> Area {
    let reach = (towards.abs() * size).element_sum() / 2.0;
    let middle = at + towards * (distance + reach);
    Area::new(middle - size / 2.0, size)
}

/// Ticks, numbers and the axis' name: outside the box where they have room there, or else within.
fn write(sheet: &mut Sheet<'_>, seen: &Seen<'_>, ruler: &Ruler, title: &str) {
    let (em, hair) = (sheet.em, sheet.hair());
    let (ink, colour) = (sheet.inks.ink, sheet.inks.axes[ruler.edge.axis]);
    let sizes: Vec<DVec2> = ruler.marks.iter().map(|(_, n)| sheet.number_size(n)).collect();
    let places = |towards: DVec2| -> Vec<Area> {
        let marks = ruler.marks.iter().zip(&sizes);
        marks.map(|((at, _), size)| beside(*at, towards, (TICK + GAP) * em, *size)).collect()
    };
    let fitting = |areas: &[Area]| areas.iter().filter(|area| sheet.is_free(area)).count();
    let (outside, inside) = (places(ruler.outwards), places(-ruler.outwards));
    let (towards, areas) = match fitting(&inside) >= fitting(&outside) + WORTH_WITHIN {
        true => (-ruler.outwards, inside),
        false => (ruler.outwards, outside),
    };
    // The name beyond the middle of the numbers, or beyond the upper end of the axis.
    let extent = DVec2::new(em * (sheet.width_of)(title), FIGURE * em);
    let depth = sizes.iter().map(|s| (towards.abs() * *s).element_sum()).fold(0.0, f64::max);
    if let Some([a, b]) = seen.line(ruler.edge) {
        let part = sheet.picture.part_of([a, b]).unwrap_or([0.0, 1.0]);
        let middle = a.lerp(b, f64::midpoint(part[0], part[1]));
        let along = (b - a).normalize_or_zero();
        let beyond = (TICK + 2.0 * GAP) * em + depth;
        let candidates = [
            beside(middle, towards, beyond + 0.3 * em, extent),
            beside(b, along, 0.8 * em, extent),
            beside(a, -along, 0.8 * em, extent),
            beside(middle, -towards, GAP * em, extent),
        ];
        if let Some(area) = candidates.into_iter().find(|area| sheet.is_free(area)) {
            sheet.take(area);
            sheet.words(DVec2::new(area.low.x, area.high.y), title, 1.0, colour);
        }
    }
    for ((at, number), area) in ruler.marks.iter().zip(areas) {
        let tick = [*at, *at + towards * TICK * em];
        let box_of_tick = Area { low: tick[0].min(tick[1]), high: tick[0].max(tick[1]) };
        if sheet.taken().all(|taken| !taken.meets(&box_of_tick)) {
            sheet.line(tick, hair, ink);
        }
        if sheet.is_free(&area) {
            sheet.take(area);
            sheet.number(DVec2::new(area.low.x, area.high.y), number, ink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Projection;

    const SIZE: DVec2 = DVec2::new(400.0, 300.0);

    fn camera(direction: DVec3) -> Camera {
        Camera::new(DVec3::splat(4.5), direction, DVec3::Z, 10.0)
    }

    fn counts(camera: &Camera) -> [usize; 3] {
        let lattice = Lattice::unit([10; 3]);
        let seen = Seen::new(&lattice, camera, SIZE);
        let mut counts = [0; 3];
        for edge in Seen::edges() {
            counts[seen.seen_beside(edge)] += 1;
        }
        counts
    }

    #[test]
    fn a_corner_view_has_six_edges_in_its_outline_three_before_and_three_behind() {
        let mut camera = camera(DVec3::new(-0.5, 0.7, -0.4));
        assert_eq!(counts(&camera), [3, 6, 3]);
        camera.projection = Projection::Perspective { view_angle: 0.7 };
        assert_eq!(counts(&camera), [3, 6, 3]);
    }

    #[test]
    fn from_the_front_the_outline_is_one_face_and_from_within_nothing_is_before_anything() {
        let mut camera = camera(DVec3::Y);
        assert_eq!(counts(&camera), [8, 4, 0]);
        camera.parallel_scale = 0.5;
        camera.projection = Projection::Perspective { view_angle: 1.0 };
        assert_eq!(counts(&camera), [12, 0, 0]);
    }

    #[test]
    fn what_lies_behind_the_eye_is_cut_off() {
        // The eye is within the slab of the box along y, and left of it.
        let mut camera = camera(DVec3::Y);
        camera.projection = Projection::Perspective { view_angle: 1.0 };
        camera.focal_point = DVec3::new(-4.0, 12.0, 4.5);
        camera.parallel_scale = 5.0;
        let lattice = Lattice::unit([10; 3]);
        let seen = Seen::new(&lattice, &camera, SIZE);
        let edge = Edge { axis: 1, ends: [0, 0] };
        let eye = camera.view_origin();
        assert!(seen.low.y < eye.y && eye.y < seen.high.y, "{eye}");
        let [a, b] = seen.line(edge).unwrap();
        assert!(a.is_finite() && b.is_finite());
        // Its far end is where it is; its near end lies on its way there.
        let far = seen.pixel(seen.at(edge, seen.high.y)).unwrap();
        assert!((b - far).length() < 1e-9);
        let on_line = seen.pixel(seen.at(edge, eye.y + 1.0)).unwrap();
        assert!((on_line - b).perp_dot(a - b).abs() < 1e-6 * (a - b).length());
        assert!(seen.pixel(seen.at(edge, seen.low.y)).is_none());
    }
}
