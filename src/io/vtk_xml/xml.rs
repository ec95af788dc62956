//! The XML of VTK's data sets: extents or counts, geometry, cells, and where each array's numbers are.

use std::borrow::Cow;

use glam::{DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};

use super::super::bytes::Endian;
use super::super::error::{Problem, header, quoted, truncated, unsupported};
use super::super::unstructured::Group;
use super::data::Compressor;
use crate::volume::{Association, ScalarType};

/// Types of numbers that are read, as VTK calls them.
pub(super) const KNOWN_TYPES: &str =
    "Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32 or Float64";

/// Where an array's numbers are, and how they are written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Place<'a> {
    /// As numbers in the XML.
    Text(Cow<'a, str>),
    /// As base64 in the XML.
    Base64(Cow<'a, str>),
    /// So many bytes (or characters of base64) into the appended data.
    Appended(u64),
}

/// One `DataArray`.
#[derive(Debug, Clone)]
pub(super) struct Array<'a> {
    pub(super) name: String,
    pub(super) association: Association,
    pub(super) components: u64,
    pub(super) scalar_type: ScalarType,
    pub(super) place: Place<'a>,
}

/// What the file holds, by its element's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Image,
    Rectilinear,
    Structured,
    Unstructured,
    PolyData,
    /// Files of one of the last two, named by another.
    Parallel,
}

impl Kind {
    /// The kind of a file whose `type` or whose element has this name.
    pub(super) fn from_name(name: &str) -> Option<Self> {
        match name {
            "ImageData" => Some(Self::Image),
            "RectilinearGrid" => Some(Self::Rectilinear),
            "StructuredGrid" => Some(Self::Structured),
            "UnstructuredGrid" => Some(Self::Unstructured),
            "PolyData" => Some(Self::PolyData),
            "PUnstructuredGrid" | "PPolyData" => Some(Self::Parallel),
            _ => None,
        }
    }

    /// VTK's word for it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Image => "ImageData",
            Self::Rectilinear => "RectilinearGrid",
            Self::Structured => "StructuredGrid",
            Self::Unstructured => "UnstructuredGrid",
            Self::PolyData => "PolyData",
            Self::Parallel => "PUnstructuredGrid",
        }
    }

    /// Whether its cells lie in no order.
    pub(super) fn is_unstructured(self) -> bool {
        matches!(self, Self::Unstructured | Self::PolyData | Self::Parallel)
    }
}

/// First and last index along x, y, z.
pub(super) type Extent = [[i64; 2]; 3];

/// One `Piece`.
#[derive(Debug, Clone)]
pub(super) struct Piece<'a> {
    pub(super) extent: Extent,
    pub(super) arrays: Vec<Array<'a>>,
    /// Three arrays of coordinates, or one of points; none of images.
    pub(super) geometry: Vec<Array<'a>>,
    /// Where cells lie in no order: how many points and cells of each group there are, and what lists them.
    pub(super) points: u64,
    pub(super) counts: Vec<(Group, u64)>,
    pub(super) cells: Vec<(Group, Array<'a>)>,
    /// The file that holds it, where it is another one.
    pub(super) source: Option<String>,
}

/// What the XML says.
#[derive(Debug)]
pub(super) struct Document<'a> {
    pub(super) kind: Kind,
    pub(super) endian: Endian,
    /// Bytes of each number in a binary array's header: 4 or 8.
    pub(super) word_bytes: usize,
    pub(super) compressor: Option<Compressor>,
    pub(super) whole_extent: Extent,
    pub(super) origin: DVec3,
    pub(super) spacing: DVec3,
    pub(super) direction: DMat3,
    pub(super) pieces: Vec<Piece<'a>>,
    /// `Scalars` of the point data, then of the cell data; then `Vectors` likewise.
    pub(super) active: Vec<(Association, String)>,
    pub(super) warnings: Vec<String>,
}

impl<'a> Document<'a> {
    /// Parses all of the XML, or what precedes the appended data.
    ///
    /// # Errors
    /// XML that is none, or attributes that make no image.
    pub(super) fn parse(text: &'a str, has_appended: bool) -> Result<Self, Problem> {
        let mut parser = Parser::default();
        let mut reader = Reader::from_str(text);
        loop {
            let event = reader.read_event().map_err(|error| {
                header(
                    "well-formed XML",
                    quoted(&error.to_string()),
                    "the file was cut short or altered: copy it again",
                )
            })?;
            match event {
                Event::Start(tag) => parser.start(&tag, false)?,
                Event::Empty(tag) => parser.start(&tag, true)?,
                Event::End(tag) => parser.end(tag.name().as_ref()),
                Event::Text(text) => parser.text(text.into_inner()),
                Event::CData(text) => parser.text(text.into_inner()),
                Event::Eof => break,
                _ => {}
            }
        }
        if !has_appended && !parser.is_closed {
            return Err(truncated(
                "XML that ends with </VTKFile>",
                "that it ends before",
                "the file was cut short: copy it again",
            ));
        }
        parser.finish()
    }
}

/// What is told of numbers that belong to no points and no cells.
pub(in super::super) const IGNORED_FIELD_DATA: &str = "field data (no samples) are ignored";

/// Which of a piece's elements the arrays are in.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Data(Association),
    Geometry,
    Cells(Group),
}

/// What an `<ImageData>` element or its like says.
struct Whole {
    kind: Kind,
    extent: Extent,
    origin: DVec3,
    spacing: DVec3,
    direction: DMat3,
}

/// Attributes of `<VTKFile>` and of what it holds.
#[derive(Default)]
struct Parser<'a> {
    file: Option<(Endian, usize, Option<Compressor>)>,
    whole: Option<Whole>,
    pieces: Vec<Piece<'a>>,
    active: Vec<(u8, Association, String)>,
    warnings: Vec<String>,
    /// Inside `PointData`, `CellData`, `Points` or `Coordinates`.
    section: Option<Section>,
    /// Inside the last array of the last piece, at this depth of further elements.
    in_array: Option<usize>,
    is_in_field_data: bool,
    /// How many tuples each array of numbers among the field data has, where it says.
    field_data: Vec<Option<u64>>,
    /// Nothing tells the byte order.
    is_order_assumed: bool,
    is_closed: bool,
}

impl<'a> Parser<'a> {
    fn start(&mut self, tag: &BytesStart<'_>, is_empty: bool) -> Result<(), Problem> {
        if let Some(depth) = &mut self.in_array {
            *depth += usize::from(!is_empty);
            return Ok(());
        }
        match tag.name().as_ref() {
            "VTKFile" => self.file(tag)?,
            "Piece" => {
                let extent = match attribute(tag, "Extent")? {
                    Some(text) => extent(&text)?,
                    None => self.whole.as_ref().map_or([[0; 2]; 3], |whole| whole.extent),
                };
                self.pieces.push(piece(tag, extent)?);
            }
            "Cells" => self.section = (!is_empty).then_some(Section::Cells(Group::Cells)),
            "Verts" => self.section = (!is_empty).then_some(Section::Cells(Group::Vertices)),
            "Lines" => self.section = (!is_empty).then_some(Section::Cells(Group::Lines)),
            "Polys" => self.section = (!is_empty).then_some(Section::Cells(Group::Polygons)),
            "Strips" => self.section = (!is_empty).then_some(Section::Cells(Group::Strips)),
            "Points" | "Coordinates" => {
                self.section = (!is_empty).then_some(Section::Geometry);
            }
            "PointData" => self.section(tag, Association::Point, is_empty)?,
            "CellData" => self.section(tag, Association::Cell, is_empty)?,
            "FieldData" => self.is_in_field_data = !is_empty,
            "DataArray" if self.is_in_field_data => self.field_data(tag)?,
            "DataArray" | "Array" => self.array(tag, is_empty)?,
            name => {
                if let Some(kind) = Kind::from_name(name) {
                    self.whole(tag, kind)?;
                }
            }
        }
        Ok(())
    }

    fn end(&mut self, name: &str) {
        if let Some(depth) = &mut self.in_array {
            match depth.checked_sub(1) {
                Some(less) => *depth = less,
                None => self.in_array = None,
            }
            return;
        }
        match name {
            "PointData" | "CellData" | "Points" | "Coordinates" | "Cells" | "Verts" | "Lines"
            | "Polys" | "Strips" => self.section = None,
            "FieldData" => self.is_in_field_data = false,
            "VTKFile" => self.is_closed = true,
            _ => {}
        }
    }

    fn text(&mut self, text: Cow<'a, str>) {
        // Deeper elements hold keys such as the range, not the samples.
        if self.in_array != Some(0) || text.trim().is_empty() {
            return;
        }
        let section = self.section;
        let array = self.pieces.last_mut().and_then(|piece| match section {
            Some(Section::Geometry) => piece.geometry.last_mut(),
            Some(Section::Cells(_)) => piece.cells.last_mut().map(|(_, array)| array),
            _ => piece.arrays.last_mut(),
        });
        if let Some(Array { place: Place::Text(held) | Place::Base64(held), .. }) = array {
            if held.is_empty() {
                *held = text;
            } else {
                held.to_mut().push_str(&text);
            }
        }
    }

    fn file(&mut self, tag: &BytesStart<'_>) -> Result<(), Problem> {
        let endian = match attribute(tag, "byte_order")?.as_deref() {
            Some("LittleEndian") => Endian::Little,
            Some("BigEndian") => Endian::Big,
            None => {
                self.is_order_assumed = true;
                Endian::Little
            }
            Some(other) => {
                return Err(header(
                    "byte_order LittleEndian or BigEndian",
                    quoted(other),
                    "correct the attribute",
                ));
            }
        };
        let word_bytes = match attribute(tag, "header_type")?.as_deref() {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => {
                return Err(header(
                    "header_type UInt32 or UInt64",
                    quoted(other),
                    "correct the attribute",
                ));
            }
        };
        let compressor = match attribute(tag, "compressor")?.as_deref() {
            None | Some("") => None,
            Some("vtkZLibDataCompressor") => Some(Compressor::Zlib),
            Some("vtkLZ4DataCompressor") => Some(Compressor::Lz4),
            Some("vtkLZMADataCompressor") => Some(Compressor::Lzma),
            Some(other) => {
                return Err(unsupported(
                    "no compression, or a compressor of VTK: vtkZLibDataCompressor, vtkLZ4DataCompressor or vtkLZMADataCompressor",
                    quoted(other),
                    "write the file again with zlib",
                ));
            }
        };
        self.file = Some((endian, word_bytes, compressor));
        Ok(())
    }

    fn whole(&mut self, tag: &BytesStart<'_>, kind: Kind) -> Result<(), Problem> {
        let extent = match attribute(tag, "WholeExtent")? {
            Some(whole) => extent(&whole)?,
            None if kind.is_unstructured() => [[0; 2]; 3],
            None => {
                let expected = format!("an element {} with WholeExtent", kind.name());
                return Err(header(expected, "none", "add the attribute"));
            }
        };
        let vector = |name: &str, default: DVec3| -> Result<DVec3, Problem> {
            match attribute(tag, name)? {
                None => Ok(default),
                Some(text) => numbers::<3>(name, &text).map(DVec3::from_array),
            }
        };
        let direction = match attribute(tag, "Direction")? {
            None => DMat3::IDENTITY,
            // Written row by row; the columns are the axes.
            Some(text) => DMat3::from_cols_array(&numbers::<9>("Direction", &text)?).transpose(),
        };
        self.whole = Some(Whole {
            kind,
            extent,
            origin: vector("Origin", DVec3::ZERO)?,
            spacing: vector("Spacing", DVec3::ONE)?,
            direction,
        });
        Ok(())
    }

    fn section(
        &mut self,
        tag: &BytesStart<'_>,
        association: Association,
        is_empty: bool,
    ) -> Result<(), Problem> {
        if !is_empty {
            self.section = Some(Section::Data(association));
        }
        if self.pieces.len() == 1 {
            for (rank, kind) in [(0, "Scalars"), (1, "Vectors")] {
                if let Some(name) = attribute(tag, kind)?.filter(|name| !name.is_empty()) {
                    self.active.push((rank, association, name));
                }
            }
        }
        Ok(())
    }

    /// Numbers of the whole file: they are a loss only where they are as many as there are points or cells.
    fn field_data(&mut self, tag: &BytesStart<'_>) -> Result<(), Problem> {
        let tuples = attribute(tag, "NumberOfTuples")?.and_then(|n| n.trim().parse::<u64>().ok());
        let type_name = attribute(tag, "type")?.unwrap_or_default();
        let holds_numbers = ScalarType::from_name(&type_name.to_lowercase()).is_some();
        if holds_numbers && tuples.is_none_or(|tuples| tuples > 1) {
            self.field_data.push(tuples);
        }
        Ok(())
    }

    /// Whether field data are as long as what lies on the points or cells.
    fn loses_field_data(&self) -> bool {
        let sum =
            |of: fn(&Piece<'a>) -> u64| self.pieces.iter().map(of).fold(0, u64::saturating_add);
        let along = |[first, last]: [i64; 2]| last.saturating_sub(first).max(0).unsigned_abs();
        let product = |extent: Extent, more: u64| -> u64 {
            extent
                .map(|axis| along(axis).saturating_add(more).max(1))
                .into_iter()
                .fold(1, u64::saturating_mul)
        };
        let whole = self.whole.as_ref().map(|whole| whole.extent);
        let of_extent = whole.map_or([0; 2], |extent| [product(extent, 1), product(extent, 0)]);
        let cells =
            |piece: &Piece<'a>| piece.counts.iter().map(|(_, n)| *n).fold(0, u64::saturating_add);
        let of_pieces = [sum(|piece| piece.points), sum(cells)];
        self.field_data
            .iter()
            .any(|n| n.is_none_or(|n| of_extent.contains(&n) || of_pieces.contains(&n)))
    }

    /// The byte order matters to numbers that are no text.
    fn needs_order(&self) -> bool {
        let arrays = self.pieces.iter().flat_map(|piece| {
            let cells = piece.cells.iter().map(|(_, array)| array);
            piece.arrays.iter().chain(&piece.geometry).chain(cells)
        });
        arrays.into_iter().any(|array| !matches!(array.place, Place::Text(_)))
    }

    fn array(&mut self, tag: &BytesStart<'_>, is_empty: bool) -> Result<(), Problem> {
        let (Some(section), Some(piece)) = (self.section, self.pieces.last_mut()) else {
            return Ok(());
        };
        let (association, count) = match section {
            Section::Data(association) => (association, piece.arrays.len()),
            Section::Geometry => (Association::Point, piece.geometry.len()),
            Section::Cells(_) => (Association::Cell, piece.cells.len()),
        };
        let name = match attribute(tag, "Name")? {
            Some(name) if !name.is_empty() => name,
            _ => format!("array {count}"),
        };
        let type_name = attribute(tag, "type")?.unwrap_or_default();
        // VTK's words are NumPy's with capitals.
        let Some(scalar_type) = ScalarType::from_name(&type_name.to_lowercase()) else {
            if !matches!(section, Section::Data(_)) {
                return Err(header(
                    format!("a type of the array {} that is {KNOWN_TYPES}", quoted(&name)),
                    quoted(&type_name),
                    "correct the attribute, or write the file again",
                ));
            }
            self.warnings.push(format!(
                "the array {} of type {} is ignored: numbers are read of the types {KNOWN_TYPES}",
                quoted(&name),
                quoted(&type_name)
            ));
            return Ok(());
        };
        // Some writers leave it empty.
        let told = attribute(tag, "NumberOfComponents")?;
        let components = match told.filter(|text| !text.trim().is_empty()) {
            None => 1,
            Some(text) => text.trim().parse().ok().filter(|&n| n > 0).ok_or_else(|| {
                header("NumberOfComponents of at least 1", quoted(&text), "correct the attribute")
            })?,
        };
        let place = match attribute(tag, "format")?.as_deref() {
            None | Some("ascii") => Place::Text(Cow::Borrowed("")),
            Some("binary") => Place::Base64(Cow::Borrowed("")),
            Some("appended") => {
                let text = attribute(tag, "offset")?.unwrap_or_default();
                Place::Appended(text.trim().parse().map_err(|_not| {
                    header("a whole number for offset", quoted(&text), "correct the attribute")
                })?)
            }
            Some(other) => {
                return Err(header(
                    "format ascii, binary or appended",
                    quoted(other),
                    "correct the attribute",
                ));
            }
        };
        let array = Array { name, association, components, scalar_type, place };
        match section {
            Section::Data(_) => piece.arrays.push(array),
            Section::Geometry => piece.geometry.push(array),
            Section::Cells(group) => piece.cells.push((group, array)),
        }
        self.in_array = (!is_empty).then_some(0);
        Ok(())
    }

    fn finish(mut self) -> Result<Document<'a>, Problem> {
        let assumes_order = self.is_order_assumed && self.needs_order();
        let loses_field_data = self.loses_field_data();
        let (Some((endian, word_bytes, compressor)), Some(whole)) = (self.file, self.whole) else {
            return Err(truncated(
                "the elements VTKFile and ImageData, RectilinearGrid, StructuredGrid, UnstructuredGrid or PolyData",
                "that one is missing",
                "the file was cut short: copy it again",
            ));
        };
        self.active
            .sort_by_key(|(rank, association, _)| (*rank, *association == Association::Cell));
        if assumes_order {
            self.warnings.insert(0, "nothing tells the byte order: little is assumed".into());
        }
        if loses_field_data {
            self.warnings.push(IGNORED_FIELD_DATA.into());
        }
        Ok(Document {
            kind: whole.kind,
            endian,
            word_bytes,
            compressor,
            whole_extent: whole.extent,
            origin: whole.origin,
            spacing: whole.spacing,
            direction: whole.direction,
            pieces: self.pieces,
            active: self
                .active
                .into_iter()
                .map(|(_, association, name)| (association, name))
                .collect(),
            warnings: self.warnings,
        })
    }
}

/// A piece's counts, of which there may be none.
fn piece<'a>(tag: &BytesStart<'_>, extent: Extent) -> Result<Piece<'a>, Problem> {
    let count = |name: &str| match attribute(tag, name)? {
        None => Ok(0),
        Some(text) => text.trim().parse::<u64>().map_err(|_not| {
            header(format!("a whole number for {name}"), quoted(&text), "correct the attribute")
        }),
    };
    Ok(Piece {
        extent,
        arrays: Vec::new(),
        geometry: Vec::new(),
        points: count("NumberOfPoints")?,
        counts: vec![
            (Group::Cells, count("NumberOfCells")?),
            (Group::Vertices, count("NumberOfVerts")?),
            (Group::Lines, count("NumberOfLines")?),
            (Group::Polygons, count("NumberOfPolys")?),
            (Group::Strips, count("NumberOfStrips")?),
        ],
        cells: Vec::new(),
        source: attribute(tag, "Source")?,
    })
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, Problem> {
    let malformed = |error: String| {
        header(
            format!("well-formed attributes in <{}>", tag.name().as_ref()),
            quoted(&error),
            "the file was altered: copy it again",
        )
    };
    let found = tag.try_get_attribute(name).map_err(|error| malformed(error.to_string()))?;
    found
        .map(|attribute| {
            let value = attribute.normalized_value(XmlVersion::Implicit1_0);
            value.map(Cow::into_owned).map_err(|error| malformed(error.to_string()))
        })
        .transpose()
}

fn numbers<const N: usize>(name: &str, text: &str) -> Result<[f64; N], Problem> {
    let parsed: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    parsed.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
        header(format!("{N} numbers for {name}"), quoted(text), "correct the attribute")
    })
}

fn extent(text: &str) -> Result<Extent, Problem> {
    let parsed: Option<Vec<i64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    match parsed.as_deref() {
        Some(&[a, b, c, d, e, f]) if a <= b && c <= d && e <= f => Ok([[a, b], [c, d], [e, f]]),
        _ => Err(header(
            "an extent of six whole numbers, first to last along each axis",
            quoted(text),
            "correct the attribute",
        )),
    }
}
