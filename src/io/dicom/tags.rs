//! The elements that tell of pictures and of where they lie, by group and number (DICOM PS3.6).

pub(super) const TRANSFER_SYNTAX: u32 = 0x0002_0010;
pub(super) const SOP_CLASS: u32 = 0x0008_0016;
pub(super) const SOP_INSTANCE: u32 = 0x0008_0018;
pub(super) const MODALITY: u32 = 0x0008_0060;
pub(super) const SERIES_DESCRIPTION: u32 = 0x0008_103e;
pub(super) const SLICE_THICKNESS: u32 = 0x0018_0050;
pub(super) const SPACING_BETWEEN_SLICES: u32 = 0x0018_0088;
pub(super) const IMAGER_PIXEL_SPACING: u32 = 0x0018_1164;
pub(super) const SERIES_INSTANCE: u32 = 0x0020_000e;
pub(super) const SERIES_NUMBER: u32 = 0x0020_0011;
pub(super) const ACQUISITION_NUMBER: u32 = 0x0020_0012;
pub(super) const INSTANCE_NUMBER: u32 = 0x0020_0013;
pub(super) const IMAGE_POSITION: u32 = 0x0020_0032;
pub(super) const IMAGE_ORIENTATION: u32 = 0x0020_0037;
pub(super) const TEMPORAL_POSITION: u32 = 0x0020_0100;
pub(super) const TEMPORAL_POSITION_INDEX: u32 = 0x0020_9128;
pub(super) const FRAME_CONTENT: u32 = 0x0020_9111;
pub(super) const PLANE_POSITION: u32 = 0x0020_9113;
pub(super) const PLANE_ORIENTATION: u32 = 0x0020_9116;
pub(super) const SAMPLES_PER_PIXEL: u32 = 0x0028_0002;
pub(super) const PHOTOMETRIC: u32 = 0x0028_0004;
pub(super) const PLANAR: u32 = 0x0028_0006;
pub(super) const FRAMES: u32 = 0x0028_0008;
pub(super) const ROWS: u32 = 0x0028_0010;
pub(super) const COLUMNS: u32 = 0x0028_0011;
pub(super) const PIXEL_SPACING: u32 = 0x0028_0030;
pub(super) const BITS_ALLOCATED: u32 = 0x0028_0100;
pub(super) const BITS_STORED: u32 = 0x0028_0101;
pub(super) const HIGH_BIT: u32 = 0x0028_0102;
pub(super) const IS_SIGNED: u32 = 0x0028_0103;
pub(super) const RESCALE_INTERCEPT: u32 = 0x0028_1052;
pub(super) const RESCALE_SLOPE: u32 = 0x0028_1053;
pub(super) const MODALITY_TABLE: u32 = 0x0028_3000;
pub(super) const PIXEL_MEASURES: u32 = 0x0028_9110;
pub(super) const VALUE_TRANSFORMATION: u32 = 0x0028_9145;
pub(super) const SEGMENTS: u32 = 0x0062_0002;
pub(super) const SEGMENT_NUMBER: u32 = 0x0062_0004;
pub(super) const SEGMENT_LABEL: u32 = 0x0062_0005;
pub(super) const SEGMENT_IDENTIFICATION: u32 = 0x0062_000a;
pub(super) const REFERENCED_SEGMENT: u32 = 0x0062_000b;
pub(super) const SEGMENT_COLOUR: u32 = 0x0062_000d;
pub(super) const GRID_FRAME_OFFSETS: u32 = 0x3004_000c;
pub(super) const DOSE_SCALING: u32 = 0x3004_000e;
pub(super) const SHARED_GROUPS: u32 = 0x5200_9229;
pub(super) const FRAME_GROUPS: u32 = 0x5200_9230;

/// Pixels of floats, of floats of 64 bits, and of whole numbers.
pub(super) const PIXELS: [u32; 3] = [0x7fe0_0008, 0x7fe0_0009, 0x7fe0_0010];

/// Sequences among those that are kept: files without letters do not say so.
pub(super) const SEQUENCES: [u32; 10] = [
    FRAME_CONTENT,
    PLANE_POSITION,
    PLANE_ORIENTATION,
    MODALITY_TABLE,
    PIXEL_MEASURES,
    VALUE_TRANSFORMATION,
    SEGMENTS,
    SEGMENT_IDENTIFICATION,
    SHARED_GROUPS,
    FRAME_GROUPS,
];

/// What is kept of a file, in order.
pub(super) const KEPT: [u32; 45] = [
    TRANSFER_SYNTAX,
    SOP_CLASS,
    SOP_INSTANCE,
    MODALITY,
    SERIES_DESCRIPTION,
    SLICE_THICKNESS,
    SPACING_BETWEEN_SLICES,
    IMAGER_PIXEL_SPACING,
    SERIES_INSTANCE,
    SERIES_NUMBER,
    ACQUISITION_NUMBER,
    INSTANCE_NUMBER,
    IMAGE_POSITION,
    IMAGE_ORIENTATION,
    TEMPORAL_POSITION,
    FRAME_CONTENT,
    PLANE_POSITION,
    PLANE_ORIENTATION,
    TEMPORAL_POSITION_INDEX,
    SAMPLES_PER_PIXEL,
    PHOTOMETRIC,
    PLANAR,
    FRAMES,
    ROWS,
    COLUMNS,
    PIXEL_SPACING,
    BITS_ALLOCATED,
    BITS_STORED,
    HIGH_BIT,
    IS_SIGNED,
    RESCALE_INTERCEPT,
    RESCALE_SLOPE,
    MODALITY_TABLE,
    PIXEL_MEASURES,
    VALUE_TRANSFORMATION,
    SEGMENTS,
    SEGMENT_NUMBER,
    SEGMENT_LABEL,
    SEGMENT_IDENTIFICATION,
    REFERENCED_SEGMENT,
    SEGMENT_COLOUR,
    GRID_FRAME_OFFSETS,
    DOSE_SCALING,
    SHARED_GROUPS,
    FRAME_GROUPS,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_in_order_so_that_it_is_found() {
        assert!(KEPT.is_sorted());
        assert!(SEQUENCES.iter().all(|tag| KEPT.binary_search(tag).is_ok()));
    }
}
