//! What is written over a picture: scalar bar, scale bar, axes and trihedron, as plain data, and as
//! lines, rectangles and words in pixels, which the window and files paint each in its own way.

mod axes;
mod primitives;
mod scalar_bar;
mod scale_bar;
mod ticks;
mod trihedron;

use serde::{Deserialize, Serialize};

pub use primitives::{Area, Ink, Primitive};
pub use ticks::{Number, round_below, ticks};
pub use trihedron::AxisEnd;

use crate::core::names;
use crate::scene::{Background, Scene};
use primitives::{Inks, Sheet};

/// Ems of a picture this high, and of one as narrow as 4:3: smaller ones have smaller words.
const EMS: f64 = 54.0;
/// Least size of words that can be read, pixels.
const LEAST_EM: f64 = 10.5;
/// Distance of what stands at the picture's edges from them, ems.
const MARGIN: f64 = 1.1;

/// Pictures with fewer ems than this along a side are small: the box around the volume gives way to what
/// else is asked for.
const SMALL: f64 = 28.0;
/// What takes its room before what.
const IN_TURN: [Annotation; 4] =
    [Annotation::ScalarBar, Annotation::ScaleBar, Annotation::Trihedron, Annotation::Axes];

/// One thing that is written over a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Annotation {
    /// Which colour is which value, and how opaque that is.
    ScalarBar,
    /// A round length in the world.
    ScaleBar,
    /// The box around the volume, and where it lies in the world.
    Axes,
    /// The directions of the world's axes.
    Trihedron,
}

names!(Annotation[4] {
    ScalarBar => "scalar-bar",
    ScaleBar => "scale-bar",
    Axes => "axes",
    Trihedron => "trihedron",
});

/// Which annotations a picture has. Each has its place: the scalar bar at the right, the scale bar
/// below it, the trihedron in the lower left corner, the axes around the volume; all grow with the
/// picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Annotations {
    /// See [`Annotation::ScalarBar`].
    pub scalar_bar: bool,
    /// See [`Annotation::ScaleBar`].
    pub scale_bar: bool,
    /// See [`Annotation::Axes`].
    pub axes: bool,
    /// See [`Annotation::Trihedron`].
    pub trihedron: bool,
}

impl Annotations {
    /// None of them.
    pub const NONE: Self =
        Self { scalar_bar: false, scale_bar: false, axes: false, trihedron: false };

    /// The switch of one of them.
    pub fn switch(&mut self, which: Annotation) -> &mut bool {
        match which {
            Annotation::ScalarBar => &mut self.scalar_bar,
            Annotation::ScaleBar => &mut self.scale_bar,
            Annotation::Axes => &mut self.axes,
            Annotation::Trihedron => &mut self.trihedron,
        }
    }

    /// Whether one of them is on.
    pub fn has(mut self, which: Annotation) -> bool {
        *self.switch(which)
    }

    /// Whether any is on.
    pub fn any(self) -> bool {
        self != Self::NONE
    }
}

/// Annotations of one picture, ready to be painted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// What to paint, in this order.
    pub primitives: Vec<Primitive>,
    /// What was asked for and has no room in the picture.
    pub left_out: Vec<Annotation>,
    /// The ends of the trihedron's axes, the farthest from the eye first; none where it is not shown.
    pub axis_ends: Vec<AxisEnd>,
    /// Room that words and bars have taken.
    pub taken: Vec<Area>,
}

/// Lays annotations out over a scene's picture of `size` pixels. `space` is what the file calls its
/// space, and `width_of` the width of words in ems.
///
/// Annotations never cover one another; words that would have no room are left out, and so is a whole
/// annotation that would. Which colour is which value counts most, then lengths, then directions; the box
/// around the volume gives way to all of them in small pictures. A scalar bar of nothing is no bar, and is
/// not told as left out.
pub fn lay_out(
    annotations: Annotations,
    scene: &Scene,
    space: Option<&str>,
    size: [u32; 2],
    width_of: &dyn Fn(&str) -> f64,
) -> Layout {
    let background = match scene.background {
        Background::Colour(colour) => Some(colour),
        Background::Transparent => None,
    };
    let unit = scene.volume().and_then(|volume| volume.unit.as_deref());
    let mut sheet = Sheet::new(size, em_of(size), Inks::over(background), width_of);
    let (mut left_out, mut axis_ends) = (Vec::new(), Vec::new());
    // What counts most takes its room first; nothing of the axes lies under what stands in a corner.
    for which in IN_TURN.into_iter().filter(|which| annotations.has(*which)) {
        let fits = match which {
            Annotation::ScalarBar => scalar_bar::lay_out(&mut sheet, scene, annotations.scale_bar),
            Annotation::ScaleBar => scale_bar::lay_out(&mut sheet, &scene.camera, unit),
            Annotation::Trihedron => {
                let ends = trihedron::lay_out(&mut sheet, &scene.camera, space);
                axis_ends = ends.clone().unwrap_or_default();
                ends.is_some()
            }
            Annotation::Axes => axes::lay_out(&mut sheet, scene, space),
        };
        if !fits {
            left_out.push(which);
        }
    }
    Layout { primitives: sheet.primitives, left_out, axis_ends, taken: sheet.taken }
}

/// Pixels of an em: words are as large a part of any picture, but never too small to be read.
fn em_of([width, height]: [u32; 2]) -> f64 {
    let high = f64::from(height).min(f64::from(width) * 0.75);
    (high / EMS).max(LEAST_EM)
}

#[cfg(test)]
mod tests;
