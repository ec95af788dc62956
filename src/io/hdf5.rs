//! HDF5: every data set of numbers on the file's largest grid is a field. Spacing is told by ITK, ilastik and ImageJ.

use std::path::Path;

use glam::{DMat3, DVec3};
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, Hdf5File, OpenOptions};

use super::axes::{self, Axes, Role};
use super::bytes;
use super::error::{Problem, corrupt, quoted, unsupported};
use super::scale::converted;
use super::{Format, Opened, files};
use crate::core::memory;
use crate::core::panics::caught;
use crate::core::progress::Ticket;
use crate::volume::{Field, Grid, Lattice, Samples, ScalarType, length_unit};
use crate::with_samples;

pub(super) const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// More data sets than this are no list that anybody picks from.
const MOST_SETS: usize = 4096;
/// Groups of more levels point at themselves.
const MOST_DEPTH: usize = 12;
/// As many values a sample at most make its components, rather than an axis.
const MOST_COMPONENTS: u64 = 4;
/// No filter that is known shrinks further than this.
const PACKED_MOST: u64 = bytes::DEFLATE_MOST;

/// Does what may fail, or panic, in the library.
fn guarded<T>(work: impl FnOnce() -> hdf5_reader::error::Result<T>) -> Result<T, Problem> {
    let damaged = |words: &str| {
        corrupt(
            "an HDF5 file that is whole",
            quoted(words),
            "copy the file again, or repack it (h5repack)",
        )
    };
    match caught(work) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(damaged(&error.to_string())),
        Err(words) => Err(damaged(&words)),
    }
}

/// Whether a file of HDF5 was written as NetCDF-4.
pub(super) fn is_netcdf(path: &Path) -> bool {
    let root =
        || guarded(|| Hdf5File::open_with_options(path, options(0))?.root_group()?.attributes());
    root().is_ok_and(|attributes| {
        attributes.iter().any(|attribute| attribute.name == "_NCProperties")
    })
}

fn options(most_bytes: u64) -> OpenOptions {
    let most = usize::try_from(most_bytes).unwrap_or(usize::MAX);
    OpenOptions { max_chunk_bytes: most, max_read_bytes: most, ..OpenOptions::default() }
}

/// A data set of numbers that may be drawn.
struct Set {
    /// Groups and name, joined by slashes.
    path: String,
    set: Dataset,
    scalar_type: ScalarType,
    /// Floats of 16 bits.
    halves: bool,
}

impl Set {
    fn of(path: String, set: Dataset) -> Option<Self> {
        let (scalar_type, halves) = type_of(set.dtype())?;
        let is_volume = (2..=8).contains(&set.ndim()) && set.shape().iter().all(|&n| n > 0);
        let is_table = set.ndim() == 2 && set.shape()[1] <= MOST_COMPONENTS;
        (is_volume && !is_table).then_some(Self { path, set, scalar_type, halves })
    }

    /// Components, lists and space, the slowest axis first.
    fn roles(&self) -> Vec<Role> {
        let shape = self.set.shape();
        let count = shape.len();
        let has_components = count >= 4 && shape[count - 1] <= MOST_COMPONENTS;
        let space = count.min(3);
        let lists = count - space - usize::from(has_components);
        let mut roles = vec![Role::List; lists];
        roles.extend(vec![Role::Domain; space]);
        roles.extend(has_components.then_some(Role::Component));
        roles
    }

    fn axes(&self) -> Result<Axes, Problem> {
        let sizes = self.set.shape().iter().rev().map(|&n| usize::try_from(n));
        let sizes = sizes.collect::<Result<Vec<usize>, _>>().map_err(|_too_many| {
            let found = format!("{:?}", self.set.shape());
            unsupported("sizes that this machine can count", found, "crop the data set")
        })?;
        Ok(Axes { sizes, roles: self.roles().into_iter().rev().collect(), backwards: false })
    }

    fn bytes(&self) -> u64 {
        let count = memory::checked_product(self.set.shape()).unwrap_or(u64::MAX);
        count.saturating_mul(self.scalar_type.size_bytes() as u64)
    }

    fn numbers(&self, attribute: &str) -> Option<Vec<f64>> {
        let found = guarded(|| self.set.attribute(attribute)).ok()?;
        guarded(|| found.read_1d::<f64>())
            .or_else(|_| {
                let floats = guarded(|| found.read_1d::<f32>())?;
                Ok::<_, Problem>(floats.into_iter().map(f64::from).collect())
            })
            .ok()
    }
}

fn type_of(dtype: &Datatype) -> Option<(ScalarType, bool)> {
    Some(match dtype {
        Datatype::FixedPoint { size: 1, signed: false, .. } => (ScalarType::UInt8, false),
        Datatype::FixedPoint { size: 1, signed: true, .. } => (ScalarType::Int8, false),
        Datatype::FixedPoint { size: 2, signed: false, .. } => (ScalarType::UInt16, false),
        Datatype::FixedPoint { size: 2, signed: true, .. } => (ScalarType::Int16, false),
        Datatype::FixedPoint { size: 4, signed: false, .. } => (ScalarType::UInt32, false),
        Datatype::FixedPoint { size: 4, signed: true, .. } => (ScalarType::Int32, false),
        Datatype::FixedPoint { size: 8, signed: false, .. } => (ScalarType::UInt64, false),
        Datatype::FixedPoint { size: 8, signed: true, .. } => (ScalarType::Int64, false),
        Datatype::FloatingPoint { size: 2, .. } => (ScalarType::UInt16, true),
        Datatype::FloatingPoint { size: 4, .. } => (ScalarType::Float32, false),
        Datatype::FloatingPoint { size: 8, .. } => (ScalarType::Float64, false),
        // Truths, as h5py writes them.
        Datatype::Enum { base, .. } => return type_of(base),
        _ => return None,
    })
}

/// All data sets of numbers, and the names of the others.
fn sets(file: &Hdf5File, ticket: &Ticket) -> Result<(Vec<Set>, Vec<String>), Problem> {
    let mut found = Vec::new();
    let mut others = Vec::new();
    let mut groups: Vec<(String, Group, usize)> =
        vec![(String::new(), guarded(|| file.root_group())?, 0)];
    let mut seen = 0;
    while let Some((path, group, depth)) = groups.pop() {
        ticket.checkpoint(0, 1)?;
        let (inner, members) = guarded(|| group.members())?;
        for set in members {
            let path = format!("{path}{}", set.name().rsplit('/').next().unwrap_or_default());
            match Set::of(path.clone(), set) {
                Some(set) => found.push(set),
                None => others.push(path),
            }
        }
        seen += 1 + inner.len();
        if found.len() + others.len() > MOST_SETS || seen > MOST_SETS {
            return Err(unsupported(
                format!("at most {MOST_SETS} data sets and groups"),
                "more",
                "extract what is to be seen (h5copy)",
            ));
        }
        for group in inner {
            let path = format!("{path}{}/", group.name().rsplit('/').next().unwrap_or_default());
            if depth < MOST_DEPTH {
                groups.push((path, group, depth + 1));
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    Ok((found, others))
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (_, len) = files::open_file(path)?;
    let most = len.saturating_mul(PACKED_MOST).min(free_bytes);
    let file = guarded(|| Hdf5File::open_with_options(path, options(most)))?;
    let (all, _) = sets(&file, ticket)?;
    let dims = |set: &Set| set.axes().map(|axes| axes.dims());
    let mut best: Option<([usize; 3], u64)> = None;
    for set in &all {
        let dims = dims(set)?;
        // Three dimensions before two, then more points.
        let rank = dims.iter().filter(|&&n| n > 1).count();
        let score = memory::checked_product(&dims.map(|n| n as u64)).unwrap_or(u64::MAX / 4) / 4
            + if rank == 3 { u64::MAX / 2 } else { 0 };
        if best.is_none_or(|(_, least)| score > least) {
            best = Some((dims, score));
        }
    }
    let Some((main_dims, _)) = best else {
        return Err(unsupported(
            "an HDF5 file with a data set of numbers on a grid",
            "none",
            "choose another file, or write such a data set",
        ));
    };
    let mut warnings = Vec::new();
    let mut left = Vec::new();
    let mut main = Vec::new();
    for set in all {
        if dims(&set)? == main_dims { main.push(set) } else { left.push(set.path) }
    }
    if !left.is_empty() {
        warnings.push(format!("the data sets on other grids are ignored: {}", left.join(", ")));
    }
    let needed = main.iter().map(Set::bytes).fold(0, u64::saturating_add);
    // One more while it is brought into order.
    let largest = main.iter().map(Set::bytes).max().unwrap_or_default();
    memory::require("the data sets of the file", needed.saturating_add(largest), free_bytes)?;
    bytes::require_stored(largest, len.saturating_mul(PACKED_MOST))?;

    // Only some of them may say where they lie.
    let says = |set: &&Set| lattice(&file, set, main_dims) != Lattice::unit(main_dims);
    let placed = main.iter().find(says).unwrap_or(&main[0]);
    let (lattice, unit) = (lattice(&file, placed, main_dims), unit(placed));
    let mut fields: Vec<Field> = Vec::new();
    let mut last_problem = None;
    let of = u32::try_from(main.len()).unwrap_or(u32::MAX);
    for (index, set) in main.iter().enumerate() {
        let part = ticket.part(u32::try_from(index).unwrap_or(u32::MAX), of);
        part.checkpoint(0, 1)?;
        let samples = match samples(set, free_bytes) {
            Ok(samples) => samples,
            // Packed in a way that is not read, or damaged: the others may be whole.
            Err(problem @ Problem::Corrupt(_)) => {
                let (Problem::Corrupt(mismatch), path) = (&problem, quoted(&set.path)) else {
                    continue;
                };
                warnings.push(format!("the data set {path} is left out: it is {}", mismatch.found));
                last_problem = Some(problem);
                continue;
            }
            Err(problem) => return Err(problem),
        };
        fields.extend(set.axes()?.fields(&set.path, samples, &part)?);
    }
    if let (true, Some(problem)) = (fields.is_empty(), last_problem) {
        return Err(problem);
    }
    warnings.extend(axes::several(&fields, "in the file"));
    let grid = Grid { unit, ..Grid::of(lattice, fields) };
    Ok(Opened::of(grid, Format::Hdf5, warnings))
}

fn samples(set: &Set, free_bytes: u64) -> Result<Samples, Problem> {
    let count = bytes::checked_count("the data set", set.set.shape(), set.scalar_type, free_bytes)?;
    let mut samples = bytes::zero_samples(set.scalar_type, count)?;
    with_samples!(&mut samples, values => {
        let target: &mut [u8] = bytemuck::cast_slice_mut(values);
        guarded(|| set.set.read_native_bytes_into(target))?;
    });
    if set.halves {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bits of 16")]
        let value = |bits: f64| f64::from(half::f16::from_bits(bits as u16));
        samples = converted(&samples, ScalarType::Float32, value)?;
    }
    Ok(samples)
}

/// Where samples lie, as far as any of the usual writers says so.
fn lattice(file: &Hdf5File, set: &Set, dims: [usize; 3]) -> Lattice {
    let mut lattice = Lattice::unit(dims);
    // ITK: data sets beside the samples, x first.
    if let Some(group) = set.path.strip_suffix("VoxelData") {
        let numbers = |name: &str| -> Option<Vec<f64>> {
            let set = guarded(|| file.dataset(&format!("{group}{name}"))).ok()?;
            let array = guarded(|| set.read_array::<f64>()).ok()?;
            Some(array.iter().copied().collect())
        };
        let triple = |name: &str| numbers(name).filter(|v| v.len() == 3);
        let mut told = lattice;
        if let Some(v) = triple("Origin") {
            told.origin = DVec3::new(v[0], v[1], v[2]);
        }
        if let Some(v) = triple("Spacing") {
            told.spacing = DVec3::new(v[0], v[1], v[2]);
        }
        if let Some(v) = numbers("Directions").filter(|v| v.len() == 9) {
            // Rows of the file are those of the matrix.
            told.direction = DMat3::from_cols_slice(&v).transpose();
        }
        return if told.check().is_ok() { told } else { lattice };
    }
    // ilastik and ImageJ: distances in the order of the axes.
    if let Some(v) = set.numbers("element_size_um").filter(|v| v.len() == 3) {
        let spacing = DVec3::new(v[2], v[1], v[0]);
        if spacing.is_finite() && spacing.min_element() > 0.0 {
            lattice.spacing = spacing;
        }
    }
    lattice
}

fn unit(set: &Set) -> Option<String> {
    if set.path.ends_with("VoxelData") {
        return length_unit("mm");
    }
    set.numbers("element_size_um").and_then(|_| length_unit("µm"))
}
