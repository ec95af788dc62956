//! Triangles where they lie: in the world, and their corners as a camera sees them.

use glam::{DVec2, DVec3, Vec3};

use super::A_RUN;
use super::meeting::Eye;
use crate::core::{Camera, Cancelled, Srgb8, Ticket, parallel};
use crate::native::in_order::look;
use crate::scene::{PolygonLayer, View};

/// Corners that a triangle may share with those before it are looked for among so many.
pub(super) const LOOKED_BACK: usize = 20;

/// The triangles of layers in the world, one layer after the other. Neighbours share most corners, and what a view asks of a corner it
/// asks once.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub(super) layers: Vec<PolygonLayer>,
    /// Corners, from the origin of their mesh.
    pub(super) places: Vec<Vec3>,
    /// Where the places of each layer end.
    pub(super) ends: Vec<usize>,
    /// Three places a triangle.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) looks: Vec<Painted>,
}

/// What a triangle looks like at its corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Painted {
    pub(super) normals: [[f32; 3]; 3],
    pub(super) colours: [Srgb8; 3],
    pub(super) layer: u32,
}

/// A corner in view space.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Corner {
    /// To the right, up, and how deep beyond the frame's centre, pixels.
    pub(super) at: DVec3,
    /// Where it is on the picture, from the middle, pixels; anywhere for one behind the eye.
    pub(super) on_picture: DVec2,
}

impl Placed {
    pub(super) fn of(layers: Vec<PolygonLayer>, ticket: &Ticket) -> Result<Self, Cancelled> {
        let mut placed = Self::default();
        for (layer, number) in layers.iter().zip(0_u32..) {
            let begin = placed.places.len();
            for (triangle, colours) in layer.triangles() {
                if placed.triangles.len().is_multiple_of(A_RUN) {
                    look(ticket)?;
                }
                let corners = triangle.corners.map(|corner| placed.place(corner, begin));
                placed.triangles.push(corners);
                let normals = triangle.normals.map(|normal| normal.to_array());
                placed.looks.push(Painted { normals, colours, layer: number });
            }
            placed.ends.push(placed.places.len());
        }
        placed.places.shrink_to_fit();
        placed.triangles.shrink_to_fit();
        placed.looks.shrink_to_fit();
        Ok(Self { layers, ..placed })
    }

    /// The opacity of a triangle.
    pub(super) fn opacity(&self, triangle: u32) -> f32 {
        self.layers[self.looks[triangle as usize].layer as usize].look.opacity as f32
    }

    /// All corners as a camera sees them; the centre is that of what it looks at. `corners` is room that there was for them.
    pub(super) fn in_view(
        &self,
        (view, camera): (&View, &Camera),
        centre: DVec3,
        mut corners: Vec<Corner>,
        ticket: &Ticket,
    ) -> Result<Vec<Corner>, Cancelled> {
        let eye = Eye::of(view);
        let rotation = camera.view_from_world_rotation();
        let beside = view.view_centre.truncate().extend(0.0);
        let origins: Vec<DVec3> =
            self.layers.iter().map(|layer| layer.mesh.origin() - centre).collect();
        corners.resize(self.places.len(), Corner::default());
        let runs = corners.chunks_mut(A_RUN).zip(self.places.chunks(A_RUN)).enumerate();
        parallel::try_each(runs, |(i, (corners, places))| {
            look(ticket)?;
            let mut layer = self.ends.partition_point(|end| *end <= i * A_RUN);
            for ((corner, place), number) in corners.iter_mut().zip(places).zip(i * A_RUN..) {
                while number >= self.ends[layer] {
                    layer += 1;
                }
                let from_centre = place.as_dvec3() + origins[layer];
                let at = rotation * from_centre * view.pixels_per_unit + beside;
                *corner = Corner { at, on_picture: at.truncate() / eye.scale(at.z) };
            }
            Ok(())
        })?;
        Ok(corners)
    }

    /// The number of a place of the layer that begins at `begin`: that of one of the last triangles' corners, or a new one.
    fn place(&mut self, place: Vec3, begin: usize) -> u32 {
        let bits = |place: Vec3| place.to_array().map(f32::to_bits);
        let recent = self.places.len().saturating_sub(LOOKED_BACK).max(begin);
        let known = self.places[recent..].iter().rposition(|other| bits(*other) == bits(place));
        let number = known.map_or(self.places.len(), |i| recent + i);
        if known.is_none() {
            self.places.push(place);
        }
        number as u32
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::polygons::Mesh;

    #[test]
    fn corners_that_neighbours_share_are_placed_once_and_triangles_stay_what_they_are() {
        let side = 12_u32;
        let corners =
            (0..side * side).map(|i| Vec3::new((i % side) as f32, (i / side) as f32, 1.0));
        let quads = (0..side * side).filter(|i| i % side < side - 1 && i / side < side - 1);
        let quads = quads.flat_map(|i| [[i, i + 1, i + side], [i + side, i + 1, i + side + 1]]);
        let mesh = |shift: f32| {
            let corners = corners.clone().map(|corner| corner + shift).collect();
            let mesh = Mesh::new("sheet", corners, Vec::new(), Vec::new(), quads.clone().collect());
            PolygonLayer::new(Arc::new(mesh.expect("a mesh")))
        };
        let layers = vec![mesh(0.0), mesh(0.5)];
        let placed = Placed::of(layers.clone(), &Ticket::new()).expect("not cancelled");
        let all = layers.iter().flat_map(PolygonLayer::triangles);
        let expected: Vec<[Vec3; 3]> = all.map(|(triangle, _)| triangle.corners).collect();
        let found = placed.triangles.iter().map(|t| t.map(|i| placed.places[i as usize]));
        assert_eq!(found.collect::<Vec<_>>(), expected);
        let (places, triangles) = (placed.places.len(), placed.triangles.len());
        assert!(places < triangles * 6 / 5, "{places} of {triangles} triangles");
        assert_eq!(placed.ends, [places / 2, places]);
    }
}
