//! What a file says of its pictures: their form, and of each frame where it lies and what its numbers mean.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::super::bytes::Endian;
use super::super::error::{Problem, corrupt, plain, truncated, unsupported};
use super::dataset::{Content, Dataset, Pixels};
use super::{segments, tags};
use crate::volume::{LabelName, ScalarType};

/// More frames than this are a damaged number.
const MOST_FRAMES: u64 = 1 << 20;

/// The form of a picture's numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Form {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) components: usize,
    /// Colours one after another, rather than those of each pixel together.
    pub(super) planar: bool,
    /// 1, 8, 16, 32 or 64.
    pub(super) bits_allocated: u16,
    pub(super) bits_stored: u16,
    pub(super) high_bit: u16,
    pub(super) signed: bool,
    pub(super) is_float: bool,
    pub(super) photometric: String,
}

impl Form {
    /// What samples are read as.
    pub(super) fn scalar_type(&self) -> Result<ScalarType, Problem> {
        Ok(match (self.bits_allocated, self.signed, self.is_float) {
            (32, _, true) => ScalarType::Float32,
            (64, _, true) => ScalarType::Float64,
            (1, _, _) | (8, false, _) => ScalarType::UInt8,
            (8, true, _) => ScalarType::Int8,
            (16, false, _) => ScalarType::UInt16,
            (16, true, _) => ScalarType::Int16,
            (32, false, _) => ScalarType::UInt32,
            (32, true, _) => ScalarType::Int32,
            (bits, _, _) => {
                return Err(unsupported(
                    "pixels of 1, 8, 16 or 32 bits",
                    format!("{bits}"),
                    "convert the file to one of these",
                ));
            }
        })
    }

    /// Numbers of one frame.
    pub(super) fn len(&self) -> usize {
        self.columns * self.rows * self.components
    }
}

/// One picture in space.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    /// Which of its file.
    pub(super) index: u32,
    /// Of the first pixel's middle, millimetres to the left, back and up.
    pub(super) position: Option<DVec3>,
    /// Along rows and down columns.
    pub(super) orientation: Option<[DVec3; 2]>,
    /// Between neighbours along rows and down columns; 0 where nothing tells.
    pub(super) spacing: [f64; 2],
    /// Of the slice; 0 where nothing tells.
    pub(super) thickness: f64,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    /// What orders frames at one place: time, acquisition, number.
    pub(super) order: [i64; 3],
    /// Of a segmentation: whose voxels it marks.
    pub(super) segment: Option<u16>,
}

/// A file of pictures.
#[derive(Debug)]
pub(super) struct Slices {
    pub(super) path: PathBuf,
    pub(super) series: String,
    pub(super) instance: String,
    pub(super) description: String,
    pub(super) series_number: i64,
    pub(super) form: Form,
    pub(super) syntax: String,
    pub(super) endian: Endian,
    pub(super) pixels: Pixels,
    pub(super) frames: Vec<Frame>,
    pub(super) has_table: bool,
    /// Of a segmentation: what its numbers stand for.
    pub(super) segments: Vec<LabelName>,
}

impl Slices {
    /// What its series is called, as people are told it, if anything.
    pub(super) fn described(&self) -> Option<String> {
        let description = self.description.as_str();
        (!description.is_empty()).then(|| plain(description))
    }

    /// # Errors
    /// No DICOM file, or one without pictures.
    pub(super) fn read(path: &Path) -> Result<Self, Problem> {
        let content = Content::read(path)?;
        let dataset = &content.dataset;
        let Some((pixel_tag, pixels)) = content.pixels.clone() else {
            let what = match dataset.text(tags::MODALITY) {
                Some(modality) => format!("none, in an object of the kind {modality}"),
                None => "none".to_owned(),
            };
            return Err(unsupported(
                "a DICOM file with pictures",
                what,
                "choose a file of the series that has them",
            ));
        };
        let form = form(dataset, pixel_tag)?;
        let count = frame_count(dataset)?;
        check_promise(&pixels, &form, count)?;
        let shared = dataset.item(tags::SHARED_GROUPS);
        let each = dataset.items(tags::FRAME_GROUPS);
        let offsets = dataset.decimals(tags::GRID_FRAME_OFFSETS);
        let frames = (0..count).map(|index| {
            let own = usize::try_from(index).ok().and_then(|index| each.get(index));
            let mut frame = Groups { own, shared, root: dataset }.frame(index);
            let offset = offsets.as_ref().and_then(|all| all.get(index as usize));
            if let (Some(offset), Some(position), Some([x, y])) =
                (offset, &mut frame.position, frame.orientation)
            {
                *position += x.cross(y) * *offset;
            } else if count > 1 && own.is_none_or(|own| own.item(tags::PLANE_POSITION).is_none()) {
                // One place for all frames is that of none.
                frame.position = None;
            }
            frame
        });
        Ok(Self {
            path: path.to_owned(),
            series: dataset.text(tags::SERIES_INSTANCE).unwrap_or_default(),
            instance: dataset.text(tags::SOP_INSTANCE).unwrap_or_default(),
            description: dataset.text(tags::SERIES_DESCRIPTION).unwrap_or_default(),
            series_number: dataset.decimal(tags::SERIES_NUMBER).map_or(0, whole),
            form,
            frames: frames.collect(),
            has_table: dataset.item(tags::MODALITY_TABLE).is_some(),
            segments: segments::named(dataset),
            syntax: content.syntax,
            endian: content.endian,
            pixels,
        })
    }
}

#[expect(clippy::cast_possible_truncation, reason = "numbers that order, whatever they are")]
fn whole(number: f64) -> i64 {
    number as i64
}

fn form(dataset: &Dataset, pixel_tag: u32) -> Result<Form, Problem> {
    let require = |tag, name: &str| {
        dataset.short(tag).filter(|&n| n > 0).map(usize::from).ok_or_else(|| {
            truncated(
                format!("the element {name} of a DICOM picture"),
                "none",
                "the file was never complete: export it again",
            )
        })
    };
    let bits_allocated = dataset.short(tags::BITS_ALLOCATED).unwrap_or(match pixel_tag {
        0x7fe0_0008 => 32,
        0x7fe0_0009 => 64,
        _ => 16,
    });
    let bits_stored = dataset.short(tags::BITS_STORED).unwrap_or(bits_allocated);
    let high_bit = dataset.short(tags::HIGH_BIT).unwrap_or(bits_stored.saturating_sub(1));
    if bits_stored == 0 || bits_stored > bits_allocated || high_bit >= bits_allocated {
        return Err(corrupt(
            "as many stored bits as fit into those of a pixel",
            format!("{bits_stored} of {bits_allocated}, up to bit {high_bit}"),
            "the file was altered: export it again",
        ));
    }
    let form = Form {
        columns: require(tags::COLUMNS, "Columns")?,
        rows: require(tags::ROWS, "Rows")?,
        components: dataset.short(tags::SAMPLES_PER_PIXEL).map_or(1, usize::from),
        planar: dataset.short(tags::PLANAR) == Some(1),
        bits_allocated,
        bits_stored,
        high_bit,
        signed: dataset.short(tags::IS_SIGNED) == Some(1),
        is_float: pixel_tag != 0x7fe0_0010,
        photometric: dataset.text(tags::PHOTOMETRIC).unwrap_or_default(),
    };
    if form.components == 0 || form.components > 4 {
        return Err(unsupported(
            "from 1 to 4 numbers a pixel",
            form.components.to_string(),
            "convert the pictures to grey or to RGB",
        ));
    }
    form.scalar_type()?;
    Ok(form)
}

/// Refuses frames that the file cannot hold, before any is thought of.
fn check_promise(pixels: &Pixels, form: &Form, count: u32) -> Result<(), Problem> {
    let (needed, stored, what) = match pixels {
        Pixels::Plain(_, stored) => {
            let bits = (form.len() as u64).saturating_mul(u64::from(form.bits_allocated));
            (bits.saturating_mul(u64::from(count)).div_ceil(8), *stored, "bytes of pixels")
        }
        Pixels::Packed(_, fragments) => {
            (u64::from(count), fragments.len() as u64, "fragments of packed pixels")
        }
    };
    if needed <= stored {
        return Ok(());
    }
    Err(truncated(
        format!("{needed} {what}, as the elements promise"),
        stored.to_string(),
        "the file was cut short: copy it again",
    ))
}

fn frame_count(dataset: &Dataset) -> Result<u32, Problem> {
    let told = dataset.decimal(tags::FRAMES).unwrap_or(1.0);
    let is_sane = told >= 1.0 && told <= MOST_FRAMES as f64 && told.fract() == 0.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
    let count = told as u32;
    is_sane.then_some(count).ok_or_else(|| {
        corrupt(
            "a number of frames of at least 1",
            told.to_string(),
            "the file was altered: export it again",
        )
    })
}

/// Where what holds of a frame may be said: for it, for all, or outside any group.
struct Groups<'a> {
    own: Option<&'a Dataset>,
    shared: Option<&'a Dataset>,
    root: &'a Dataset,
}

impl Groups<'_> {
    /// An element of a group, or outside it.
    fn decimals(&self, group: u32, tag: u32) -> Option<Vec<f64>> {
        let inside = [self.own, self.shared].into_iter().flatten();
        let found = inside.filter_map(|groups| groups.item(group)?.decimals(tag)).next();
        found.or_else(|| self.root.decimals(tag))
    }

    fn decimal(&self, group: u32, tag: u32) -> Option<f64> {
        self.decimals(group, tag)?.first().copied()
    }

    fn frame(&self, index: u32) -> Frame {
        let vector = |v: &[f64]| DVec3::new(v[0], v[1], v[2]);
        let position = self.decimals(tags::PLANE_POSITION, tags::IMAGE_POSITION);
        let orientation = self.decimals(tags::PLANE_ORIENTATION, tags::IMAGE_ORIENTATION);
        let orientation = orientation.filter(|v| v.len() == 6).and_then(|v| {
            let [x, y] = [vector(&v[..3]), vector(&v[3..])];
            let [x, y] = [x.try_normalize()?, y.try_normalize()?];
            (x.dot(y).abs() < 0.1).then_some([x, y])
        });
        let spacing = self
            .decimals(tags::PIXEL_MEASURES, tags::PIXEL_SPACING)
            .or_else(|| self.root.decimals(tags::IMAGER_PIXEL_SPACING))
            .filter(|v| v.len() == 2 && v.iter().all(|n| *n > 0.0));
        let measure = |tag| self.decimal(tags::PIXEL_MEASURES, tag).map(f64::abs);
        let thickness = measure(tags::SPACING_BETWEEN_SLICES).filter(|n| *n > 0.0);
        let transformed = |tag| self.decimal(tags::VALUE_TRANSFORMATION, tag);
        let content = self.own.and_then(|own| own.item(tags::FRAME_CONTENT));
        let time = content.and_then(|c| c.long(tags::TEMPORAL_POSITION_INDEX)).map(i64::from);
        let number = |tag| self.root.decimal(tag).map_or(0, whole);
        let segment = self.own.and_then(|own| own.item(tags::SEGMENT_IDENTIFICATION));
        Frame {
            index,
            position: position.filter(|v| v.len() == 3).map(|v| vector(&v)),
            orientation,
            // The file tells the distance of rows first.
            spacing: spacing.map_or([0.0; 2], |v| [v[1], v[0]]),
            thickness: thickness.or_else(|| measure(tags::SLICE_THICKNESS)).unwrap_or_default(),
            slope: transformed(tags::RESCALE_SLOPE)
                .or_else(|| self.root.decimal(tags::DOSE_SCALING))
                .filter(|slope| *slope != 0.0)
                .unwrap_or(1.0),
            intercept: transformed(tags::RESCALE_INTERCEPT).unwrap_or(0.0),
            order: [
                time.unwrap_or_else(|| number(tags::TEMPORAL_POSITION)),
                number(tags::ACQUISITION_NUMBER),
                number(tags::INSTANCE_NUMBER) + i64::from(index),
            ],
            segment: segment.and_then(|item| item.short(tags::REFERENCED_SEGMENT)),
        }
    }
}
