//! Where each setting of the side panel stands, for those who look for it by name.

use super::flow::FLOW;
use super::{CLIP, DATA, FUNCTIONS, ON_TOP, SHADING, SPLATS, TRANSFER, VECTORS, VIEW};

/// A setting and the section that it stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// As the side panel writes it.
    pub name: &'static str,
    /// The section.
    pub section: &'static str,
    /// What it is for, one line.
    pub help: &'static str,
}

const fn place(section: &'static str, name: &'static str, help: &'static str) -> Place {
    Place { name, section, help }
}

/// What saves a cycle of the animation.
pub(in crate::app) const SAVE_LOOP: &str = "Save loop…";

/// In the order of the side panel, without what is a command, too.
pub const PLACES: [Place; 48] = [
    place(DATA, "Dimensions", "How many samples the volume has along each axis"),
    place(DATA, "Range", "The least and the greatest value of the data"),
    place(DATA, "Spacing", "How far samples are apart, in the file's units"),
    place(DATA, "Memory", "What the samples take"),
    place(VECTORS, "Speed", "How fast the marks of vectors move along the flow"),
    place(VECTORS, "Phase", "How far the marks have moved: the animation, by hand"),
    place(VECTORS, "Pictures a second", "How often an animation is drawn at most"),
    place(VECTORS, SAVE_LOOP, "The animation as a GIF or a series of pictures"),
    place(VECTORS, "Visible from", "Shorter vectors are transparent"),
    place(VECTORS, "Opaque from", "Vectors of this length have the greatest opacity"),
    place(
        VECTORS,
        "Mode",
        "Blend or Modulate: how marks and the texture of splats meet the colour",
    ),
    place(VECTORS, "Marks", "What is drawn on each vector's splat: streaks, comets, dots"),
    place(VECTORS, "Shape", "The splats of vectors: their radius, how they are stretched"),
    place(VECTORS, "Coloured by", "Length, a component, or the scalar field"),
    place(VECTORS, "Hide the scalar field", "Draw the vectors alone"),
    place(VECTORS, "Second field", "Draw other vectors of the file beside the first"),
    place(VECTORS, FLOW, "Tubes along the vectors, and arrows on a plane"),
    place(TRANSFER, "Preset", "Opacities and colours to begin with"),
    place(TRANSFER, "Colours", "The colour map, and a map's colours one by one"),
    place(TRANSFER, "Range", "Which values the colours span"),
    place(TRANSFER, "Opacity", "The curve of opacities over the histogram; drag its points"),
    place(TRANSFER, "Gaussians", "Opacities as bells that are moved and widened"),
    place(TRANSFER, "Boundaries", "Regions: opacities by value and gradient strength at once"),
    place(TRANSFER, "Percentiles", "Which part of the values is left out at either end"),
    place(
        TRANSFER,
        "Rescale to",
        "Stretch colours and opacities over the full range or percentiles",
    ),
    place(TRANSFER, "Copy, save", "Take a transfer function to another file"),
    place(TRANSFER, "Log", "The histogram's counts by their logarithm"),
    place(SHADING, "Preset", "None, lights, surface or cloud"),
    place(SHADING, "Lights", "Where light comes from, and its colour"),
    place(
        SHADING,
        "By gradient strength or depth",
        "Opacity and colour by gradient or depth in place of the value",
    ),
    place(ON_TOP, "Rendering", "Volume, maximum (MIP), minimum or average along each ray"),
    place(CLIP, "Coloured faces", "Paint what a cut opens by its values"),
    place(SPLATS, "Preset", "Exact, or the papers' ways to splat"),
    place(SPLATS, "Kernel", "What a sample's splat is: how values between samples are found"),
    place(SPLATS, "Extent", "How far a splat reaches"),
    place(SPLATS, "Slabs per voxel", "How finely rays are cut: accuracy against time"),
    place(FUNCTIONS, "Encode", "Write the data as a few hundred basis functions"),
    place(VIEW, "Projection", "Parallel rays (orthographic) or perspective"),
    place(VIEW, "Background", "The colour behind the volume: black, white, another or none"),
    place(VIEW, "Turning", "Turntable or trackball"),
    place(VIEW, "Up axis", "Which axis of the data points up"),
    place(VIEW, "Annotations", "Scalar bar, scale bar, axes, trihedron"),
    place(VIEW, "While moving", "How long a picture may take while the view moves: usual choices"),
    place(VIEW, "Frame budget", "How long a picture may take while the view moves"),
    place(VIEW, "Full quality while moving", "Draw up to full quality even while the hand moves"),
    place(
        VIEW,
        "Advanced refinement",
        "Moving picture: octree or fewer pixels; Octree error; partial pictures",
    ),
    place(
        VIEW,
        "Go on refining at rest",
        "Draw the view in ever thinner slabs while nothing moves",
    ),
    place(VIEW, "Smooth edges at rest", "Antialiasing of isosurfaces, slices, cuts and labels"),
];
