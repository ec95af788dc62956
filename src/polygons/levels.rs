//! Triangles cut along where numbers on them have some levels, so that what is no straight line of a number becomes one in each part.

use glam::Vec3;

use super::Triangle;

/// A corner of a part, with its number.
#[derive(Clone, Copy)]
struct Corner {
    place: Vec3,
    normal: Vec3,
    value: f32,
}

/// A triangle and the numbers at its corners.
pub type Numbered = (Triangle, [f32; 3]);

/// A triangle in parts within each of which its numbers, linear between the corners, lie between two of some rising levels: the
/// first, and the others. One without a finite number at each corner is whole. Triangles that share an edge are cut at the same
/// places of it.
pub fn between_levels((triangle, values): Numbered, levels: &[f32]) -> (Numbered, Vec<Numbered>) {
    let whole = ((triangle, values), Vec::new());
    if !values.iter().all(|value| value.is_finite()) {
        return whole;
    }
    let [least, most] =
        values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
    let first = levels.partition_point(|level| *level <= least);
    let passed = levels[first..].iter().take_while(|level| **level < most);
    let mut rest: Vec<Corner> = (0..3)
        .map(|i| Corner {
            place: triangle.corners[i],
            normal: triangle.normals[i],
            value: values[i],
        })
        .collect();
    let mut parts = Vec::new();
    let mut add = |corners: &[Corner]| {
        for i in 2..corners.len() {
            let own = [corners[0], corners[i - 1], corners[i]];
            let part = Triangle {
                corners: own.map(|corner| corner.place),
                normals: own.map(|corner| corner.normal),
                ..triangle
            };
            parts.push((part, own.map(|corner| corner.value)));
        }
    };
    for level in passed {
        let (mut below, mut above) = (Vec::with_capacity(5), Vec::with_capacity(5));
        for (i, corner) in rest.iter().enumerate() {
            let next = rest[(i + 1) % rest.len()];
            if corner.value <= *level {
                below.push(*corner);
            }
            if corner.value >= *level {
                above.push(*corner);
            }
            if (corner.value < *level) != (next.value < *level)
                && corner.value != *level
                && next.value != *level
            {
                let at = between(*corner, next, *level);
                below.push(at);
                above.push(at);
            }
        }
        add(&below);
        rest = above;
    }
    add(&rest);
    let mut parts = parts.into_iter();
    match parts.next() {
        Some(first) => (first, parts.collect()),
        None => whole,
    }
}

/// Where an edge has a level: from its lesser end, whichever way round it is.
fn between(a: Corner, b: Corner, level: f32) -> Corner {
    let (low, high) = if a.value < b.value { (a, b) } else { (b, a) };
    let share = (level - low.value) / (high.value - low.value);
    let normal = low.normal.lerp(high.normal, share);
    Corner {
        place: low.place.lerp(high.place, share),
        normal: normal.try_normalize().unwrap_or(low.normal),
        value: level,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Triangle {
        let corners = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y];
        Triangle { corners, normals: [Vec3::Z; 3], colours: None }
    }

    fn all((first, rest): (Numbered, Vec<Numbered>)) -> Vec<Numbered> {
        [vec![first], rest].concat()
    }

    #[test]
    fn parts_fill_the_triangle_and_lie_between_two_levels_each() {
        let levels = [-1.0, 0.0, 0.25, 0.5, 0.75, 1.0, 2.0];
        for values in [[0.0, 1.0, 0.6], [0.5, 0.5, 1.0], [1.7, -0.3, 0.25], [0.3, 0.31, 0.32]] {
            let parts = all(between_levels((triangle(), values), &levels));
            let mut area = 0.0;
            for (part, own) in &parts {
                let [a, b, c] = part.corners;
                let cross = (b - a).cross(c - a);
                assert!(cross.z >= -1e-6, "it goes round the same way");
                area += cross.z / 2.0;
                let [low, high] = [0, 1].map(|end| {
                    own.iter().copied().fold(own[0], if end == 0 { f32::min } else { f32::max })
                });
                assert!(!levels.iter().any(|l| *l > low && *l < high), "{values:?}: {own:?}");
                // Numbers are linear in the place: v0 + (v1 − v0) x/2 + (v2 − v0) y.
                for (place, value) in part.corners.iter().zip(own) {
                    let [v0, v1, v2] = values;
                    let expected = v0 + (v1 - v0) * place.x / 2.0 + (v2 - v0) * place.y;
                    assert!((expected - value).abs() < 1e-5, "{values:?}");
                }
            }
            assert!((area - 1.0).abs() < 1e-5, "{values:?}: {area}");
        }
        assert_eq!(all(between_levels((triangle(), [0.3, 0.31, 0.32]), &levels)).len(), 1);
        // Two levels within: a triangle, one or two strips of two, a triangle.
        assert!(all(between_levels((triangle(), [0.1, 0.6, 0.2]), &levels)).len() >= 4);
    }

    #[test]
    fn what_has_no_number_somewhere_is_whole() {
        for values in [[f32::NAN, 0.0, 1.0], [0.0, f32::INFINITY, 1.0], [0.5; 3]] {
            let found = all(between_levels((triangle(), values), &[0.25, 0.5, 0.75]));
            assert!(found.len() == 1 && found[0].0 == triangle(), "{values:?}");
        }
    }

    #[test]
    fn an_edge_is_cut_at_the_same_places_from_both_sides() {
        let levels: Vec<f32> = (0..32).map(|i| i as f32 / 31.0).collect();
        let [a, b] = [Vec3::new(0.1, 0.7, 0.3), Vec3::new(3.3, 0.9, 1.7)];
        let beside = |corners: [Vec3; 3], values: [f32; 3]| {
            let own = Triangle { corners, ..triangle() };
            let parts = all(between_levels((own, values), &levels));
            let on_edge = |place: &Vec3| (b - a).cross(*place - a).length() < 1e-5;
            let mut found: Vec<[u32; 3]> = parts
                .iter()
                .flat_map(|(part, _)| part.corners)
                .filter(on_edge)
                .map(|place| place.to_array().map(f32::to_bits))
                .collect();
            found.sort_unstable();
            found.dedup();
            found
        };
        let one = beside([a, b, Vec3::new(0.0, 5.0, 0.0)], [0.03, 0.97, 0.4]);
        let other = beside([b, a, Vec3::new(0.0, -5.0, 0.0)], [0.97, 0.03, 0.8]);
        assert!(one.len() > 20 && one == other, "{} {}", one.len(), other.len());
    }
}
