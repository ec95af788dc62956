//! What is open, where it came from, and how it gets there: the window's side of reading files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::core::Ticket;
use crate::io::{Encoded, Facts, Series, mesh};
use crate::polygons::Mesh;
use crate::scene::FirstLook;
use crate::transfer::presets;
use crate::volume::{
    Component, Field, Grid, LabelName, ScalarType, ScalarVolume, Shape, VectorField, VolumeError,
    demo,
};

/// The prefix of volumes made in code.
pub const DEMO_PREFIX: &str = "demo:";

/// What a person can ask to open.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A file whose content says what it is.
    File(PathBuf),
    /// Bare samples, laid out as a person says.
    Raw(PathBuf, RawLayout),
    /// A volume made in code, by its name.
    Demo(String),
}

impl Source {
    /// What a typed text stands for: `demo:NAME` or a path.
    pub fn parse(text: &str) -> Self {
        Self::of(Path::new(text))
    }

    /// What an argument stands for: `demo:NAME` or a path, which need not be Unicode.
    pub fn of(argument: &Path) -> Self {
        match argument.to_str().and_then(|text| text.strip_prefix(DEMO_PREFIX)) {
            Some(name) => Self::Demo(name.to_owned()),
            None => Self::File(argument.to_owned()),
        }
    }

    /// Its short name, for the title and for pictures made of it.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) | Self::Raw(path, _) => path
                .file_name()
                .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned()),
            Self::Demo(name) => format!("{DEMO_PREFIX}{name}"),
        }
    }

    /// What scenes call it: its path, or `demo:NAME`.
    pub fn key(&self) -> PathBuf {
        match self {
            Self::File(path) | Self::Raw(path, _) => path.clone(),
            Self::Demo(name) => PathBuf::from(format!("{DEMO_PREFIX}{name}")),
        }
    }

    /// The file it is read from, if it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) | Self::Raw(path, _) => Some(path),
            Self::Demo(_) => None,
        }
    }
}

/// How bare samples lie in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawLayout {
    /// Samples along x, y, z.
    pub dims: [u64; 3],
    /// Type of each sample.
    pub scalar_type: ScalarType,
    /// Most significant byte first.
    pub big_endian: bool,
    /// Bytes before the first sample.
    pub skip_bytes: u64,
    /// Distance between samples along x, y, z.
    pub spacing: [f64; 3],
}

impl Default for RawLayout {
    fn default() -> Self {
        Self {
            dims: [1; 3],
            scalar_type: ScalarType::UInt8,
            big_endian: false,
            skip_bytes: 0,
            spacing: [1.0; 3],
        }
    }
}

impl RawLayout {
    /// Bytes that the file must hold, skipped ones included; `None` beyond 64 bits.
    pub fn expected_bytes(&self) -> Option<u64> {
        let sample = self.scalar_type.size_bytes() as u64;
        let [x, y, z] = self.dims;
        crate::core::memory::checked_product(&[x, y, z, sample])?.checked_add(self.skip_bytes)
    }

    /// Layouts that fill `found_bytes` exactly, as volumes usually are: cubes, and slices of a power of two. The
    /// likelier ones first, at most a handful.
    pub fn suggestions(&self, found_bytes: u64) -> Vec<Self> {
        const MOST: usize = 8;
        let Some(bytes) = found_bytes.checked_sub(self.skip_bytes).filter(|&n| n > 0) else {
            return Vec::new();
        };
        let types =
            [ScalarType::UInt8, ScalarType::UInt16, ScalarType::Float32, ScalarType::Float64];
        let mut cubes = Vec::new();
        let mut slices = Vec::new();
        for scalar_type in types {
            let size = scalar_type.size_bytes() as u64;
            if !bytes.is_multiple_of(size) {
                continue;
            }
            let count = bytes / size;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "of a root"
            )]
            let side = (count as f64).cbrt().round() as u64;
            let layout = |dims| Self { dims, scalar_type, ..*self };
            if side > 1 && side.checked_pow(3) == Some(count) {
                cubes.push(layout([side; 3]));
            }
            for side in [512_u64, 256, 1024, 128, 64, 2048] {
                let deep = count / (side * side);
                // Between a few slices and a rod.
                let is_likely = (side / 16..=4 * side).contains(&deep) && deep != side;
                if is_likely && count.is_multiple_of(side * side) {
                    slices.push(layout([side, side, deep]));
                }
            }
        }
        cubes.into_iter().chain(slices).take(MOST).collect()
    }

    /// Why a file of `found_bytes` cannot be read this way; `None` if it can.
    pub fn refusal(&self, found_bytes: u64) -> Option<String> {
        if self.dims.contains(&0) {
            return Some("every dimension must be at least 1".to_owned());
        }
        if self.spacing.iter().any(|s| !s.is_finite() || *s == 0.0) {
            return Some("every spacing must be a number other than 0".to_owned());
        }
        if self.dims == [1; 3] {
            return Some(
                "one sample is no volume: say how many there are along x, y and z".to_owned(),
            );
        }
        match self.expected_bytes() {
            None => Some("the dimensions are beyond what 64 bits can count".to_owned()),
            Some(expected) if expected > found_bytes => Some(format!(
                "the file is {} bytes short: {expected} expected, {found_bytes} found",
                expected - found_bytes
            )),
            Some(_) => None,
        }
    }
}

/// One slice of a raw file, scaled to grey.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slice {
    /// Pixels across and down, each at least 1.
    pub size: [usize; 2],
    /// Grey, rows from the top, least value black and greatest white.
    pub grey: Vec<u8>,
}

/// A grid as it was read.
#[derive(Debug)]
pub struct ReadGrid {
    /// The fields and their lattice.
    pub grid: Grid,
    /// Partial trouble, one sentence each.
    pub warnings: Vec<String>,
    /// The series that lie at its place, where there are several.
    pub series: Vec<Series>,
    /// Of a file of basis functions, how far they are from their source.
    pub encoding: Option<Facts>,
}

impl ReadGrid {
    /// A grid of which there is nothing else to tell.
    pub fn of(grid: Grid) -> Self {
        Self { grid, warnings: Vec::new(), series: Vec::new(), encoding: None }
    }
}

/// Why there is no grid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ReadFailure {
    /// One sentence for people.
    Refused(String),
    /// No reader knows the content, so a raw layout is needed; one sentence for people.
    NotRecognised(String),
    /// A format that is known and not read: what it is, with its article.
    Foreign(String),
    /// It was cancelled.
    Cancelled,
}

impl From<VolumeError> for ReadFailure {
    fn from(error: VolumeError) -> Self {
        match error {
            VolumeError::Cancelled(_) => Self::Cancelled,
            other => Self::Refused(other.to_string()),
        }
    }
}

/// Where grids come from: the file readers, or a stand-in in tests.
pub trait Library: Send + Sync {
    /// Reads everything a source holds.
    ///
    /// # Errors
    /// See [`ReadFailure`].
    fn read(&self, source: &Source, ticket: &Ticket) -> Result<ReadGrid, ReadFailure>;
    /// What a raw file's name and length tell of its layout.
    fn guess_raw(&self, path: &Path) -> RawLayout;
    /// The file's length in bytes.
    ///
    /// # Errors
    /// One sentence for people.
    fn file_bytes(&self, path: &Path) -> Result<u64, String>;
    /// One slice across z of a raw file, at most a few hundred pixels on a side.
    ///
    /// # Errors
    /// One sentence for people.
    fn raw_slice(&self, path: &Path, layout: &RawLayout, z: u64) -> Result<Slice, String>;
    /// The names of the volumes made in code, with a line about each.
    fn demos(&self) -> Vec<(&'static str, &'static str)>;
    /// What a volume is first seen as, in a space that its file names.
    fn first_look(&self, volume: &ScalarVolume, space: Option<&str>) -> FirstLook;
}

/// An open volume.
#[derive(Debug, Clone)]
pub struct Document {
    /// Where it came from.
    pub source: Source,
    /// Everything that was read.
    pub grid: Arc<Grid>,
    /// Which of the grid's fields is drawn.
    pub field: usize,
    /// Which number of that field is drawn.
    pub component: Component,
    /// The field that is drawn.
    pub volume: Arc<ScalarVolume>,
    /// What is first seen of it.
    pub first_look: FirstLook,
    /// Its polygons, where it has nothing else, or its points in their own colours, and what the drawn field is called among the
    /// numbers on them; `None` where it is their colours.
    pub surface: Option<(Arc<Mesh>, Option<String>)>,
    /// The vectors that it opens with: of its first field, where that has three components, or of a demo's wind.
    pub vectors: Option<Arc<VectorField>>,
    /// Whether they flow from the start.
    pub flows: bool,
    /// Partial trouble while reading.
    pub warnings: Vec<String>,
    /// The series among which it was chosen; empty where it is the only one.
    pub series: Vec<Series>,
    /// How many of the grid's fields the file holds. Another is what basis functions leave of one of these.
    pub fields_in_file: usize,
    /// Of a file of basis functions, how far they are from their source.
    pub encoding: Option<Facts>,
    /// A field that was encoded here, and which number of it.
    pub encoded: Option<EncodedField>,
}

/// A field that was encoded as basis functions.
#[derive(Debug, Clone)]
pub struct EncodedField {
    /// Index into the grid's fields.
    pub field: usize,
    /// Which number of it.
    pub component: Component,
    /// The functions, and how far they are from the samples.
    pub encoded: Arc<Encoded>,
}

/// Polygons, and what the drawn field is called among the numbers on them; `None` where it is their own colours.
type OwnSurface = (Arc<Mesh>, Option<String>);

/// The polygons of a file that has nothing else, and what is told of them beside `warnings`.
fn surface_of(
    source: &Source,
    grid: &Grid,
    (field, component): (&Field, Component),
    warnings: &mut Vec<String>,
    ticket: &Ticket,
) -> Result<Option<OwnSurface>, ReadFailure> {
    let Some(path) = source.path() else { return Ok(None) };
    let opened = mesh::surface_of(path, grid, (field, component), warnings, ticket);
    let opened = opened.map_err(|error| match error.is_cancelled() {
        true => ReadFailure::Cancelled,
        false => ReadFailure::Refused(error.to_string()),
    })?;
    let Some(opened) = opened else { return Ok(None) };
    warnings.extend(opened.warnings);
    Ok(Some((Arc::new(opened.mesh), mesh::drawn_name(field, component))))
}

impl Document {
    /// Reads a source and takes its active field: the values, or a vector's magnitude.
    ///
    /// # Errors
    /// See [`ReadFailure`].
    pub fn read(
        library: &dyn Library,
        source: Source,
        ticket: &Ticket,
    ) -> Result<Self, ReadFailure> {
        let ReadGrid { grid, mut warnings, series, encoding } = library.read(&source, ticket)?;
        let grid = Arc::new(grid);
        let field = grid.field(None)?;
        let component = Component::usual(field.components);
        let volume = Arc::new(grid.scalar(field, component, ticket)?);
        let flowing = match &source {
            Source::Demo(name) => {
                demo::flowing_field(name).filter(|name| grid.field(Some(name)).is_ok())
            }
            Source::File(_) | Source::Raw(..) => None,
        };
        let vectors = match (flowing, field.components) {
            (Some(name), _) => Some(Arc::new(grid.vectors(grid.field(Some(name))?, ticket)?)),
            // Of a mesh its matter is seen first.
            (None, 3) if !matches!(grid.shape, Shape::Unstructured(_)) => {
                Some(Arc::new(grid.vectors(field, ticket)?))
            }
            (None, _) => None,
        };
        let flows = flowing.is_some();
        let surface = surface_of(&source, &grid, (field, component), &mut warnings, ticket)?;
        let first_look = library.first_look(&volume, grid.space.as_deref());
        let first_look = if surface.is_some() { first_look.of_surface() } else { first_look };
        Ok(Self {
            source,
            fields_in_file: grid.fields.len(),
            encoding,
            encoded: None,
            grid,
            field: 0,
            component,
            volume,
            first_look,
            surface,
            vectors,
            flows,
            warnings,
            series,
        })
    }

    /// Whether both are of what was read at one time. A field that was added to it makes no other file of it.
    pub fn is_same_file(&self, other: &Self) -> bool {
        let first = |document: &Self| document.grid.fields.first().map(|f| Arc::as_ptr(&f.samples));
        first(self) == first(other)
    }

    /// How the field that is drawn was encoded here.
    pub fn encoded_here(&self) -> Option<&Arc<Encoded>> {
        let of_field = |encoded: &&EncodedField| {
            (encoded.field, encoded.component) == (self.field, self.component)
        };
        self.encoded.as_ref().filter(of_field).map(|of_field| &of_field.encoded)
    }

    /// Which of the grid's fields is what functions leave of another.
    pub fn residual(&self) -> Option<usize> {
        (self.fields_in_file < self.grid.fields.len()).then_some(self.fields_in_file)
    }

    /// What the file calls the labels that are drawn.
    pub fn label_names(&self) -> Vec<&LabelName> {
        let component = match self.component {
            Component::Index(index) => index,
            _ => 0,
        };
        self.grid.label_names.iter().filter(|name| name.component == component).collect()
    }

    /// The first field of vectors.
    pub fn first_vectors(&self) -> Option<usize> {
        self.grid.fields.iter().position(Field::is_vectors)
    }

    /// Whether the file has a field that can be drawn as vectors, or fields to put them together of.
    pub fn has_vectors(&self) -> bool {
        let is_triple = self.grid.fields.iter().any(|field| field.components == 3);
        is_triple || self.scalar_triple().is_some()
    }

    /// The first three fields of one component on the same points or cells, which could be those of
    /// vectors.
    pub fn scalar_triple(&self) -> Option<[usize; 3]> {
        let fields = &self.grid.fields;
        fields.iter().find_map(|first| {
            let mut alike = fields.iter().enumerate().filter(|(_, field)| {
                field.components == 1
                    && first.components == 1
                    && field.association == first.association
            });
            let mut next = || alike.next().map(|(index, _)| index);
            Some([next()?, next()?, next()?])
        })
    }

    /// The same file with another of its fields drawn.
    ///
    /// # Errors
    /// See [`ReadFailure`].
    pub fn with_field(
        self,
        library: &dyn Library,
        field: usize,
        component: Component,
        ticket: &Ticket,
    ) -> Result<Self, ReadFailure> {
        let chosen = self.grid.fields.get(field).ok_or_else(|| {
            ReadFailure::Refused(format!("there is no field number {field} in this file"))
        })?;
        let volume = self.grid.scalar(chosen, component, ticket)?;
        let first_look = library.first_look(&volume, self.grid.space.as_deref());
        let mut warnings = self.warnings.clone();
        let name = mesh::drawn_name(chosen, component);
        let surface = match &self.surface {
            // Its numbers lie on the polygons already.
            Some((mesh, _)) if name.as_ref().is_some_and(|name| mesh.has_array(name)) => {
                Some((Arc::clone(mesh), name))
            }
            Some(_) => {
                let drawn = (chosen, component);
                surface_of(&self.source, &self.grid, drawn, &mut warnings, ticket)?
            }
            None => None,
        };
        let first_look = if surface.is_some() { first_look.of_surface() } else { first_look };
        let mut told = Vec::new();
        for warning in warnings {
            if !told.contains(&warning) {
                told.push(warning);
            }
        }
        let mut other = Self { field, component, first_look, surface, warnings: told, ..self };
        if other.residual() == Some(field) {
            // It is a cloud of both signs, whatever its values are like.
            other.first_look.transfer = presets::of_differences(&volume.statistics);
            other.first_look.lighting = None;
        }
        let encoding = other.encoded_here().map(|encoded| Arc::new(encoded.encoding.clone()));
        let functions = encoding.or(volume.functions);
        other.volume = Arc::new(ScalarVolume { functions, ..volume });
        Ok(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_argument_is_a_demo_or_a_path() {
        assert_eq!(Source::parse("demo:tornado"), Source::Demo("tornado".into()));
        assert_eq!(Source::parse("a/b.nrrd").name(), "b.nrrd");
        assert_eq!(Source::Demo("shells".into()).name(), "demo:shells");
    }

    #[test]
    fn a_raw_layout_is_refused_with_the_reason_and_the_figures() {
        let layout = RawLayout { dims: [4, 5, 6], skip_bytes: 10, ..RawLayout::default() };
        assert_eq!(layout.expected_bytes(), Some(130));
        assert_eq!(layout.refusal(130), None);
        assert_eq!(layout.refusal(500), None, "more bytes than needed are fine");
        let short = layout.refusal(100).unwrap();
        assert!(short.contains("30 bytes short") && short.contains("130"), "{short}");
        let huge = RawLayout { dims: [u64::MAX, 2, 1], ..layout };
        assert!(huge.refusal(100).unwrap().contains("64 bits"));
        assert!(RawLayout { dims: [0, 1, 1], ..layout }.refusal(100).is_some());
        assert!(
            RawLayout { dims: [1; 3], ..layout }.refusal(100).is_some(),
            "nobody said anything"
        );
        assert!(RawLayout { spacing: [1.0, 0.0, 1.0], ..layout }.refusal(999).is_some());
    }

    #[test]
    fn suggested_layouts_fill_the_file_and_cubes_come_first() {
        let all =
            |skip_bytes, bytes| RawLayout { skip_bytes, ..RawLayout::default() }.suggestions(bytes);
        let cubes = all(0, 64 * 64 * 64 * 2);
        assert_eq!((cubes[0].dims, cubes[0].scalar_type), ([64; 3], ScalarType::UInt16));
        let scan = all(100, 100 + 512 * 512 * 90 * 2);
        assert!(
            scan.iter().any(|l| l.dims == [512, 512, 90] && l.scalar_type == ScalarType::UInt16)
        );
        for (skip, bytes) in [(0, 1 << 20), (16, 16 + 400 * 512 * 512), (0, 7919), (0, 1), (9, 5)] {
            for layout in all(skip, bytes) {
                assert_eq!(layout.expected_bytes(), Some(bytes));
                assert_eq!(layout.refusal(bytes), None);
            }
        }
        assert!(all(0, 7919).is_empty() && all(9, 5).is_empty(), "primes and less than nothing");
    }
}
