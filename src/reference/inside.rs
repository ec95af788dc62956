//! What is kept of a ray where a volume is cut open, and what it meets there, in float64.

use glam::DVec3;
use serde::Serialize;

use super::cells::Cells;
use super::classes::Classes;
use super::field::Field;
use super::quadrature::Density;
use super::shading::Shader;
use super::sources::Line;
use super::truth::domain;
use crate::scene::{AlongRay, CutFaces, Inside, Scene, edge_colour};
use crate::volume::Lattice;

/// What of a scene a ray meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Met {
    /// What has depth.
    Matter,
    /// Matter where it is cut.
    CutFace,
    /// Values on a plane.
    Slice,
    /// Where values pass a level.
    Isosurface,
    /// A triangle.
    Polygon,
    /// Vectors, where these are shown alone.
    Vectors,
    /// The ray's greatest value.
    Maximum,
    /// Its least.
    Minimum,
    /// Nothing: the place was asked for by itself.
    Asked,
}

impl Met {
    /// What it is, for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Matter => "matter",
            Self::CutFace => "a cut face",
            Self::Slice => "a slice",
            Self::Isosurface => "an isosurface",
            Self::Polygon => "a polygon",
            Self::Vectors => "vectors",
            Self::Maximum => "the greatest value",
            Self::Minimum => "the least value",
            Self::Asked => "the place asked for",
        }
    }
}

/// Something without depth that a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surface {
    pub(super) of: Met,
    pub(super) t: f64,
    pub(super) opacity: f64,
    /// Linear.
    pub(super) colour: [f64; 3],
}

/// A layer of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Layer {
    /// Densities × length.
    Matter(Density),
    /// Without length.
    Surface(Surface),
}

/// The part of a ray that is looked at.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) ends: [f64; 2],
    /// From the eye inwards.
    pub(super) surfaces: Vec<Surface>,
}

impl Part {
    /// A part of a ray, perhaps none, with polygons among what lies there.
    pub(super) fn among(part: Option<Self>, polygons: Vec<Surface>) -> Self {
        let mut part = part.unwrap_or(Self { ends: [0.0; 2], surfaces: Vec::new() });
        part.surfaces.extend(polygons);
        part.surfaces.sort_by(|p, q| p.t.total_cmp(&q.t));
        part
    }
}

/// What a scene is opened by.
pub(super) struct Opening {
    inside: Inside,
    lattice: Lattice,
    lights: Option<Shader>,
}

impl Opening {
    pub(super) fn of(scene: &Scene) -> Self {
        let lights = Shader::of_surfaces(scene);
        Self { inside: scene.inside_in_place(), lattice: scene.lattice(), lights }
    }

    /// The same, of what pictures of the scene's mode show.
    pub(super) fn as_shown(scene: &Scene) -> Self {
        Self { inside: scene.inside.shown_by(&scene.splat), ..Self::of(scene) }
    }

    /// Whether a slice shows the edges of cells.
    pub(super) fn has_edges(&self) -> bool {
        self.inside.slices.iter().any(|slice| slice.edges)
    }

    /// What stands for a ray, if not its light.
    pub(super) fn projects(&self) -> Option<AlongRay> {
        Some(self.inside.along).filter(|along| *along != AlongRay::Composite)
    }

    /// What is kept of the part a..b of a ray; the first may be beyond the last. `world` and `index` are the
    /// same line; `is_cut` where it begins where something is cut.
    pub(super) fn kept(
        &self,
        world: &Line,
        index: &Line,
        [mut a, mut b]: [f64; 2],
        is_cut: &mut bool,
    ) -> [f64; 2] {
        let clip = &self.inside.clip;
        if let Some(bounds) = clip.bounds {
            // The box in fractions of its own: along each axis where the ray has come so far.
            let size = DVec3::from(self.lattice.dims.map(|n| n as f64));
            let [start, step] = [(index.start + 0.5) / size, index.step / size];
            for axis in 0..3 {
                let sides = [(bounds.low[axis], 1.0), (bounds.high[axis], -1.0)];
                for (face, way) in sides {
                    if (way > 0.0 && face <= 0.0) || (way < 0.0 && face >= 1.0) {
                        continue;
                    }
                    keep((start[axis] - face) * way, step[axis] * way, &mut a, &mut b, is_cut);
                }
            }
        }
        for plane in &clip.planes {
            let height = (world.start - plane.point).dot(plane.normal);
            keep(height, world.step.dot(plane.normal), &mut a, &mut b, is_cut);
        }
        [a, b]
    }

    /// What is left of a ray; `None` where nothing is. `world` and `index` are the same line; `beside` are rays half a pixel
    /// from it on four sides, in the world, where edges of cells are to be seen.
    pub(super) fn part(
        &self,
        (field, classes): (&Field, &Classes),
        (world, index): (&Line, &Line),
        beside: &[Line],
    ) -> Option<Part> {
        let mut is_cut = false;
        let [a, b] = self.kept(world, index, domain(field.dims, index)?, &mut is_cut);
        let clip = &self.inside.clip;
        if a >= b {
            return None;
        }
        let mut surfaces = Vec::new();
        if is_cut && clip.faces == CutFaces::Coloured {
            let place = index.at(a);
            let value = if field.is_hole(place) { Some(f64::NAN) } else { field.value(place) };
            let density = value.map(|value| classes.at(value)).filter(|d| d[0] > 0.0);
            surfaces.extend(density.map(|[w, r, g, b]| Surface {
                of: Met::CutFace,
                t: a,
                opacity: 1.0,
                colour: [r / w, g / w, b / w],
            }));
        }
        for slice in &self.inside.slices {
            let plane = slice.plane;
            let t = (plane.point - world.start).dot(plane.normal) / world.step.dot(plane.normal);
            let place = index.at(t);
            // Nowhere, where the ray runs along it.
            let is_in = t > a && t < b;
            let value = match field.is_hole(place) {
                true => Some(f64::NAN).filter(|_| is_in && classes.at(f64::NAN)[0] > 0.0),
                false => {
                    if is_in {
                        field.value(place)
                    } else {
                        None
                    }
                }
            };
            let shows = |value: &f64| !slice.only_shown || classes.at(*value)[0] > 0.0;
            let value = value.filter(shows);
            let opacity = slice.opacity;
            let of = Met::Slice;
            let share = match &field.cells {
                Some(cells) if slice.edges && value.is_some() => {
                    let number = |place| cells.find(place).map(|(solid, _)| cells.source(solid));
                    let own = number(place);
                    let is_other = |line: &&Line| {
                        let plane = slice.plane;
                        let t = (plane.point - line.start).dot(plane.normal)
                            / line.step.dot(plane.normal);
                        number(self.lattice.index_from_world(line.at(t))) != own
                    };
                    beside.iter().filter(is_other).count() as f64 / beside.len().max(1) as f64
                }
                _ => 0.0,
            };
            surfaces.extend(value.map(|v| {
                let colour = edge_colour(classes.colour(v), share);
                Surface { of, t, opacity, colour }
            }));
        }
        for iso in &self.inside.isosurfaces {
            let colour = iso.colour.map_or_else(|| classes.colour(iso.value), |c| c.to_linear().0);
            for t in passes(field, index, iso.value, [a, b]) {
                let place = index.at(t);
                if field.is_hole(place) {
                    continue;
                }
                let lit = |lights: &Shader| lights.surface(field, place, world, colour);
                let colour = self.lights.as_ref().map_or(colour, lit);
                let of = Met::Isosurface;
                surfaces.push(Surface { of, t, opacity: iso.opacity, colour });
            }
        }
        surfaces.sort_by(|p, q| p.t.total_cmp(&q.t));
        Some(Part { ends: [a, b], surfaces })
    }
}

/// Where the field passes a level on a part of a ray: looked for between places close together, and
/// halved until nothing is left to halve. Where cells overlap it may jump past one, which is no place.
fn passes(field: &Field, line: &Line, level: f64, [a, b]: [f64; 2]) -> Vec<f64> {
    /// A voxel, or less, is asked so often.
    const LOOKS: f64 = 24.0;
    let voxels = (b - a) * line.step.length();
    let count = (voxels * LOOKS).ceil().max(1.0) as usize;
    let above = |t: f64| field.value(line.at(t)).map(|value| value >= level);
    let place = |i: usize| a + (b - a) * i as f64 / count as f64;
    let mut places: Vec<f64> = (0..=count).map(place).collect();
    if field.has_borders {
        // On either side of each face: values bend there, and end.
        let beside = 1e-9 * (b - a);
        let faces = field.crossings(line, [a, b]);
        places.extend(faces.into_iter().flat_map(|t| [t - beside, t + beside]));
        places.sort_by(f64::total_cmp);
    }
    let sides: Vec<Option<bool>> = places.iter().map(|t| above(*t)).collect();
    let mut found = Vec::new();
    for (i, pair) in sides.windows(2).enumerate() {
        let [Some(first), Some(last)] = pair[..] else { continue };
        if first == last {
            continue;
        }
        let (mut low, mut high) = (places[i], places[i + 1]);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            match above(middle) {
                Some(side) if side == first => low = middle,
                _ => high = middle,
            }
        }
        // What jumps has it on neither side.
        let is_had =
            |cells: &Cells| [low, high].iter().any(|t| cells.has_level(line.at(*t), level));
        if field.cells.as_ref().is_none_or(is_had) {
            found.push(f64::midpoint(low, high));
        }
    }
    found
}

/// Shortens a..b to where height + t · growth ≥ 0; `is_cut` where that is what the ray enters by.
fn keep(height: f64, growth: f64, a: &mut f64, b: &mut f64, is_cut: &mut bool) {
    let t = -height / growth;
    if growth > 0.0 && t > *a {
        (*a, *is_cut) = (t, true);
    } else if growth < 0.0 && t < *b {
        *b = t;
    } else if growth == 0.0 && height < 0.0 {
        *b = *a;
    }
}

/// Matter of one density on a part of a ray, and the number of its slab.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slice {
    pub(super) slab: i64,
    pub(super) ends: [f64; 2],
    pub(super) density: Density,
}

/// Layers of pieces of matter of constant densities, from the eye inwards, and of the surfaces before,
/// in and behind them.
pub(super) fn woven(pieces: &[Slice], surfaces: &[Surface]) -> Vec<Layer> {
    let surfaces: Vec<_> = surfaces.iter().map(|s| (s.t, Layer::Surface(*s))).collect();
    woven_among(pieces, &surfaces)
}

/// The same of anything that has its place, from the eye inwards.
pub(super) fn woven_among(pieces: &[Slice], others: &[(f64, Layer)]) -> Vec<Layer> {
    let mut layers = Vec::new();
    let mut next = others.iter().copied().peekable();
    for &Slice { ends: [mut from, to], density, .. } in pieces {
        while let Some((t, other)) = next.next_if(|(t, _)| *t < to) {
            if t > from {
                layers.push(Layer::Matter(density.map(|w| w * (t - from))));
                from = t;
            }
            layers.push(other);
        }
        layers.push(Layer::Matter(density.map(|w| w * (to - from))));
    }
    layers.extend(next.map(|(_, other)| other));
    layers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_woven_in_where_they_are() {
        let of = Met::Slice;
        let surface = |t| Surface { of, t, opacity: 0.5, colour: [t; 3] };
        let piece = |ends, weight: f64| Slice { slab: 0, ends, density: [weight; 4] };
        let pieces = [piece([0.0, 1.0], 1.0), piece([3.0, 5.0], 2.0)];
        let found = woven(&pieces, &[-1.0, 0.25, 2.0, 4.0, 4.5, 9.0].map(surface));
        let matter = |length: f64| Layer::Matter([length; 4]);
        let expected = [
            Layer::Surface(surface(-1.0)),
            matter(0.25),
            Layer::Surface(surface(0.25)),
            matter(0.75),
            Layer::Surface(surface(2.0)),
            matter(2.0),
            Layer::Surface(surface(4.0)),
            matter(1.0),
            Layer::Surface(surface(4.5)),
            matter(1.0),
            Layer::Surface(surface(9.0)),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_ray_is_kept_where_it_is_above() {
        let kept = |height, growth| {
            let (mut a, mut b, mut is_cut) = (1.0, 5.0, false);
            keep(height, growth, &mut a, &mut b, &mut is_cut);
            (a, b, is_cut)
        };
        assert_eq!(kept(-4.0, 2.0), (2.0, 5.0, true));
        assert_eq!(kept(4.0, 2.0), (1.0, 5.0, false), "it was above before");
        assert_eq!(kept(6.0, -2.0), (1.0, 3.0, false));
        assert_eq!(kept(-6.0, -2.0).1, -3.0, "nothing is left");
        assert_eq!((kept(1.0, 0.0), kept(-1.0, 0.0)), ((1.0, 5.0, false), (1.0, 1.0, false)));
    }
}
