//! File axes to a grid: which are space, which are components of one sample, which are a list of
//! volumes; and the lattice that the spatial ones span.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::bytes::{no_samples, reserve_samples};
use super::error::{Problem, unsupported};
use crate::core::Cancelled;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Lattice, Samples};
use crate::with_samples;

/// More volumes than this in one file are no list that anybody picks from.
const MOST_FIELDS: usize = 4096;

/// What one axis of a file's array means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Components of one sample: vector, colour, tensor.
    Component,
    /// Space.
    Domain,
    /// Several volumes on one lattice: time, gradients, a list.
    List,
}

/// An array as a file has it: first axis fastest.
pub(super) struct Axes {
    pub(super) sizes: Vec<usize>,
    pub(super) roles: Vec<Role>,
    /// The last of the spatial axes is x, rather than the first.
    pub(super) backwards: bool,
}

impl Axes {
    fn of(&self, role: Role) -> impl DoubleEndedIterator<Item = usize> {
        (0..self.sizes.len()).filter(move |&axis| self.roles[axis] == role)
    }

    /// Those of space, x first.
    fn of_space(&self) -> Vec<usize> {
        let mut axes: Vec<usize> = self.of(Role::Domain).collect();
        if self.backwards {
            axes.reverse();
        }
        axes
    }

    fn product(&self, role: Role) -> usize {
        self.of(role).map(|axis| self.sizes[axis]).product()
    }

    /// Samples along x, y, z; 1 for those the file lacks. At most three axes are spatial.
    pub(super) fn dims(&self) -> [usize; 3] {
        let mut dims = [1; 3];
        for (dim, axis) in dims.iter_mut().zip(self.of_space()) {
            *dim = self.sizes[axis];
        }
        dims
    }

    /// Whether components come first and lists last, so that every volume is one run of samples.
    fn is_in_order(&self) -> bool {
        let rank = |role| match role {
            Role::Component => 0,
            Role::Domain => 1,
            Role::List => 2,
        };
        !self.backwards && self.roles.windows(2).all(|pair| rank(pair[0]) <= rank(pair[1]))
    }

    /// Whether [`Axes::fields`] needs the samples a second time.
    pub(super) fn copies(&self) -> bool {
        !self.is_in_order() || self.product(Role::List) > 1
    }

    /// One field for each entry of the list axes, components interleaved and x fastest.
    ///
    /// # Errors
    /// More entries than are sensible, or cancelled.
    pub(super) fn fields(
        &self,
        name: &str,
        samples: Samples,
        ticket: &Ticket,
    ) -> Result<Vec<Field>, Problem> {
        let components = self.product(Role::Component);
        let entries = self.product(Role::List);
        if entries > MOST_FIELDS {
            return Err(unsupported(
                format!("at most {MOST_FIELDS} volumes in one file"),
                entries.to_string(),
                "split the file",
            ));
        }
        let field = |name: String, samples: Samples| Field {
            name,
            components,
            association: Association::Point,
            samples: Arc::new(samples),
        };
        if !self.copies() {
            return Ok(vec![field(name.to_owned(), samples)]);
        }
        (0..entries)
            .map(|entry| {
                let name = if entries == 1 { name.to_owned() } else { format!("{name}[{entry}]") };
                Ok(field(name, self.gather(&samples, entry, ticket)?))
            })
            .collect()
    }

    /// The samples of one entry of the list, in order.
    fn gather(&self, samples: &Samples, entry: usize, ticket: &Ticket) -> Result<Samples, Problem> {
        let strides: Vec<usize> = self
            .sizes
            .iter()
            .scan(1, |stride, size| Some(std::mem::replace(stride, *stride * size)))
            .collect();
        let mut start = 0;
        let mut left = entry;
        for axis in self.of(Role::List) {
            start += left % self.sizes[axis] * strides[axis];
            left /= self.sizes[axis];
        }
        let order: Vec<usize> = self.of(Role::Component).chain(self.of_space()).collect();
        let count = order.iter().map(|&axis| self.sizes[axis]).product();
        let mut gathered = no_samples(samples.scalar_type());
        reserve_samples(&mut gathered, count)?;
        macro_rules! gather {
            ($($kind:ident),*) => {
                match (samples, &mut gathered) {
                    $((Samples::$kind(from), Samples::$kind(to)) => {
                        let mut index = vec![0; order.len()];
                        let mut at = start;
                        for done in 0..count {
                            if done % (1 << 16) == 0 && ticket.is_cancelled() {
                                return Err(Cancelled.into());
                            }
                            to.push(from[at]);
                            for (digit, &axis) in index.iter_mut().zip(&order) {
                                *digit += 1;
                                at += strides[axis];
                                if *digit < self.sizes[axis] {
                                    break;
                                }
                                at -= strides[axis] * self.sizes[axis];
                                *digit = 0;
                            }
                        }
                    })*
                    _ => unreachable!("made of the same type above"),
                }
            };
        }
        gather!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
        assert_eq!(with_samples!(&gathered, values => values.len()), count);
        Ok(gathered)
    }
}

/// What to say of several volumes, of which there is more than one because some `lie` so.
pub(super) fn several(fields: &[Field], lie: &str) -> Option<String> {
    let [first, .., last] = fields else { return None };
    let (count, first, last) = (fields.len(), &first.name, &last.name);
    Some(format!("{count} volumes lie {lie}: they are opened as the fields {first} to {last}"))
}

/// A lattice from the step vectors of its axes, of which there may be fewer than three: the rest
/// are perpendicular and of unit length, their size being 1.
///
/// A step of length 0 along an axis of one sample is replaced too, and told in `warnings`.
pub(super) fn lattice(
    dims: [usize; 3],
    origin: DVec3,
    steps: &[DVec3],
    warnings: &mut Vec<String>,
) -> Lattice {
    let mut steps: Vec<Option<DVec3>> = steps.iter().copied().map(Some).collect();
    for (axis, step) in steps.iter_mut().enumerate() {
        if dims[axis] == 1 && *step == Some(DVec3::ZERO) {
            warnings.push(format!("axis {axis} has one sample and no spacing: 1 is used"));
            *step = None;
        }
    }
    steps.resize(3, None);
    let mut direction = DMat3::ZERO;
    let mut spacing = DVec3::ONE;
    for (axis, step) in steps.iter().enumerate() {
        if let Some(step) = step {
            spacing[axis] = step.length();
            *direction.col_mut(axis) = *step / step.length();
        }
    }
    for (axis, step) in steps.iter().enumerate() {
        if step.is_none() {
            *direction.col_mut(axis) = missing_axis(&direction, axis);
        }
    }
    Lattice { dims, spacing, origin, direction }
}

/// A unit vector for a column of zeros: as near to the world's axis as the other columns leave it.
fn missing_axis(direction: &DMat3, axis: usize) -> DVec3 {
    let mut candidates = DVec3::AXES;
    candidates.rotate_left(axis);
    let others: Vec<DVec3> =
        (0..3).map(|c| direction.col(c)).filter(|c| c.length() > 0.5).collect();
    if let [a, b] = others[..] {
        let normal = a.cross(b).normalize_or_zero();
        return if normal[axis] < 0.0 { -normal } else { normal };
    }
    let rejected = candidates.map(|c| others.iter().fold(c, |c, other| c - *other * c.dot(*other)));
    let best = rejected.into_iter().find(|c| c.length() > 0.5);
    best.unwrap_or(candidates[0]).normalize_or_zero()
}

/// A lattice from spacings along the world's axes or `direction`'s columns.
pub(super) fn lattice_of_spacing(
    dims: [usize; 3],
    origin: DVec3,
    mut spacing: DVec3,
    direction: DMat3,
    warnings: &mut Vec<String>,
) -> Lattice {
    for axis in 0..3 {
        if dims[axis] == 1 && spacing[axis] == 0.0 {
            warnings.push(format!("axis {axis} has one sample and no spacing: 1 is used"));
            spacing[axis] = 1.0;
        }
    }
    Lattice { dims, spacing, origin, direction }
}

/// Puts the first array that the file calls active in front.
pub(super) fn activate(fields: &mut [Field], active: &[(Association, String)]) {
    let place = active.iter().find_map(|(association, name)| {
        fields.iter().position(|f| f.association == *association && f.name == *name)
    });
    if let Some(place) = place {
        fields[..=place].rotate_right(1);
    }
}

/// Triples of numbers as world positions.
pub(super) fn positions(triples: &Samples) -> Arc<[DVec3]> {
    let place = |i: usize| DVec3::from_array([0, 1, 2].map(|axis| triples.get(3 * i + axis)));
    parallel::list(triples.len() / 3, place).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_and_lists_anywhere_are_brought_into_order() {
        // Axes: x (2), components (2), y (3), list (2); value = digits of its index.
        let axes = Axes {
            sizes: vec![2, 2, 3, 2],
            roles: vec![Role::Domain, Role::Component, Role::Domain, Role::List],
            backwards: false,
        };
        let mut values = Vec::new();
        for list in 0..2 {
            for y in 0..3 {
                for c in 0..2 {
                    for x in 0..2_u16 {
                        values.push(list * 1000 + y * 100 + c * 10 + x);
                    }
                }
            }
        }
        let fields = axes.fields("f", Samples::UInt16(values), &Ticket::new()).unwrap();
        assert_eq!((fields.len(), fields[1].name.as_str(), fields[1].components), (2, "f[1]", 2));
        assert_eq!(axes.dims(), [2, 3, 1]);
        let expected: Vec<u16> =
            vec![1000, 1010, 1001, 1011, 1100, 1110, 1101, 1111, 1200, 1210, 1201, 1211];
        assert_eq!(*fields[1].samples, Samples::UInt16(expected));
    }

    #[test]
    fn missing_axes_are_perpendicular_units() {
        let mut warnings = Vec::new();
        let flat =
            lattice([4, 5, 1], DVec3::ZERO, &[DVec3::X * 2.0, DVec3::Y * 3.0], &mut warnings);
        assert_eq!((flat.spacing, flat.direction), (DVec3::new(2., 3., 1.), DMat3::IDENTITY));
        for steps in
            [&[DVec3::new(0.0, 0.0, -2.0)][..], &[DVec3::ONE, DVec3::new(1., -1., 0.)], &[]]
        {
            let lattice = lattice([4, 1, 1], DVec3::ZERO, steps, &mut warnings);
            lattice.check().unwrap();
            let [x, y, z] = [0, 1, 2].map(|c| lattice.direction.col(c));
            assert!(x.dot(z).abs() + y.dot(z).abs() < 1e-12, "{lattice:?}");
        }
        assert!(warnings.is_empty());
    }

    #[test]
    fn a_single_sample_without_spacing_gets_one_and_says_so() {
        let mut warnings = Vec::new();
        let steps = [DVec3::X, DVec3::Y, DVec3::ZERO];
        let flat = lattice([4, 4, 1], DVec3::ZERO, &steps, &mut warnings);
        assert_eq!((flat.spacing.z, flat.direction.z_axis), (1.0, DVec3::Z));
        assert_eq!(warnings.len(), 1);
    }
}
