//! Scalars that are derived from a field of vectors by its gradient: vorticity, divergence, helicity.
//! Computed where one of them is chosen, and not before.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::{Association, Component, Field, Grid, Places, Samples, VolumeError};
use crate::cells::{CellField, Cells, On};
use crate::core::{Ticket, mapped, memory};

/// Samples between two looks at the ticket.
const A_PART: usize = 1 << 15;

/// What is derived of a vector and its gradient J, whose columns are ∂v/∂x, ∂v/∂y, ∂v/∂z in world space.
fn of_gradient(component: Component, vector: DVec3, j: DMat3) -> f64 {
    let curl =
        DVec3::new(j.y_axis.z - j.z_axis.y, j.z_axis.x - j.x_axis.z, j.x_axis.y - j.y_axis.x);
    match component {
        Component::Divergence => j.x_axis.x + j.y_axis.y + j.z_axis.z,
        Component::Helicity => vector.dot(curl),
        _ => curl.length(),
    }
}

/// One value a vector of a field of three components, x fastest: in world units, by differences between
/// the two neighbours along each axis of the grid, at borders between the vector and its only one. Exact
/// where vectors are linear in space; NaN beside vectors that are NaN. Along an axis of one point nothing
/// changes.
///
/// # Errors
/// Too little memory, or cancelled.
pub(super) fn derive(
    grid: &Grid,
    field: &Field,
    component: Component,
    ticket: &Ticket,
) -> Result<Samples, VolumeError> {
    let count = field.samples.len() / 3;
    let places = match grid.shape {
        super::Shape::Affine => 0,
        _ => size_of::<DVec3>() + size_of::<DMat3>(),
    };
    let what = format!("the {} of field \"{}\"", component.word(), field.name);
    let needed = ((8 + places) as u64).saturating_mul(count as u64);
    memory::require(&what, needed, memory::free_bytes())?;
    if let super::Shape::Unstructured(cells) = &grid.shape {
        return on_cells(cells, field, component, ticket);
    }
    let places = grid.places(field.association);
    let [nx, ny, nz] = places.dims();
    let vector = |[x, y, z]: [usize; 3]| {
        let first = 3 * ((z * ny + y) * nx + x);
        DVec3::from_array([0, 1, 2].map(|c| field.samples.get(first + c)))
    };
    // The lattice's own steps are the same everywhere.
    let everywhere = match &places {
        Places::Lattice(lattice) => Some(lattice.axes().inverse()),
        Places::Points { .. } => None,
    };
    let value = |index: usize| {
        let at = [index % nx, index / nx % ny, index / (nx * ny)];
        let difference = |axis: usize| {
            let (mut low, mut high) = (at, at);
            low[axis] = at[axis].saturating_sub(1);
            high[axis] = (at[axis] + 1).min([nx, ny, nz][axis] - 1);
            (vector(high) - vector(low)) / (high[axis] - low[axis]).max(1) as f64
        };
        let by_index = DMat3::from_cols(difference(0), difference(1), difference(2));
        let index_from_world = everywhere.unwrap_or_else(|| places.at(index).1.inverse());
        of_gradient(component, vector(at), by_index * index_from_world)
    };
    Ok(match field.samples.scalar_type().size_bytes() > 4 {
        true => Samples::Float64(mapped(count, A_PART, value, ticket)?),
        #[expect(clippy::cast_possible_truncation, reason = "the sources have no more digits")]
        false => Samples::Float32(mapped(count, A_PART, |index| value(index) as f32, ticket)?),
    })
}

/// Of vectors on unstructured cells, by their gradients as recovered at the points; of cells the mean at their corners.
fn on_cells(
    cells: &Arc<Cells>,
    field: &Field,
    component: Component,
    ticket: &Ticket,
) -> Result<Samples, VolumeError> {
    let count = field.samples.len() / 3;
    let on = match field.association {
        Association::Point => On::Points,
        Association::Cell => On::Cells,
    };
    let of = |c: usize| (0..count).map(|i| field.samples.get(3 * i + c)).collect();
    let parts = [0, 1, 2].map(|c| CellField::new(Arc::clone(cells), on, of(c)));
    let [x, y, z] = parts.each_ref().map(|part| part.growths(ticket));
    let growths = [x?, y?, z?];
    // Rows are what each component grows by along x, y, z.
    let jacobian = |point: usize| {
        DMat3::from_cols(growths[0][point], growths[1][point], growths[2][point]).transpose()
    };
    let vector = |i: usize| DVec3::from_array([0, 1, 2].map(|c| field.samples.get(3 * i + c)));
    let values: Vec<f64> = match on {
        // Nothing grows where nothing is known.
        On::Points => (0..count)
            .map(|i| match vector(i) {
                vector if vector.is_finite() => of_gradient(component, vector, jacobian(i)),
                _ => f64::NAN,
            })
            .collect(),
        On::Cells => {
            let mut sums = vec![(DMat3::ZERO, 0.0); count];
            for (solid, cell) in cells.solids().iter().zip(cells.sources()) {
                for corner in solid.corners() {
                    let (sum, corners) = &mut sums[*cell as usize];
                    *sum += jacobian(*corner as usize);
                    *corners += 1.0;
                }
            }
            let mean = |(i, (sum, corners)): (usize, (DMat3, f64))| {
                of_gradient(component, vector(i), sum * (1.0 / corners))
            };
            sums.into_iter().enumerate().map(mean).collect()
        }
    };
    Ok(Samples::Float64(values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Shape};

    const DERIVED: [Component; 3] =
        [Component::Vorticity, Component::Divergence, Component::Helicity];

    fn field(points: &[DVec3], at: impl Fn(DVec3) -> DVec3) -> Field {
        Field {
            name: "wind".into(),
            components: 3,
            association: Association::Point,
            samples: Arc::new(Samples::Float64(
                points.iter().flat_map(|&p| at(p).to_array()).collect(),
            )),
        }
    }

    /// v = M x + b: its curl and divergence are the same everywhere.
    fn linear(at: DVec3) -> DVec3 {
        DVec3::new(
            0.5 * at.x - 2.0 * at.y + 0.25 * at.z + 3.0,
            1.5 * at.x + 0.75 * at.y - 1.0 * at.z,
            -0.5 * at.x + 3.0 * at.y - 0.125 * at.z - 1.0,
        )
    }
    const CURL: DVec3 = DVec3::new(4.0, 0.75, 3.5);
    const DIVERGENCE: f64 = 1.125;

    fn expected(component: Component, at: DVec3) -> f64 {
        match component {
            Component::Divergence => DIVERGENCE,
            Component::Helicity => linear(at).dot(CURL),
            _ => CURL.length(),
        }
    }

    #[test]
    fn linear_vectors_are_derived_exactly_on_sheared_reflected_and_uneven_grids() {
        let sheared = Lattice {
            spacing: DVec3::new(0.5, -2.0, 30.0),
            origin: DVec3::new(-7.0, 3.0, 11.0),
            direction: DMat3::from_cols(
                DVec3::X,
                DVec3::new(0.3, 0.9, 0.1),
                DVec3::new(-0.2, 0.1, 0.95),
            ),
            ..Lattice::unit([4, 3, 5])
        };
        let lists = [
            vec![0.0, 1.0, 4.0, 4.5].into(),
            vec![2.0, -1.0, -1.5].into(),
            vec![-3.0, 5.0, 6.0, 40.0, 41.0].into(),
        ];
        // Points of a bent map: of what is linear in space, differences are exact there too.
        let bend = |i: usize| {
            let [x, y, z] = [i % 4, i / 4 % 3, i / 12].map(|n| n as f64);
            DVec3::new(x + 0.1 * y * y, y + 0.2 * z * x, 2.0 * z - 0.05 * x * x)
        };
        let bent: Vec<DVec3> = (0..60).map(bend).collect();
        for shape in [None, Some(Shape::Rectilinear(lists)), Some(Shape::Curvilinear(bent.into()))]
        {
            let mut grid = Grid::of(sheared, Vec::new());
            if let Some(shape) = shape {
                grid = Grid::shaped([4, 3, 5], shape, Vec::new()).unwrap();
            }
            let places = grid.places(Association::Point);
            let points: Vec<DVec3> = (0..60).map(|i| places.at(i).0).collect();
            grid.fields = vec![field(&points, linear)];
            for component in DERIVED {
                let found = derive(&grid, &grid.fields[0], component, &Ticket::new()).unwrap();
                for (i, &point) in points.iter().enumerate() {
                    let (found, expected) = (found.get(i), expected(component, point));
                    let close = (found - expected).abs() < 1e-9 * (1.0 + expected.abs());
                    assert!(close, "{component:?} at {point}: {found}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn differences_of_a_vortex_are_of_the_second_order() {
        // (−y, x, 0) / (1 + r²) has curl 2 / (1 + r²)² along z and no divergence.
        let at = |p: DVec3| DVec3::new(-p.y, p.x, 0.0) / (1.0 + p.x * p.x + p.y * p.y);
        let off = |n: usize| {
            let step = 4.0 / (n - 1) as f64;
            let lattice = Lattice {
                spacing: DVec3::new(step, step, 1.0),
                origin: DVec3::new(-2.0, -2.0, 0.0),
                ..Lattice::unit([n, n, 1])
            };
            let grid = Grid::of(lattice, Vec::new());
            let places = grid.places(Association::Point);
            let points: Vec<DVec3> = (0..n * n).map(|i| places.at(i).0).collect();
            let found = derive(&grid, &field(&points, at), Component::Vorticity, &Ticket::new());
            let found = found.unwrap();
            let inner = |i: &usize| {
                let inside = |k: usize| k > 0 && k < n - 1;
                inside(i % n) && inside(i / n)
            };
            (0..n * n)
                .filter(inner)
                .map(|i| {
                    let r2 = points[i].x.powi(2) + points[i].y.powi(2);
                    (found.get(i) - 2.0 / (1.0 + r2).powi(2)).abs()
                })
                .fold(0.0, f64::max)
        };
        let (coarse, fine) = (off(33), off(65));
        // Measured: 3.1e-2 and 7.8e-3.
        assert!(fine < 0.01 && (3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
    }

    #[test]
    fn a_missing_vector_is_missing_beside_it_and_nowhere_else() {
        let grid = Grid::of(Lattice::unit([5, 1, 1]), Vec::new());
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        let holed = field(&points, |p| if p.x == 0.0 { DVec3::NAN } else { p });
        let found = derive(&grid, &holed, Component::Divergence, &Ticket::new()).unwrap();
        assert!(found.get(0).is_nan() && found.get(1).is_nan());
        assert_eq!([2, 3, 4].map(|i| found.get(i)), [1.0; 3]);
    }

    #[test]
    fn it_is_cancelled() {
        let ticket = Ticket::new();
        ticket.cancel();
        let grid = Grid::of(Lattice::unit([3, 1, 1]), Vec::new());
        let found = derive(&grid, &field(&[DVec3::ONE; 3], |p| p), Component::Vorticity, &ticket);
        assert!(matches!(found, Err(VolumeError::Cancelled(_))), "{found:?}");
    }
}
