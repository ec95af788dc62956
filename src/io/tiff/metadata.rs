//! What ImageJ and OME write into a TIFF file's description: which pages are slices, channels and times, and how far
//! apart pixels are.

use quick_xml::events::Event;
use quick_xml::reader::Reader;

use crate::volume::length_unit;

/// What one dimension of the pages is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dimension {
    Slices,
    Channels,
    Times,
}

/// The dimensions of the pages, the fastest first, and distances where they are told.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pages {
    pub(super) order: Vec<(Dimension, usize)>,
    /// Of pixels along x and y, where the description tells them.
    pub(super) spacing: [Option<f64>; 2],
    pub(super) slice_spacing: Option<f64>,
    pub(super) unit: Option<String>,
    /// The tags for resolution count pixels a unit of `unit`.
    pub(super) resolution_is_of_unit: bool,
}

impl Pages {
    /// Of a file that tells nothing: slices.
    pub(super) fn plain(count: usize) -> Self {
        Self {
            order: vec![(Dimension::Slices, count)],
            spacing: [None; 2],
            slice_spacing: None,
            unit: None,
            resolution_is_of_unit: false,
        }
    }

    /// Of a description, where it is one of ImageJ or OME and tells of as many pages as there are.
    pub(super) fn of(description: &str, count: usize) -> Option<Self> {
        let pages = if description.starts_with("ImageJ=") {
            of_imagej(description)
        } else if description.contains("<OME") {
            of_ome(description)?
        } else {
            return None;
        };
        let told: Option<usize> =
            pages.order.iter().map(|(_, n)| *n).try_fold(1, |a: usize, n| a.checked_mul(n));
        (told == Some(count)).then_some(pages)
    }

    /// Whether a description is one that tells of pages.
    pub(super) fn are_told(description: &str) -> bool {
        description.starts_with("ImageJ=") || description.contains("<OME")
    }

    /// How many pages a description of ImageJ's promises, of which a large file may have the first alone.
    pub(super) fn promised(description: &str) -> Option<usize> {
        let is_imagej = description.starts_with("ImageJ=");
        is_imagej.then(|| number(description, "images")).flatten()
    }
}

fn value<'a>(description: &'a str, key: &str) -> Option<&'a str> {
    description.lines().find_map(|line| Some(line.strip_prefix(key)?.strip_prefix('=')?.trim()))
}

fn number(description: &str, key: &str) -> Option<usize> {
    value(description, key)?.parse().ok().filter(|&n| n > 0)
}

fn of_imagej(description: &str) -> Pages {
    let count = |key| number(description, key).unwrap_or(1);
    let (channels, mut slices, frames) = (count("channels"), count("slices"), count("frames"));
    if [channels, slices, frames] == [1; 3] {
        slices = count("images");
    }
    let spacing = value(description, "spacing").and_then(|word| word.parse().ok());
    Pages {
        order: vec![
            (Dimension::Channels, channels),
            (Dimension::Slices, slices),
            (Dimension::Times, frames),
        ],
        spacing: [None; 2],
        slice_spacing: spacing.filter(|n: &f64| n.is_finite() && *n > 0.0),
        // Java's escapes.
        unit: value(description, "unit")
            .map(|word| word.replace("\\u00B5", "µ"))
            .and_then(|word| length_unit(&word)),
        resolution_is_of_unit: true,
    }
}

fn of_ome(description: &str) -> Option<Pages> {
    let mut reader = Reader::from_str(description);
    loop {
        match reader.read_event().ok()? {
            Event::Eof => return None,
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "Pixels" => {
                let attribute = |name: &str| -> Option<String> {
                    let found = tag.try_get_attribute(name).ok().flatten()?;
                    Some(found.value.into_owned())
                };
                let size =
                    |name| attribute(name).and_then(|n| n.parse().ok()).filter(|&n: &usize| n > 0);
                let length = |name| {
                    attribute(name)
                        .and_then(|n| n.parse::<f64>().ok())
                        .filter(|n| n.is_finite() && *n > 0.0)
                };
                let order = attribute("DimensionOrder").unwrap_or_else(|| "XYZCT".to_owned());
                let order = order.chars().filter_map(|axis| {
                    let (dimension, name) = match axis {
                        'Z' => (Dimension::Slices, "SizeZ"),
                        'C' => (Dimension::Channels, "SizeC"),
                        'T' => (Dimension::Times, "SizeT"),
                        _ => return None,
                    };
                    Some((dimension, size(name).unwrap_or(1)))
                });
                return Some(Pages {
                    order: order.collect(),
                    spacing: [length("PhysicalSizeX"), length("PhysicalSizeY")],
                    slice_spacing: length("PhysicalSizeZ"),
                    // OME's own unit is the micrometre.
                    unit: length_unit(
                        &attribute("PhysicalSizeXUnit").unwrap_or_else(|| "µm".to_owned()),
                    )
                    .filter(|_| length("PhysicalSizeX").is_some()),
                    resolution_is_of_unit: false,
                });
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imagej_tells_channels_slices_and_times() {
        let text = "ImageJ=1.53t\nimages=24\nchannels=2\nslices=4\nframes=3\nhyperstack=true\nunit=micron\nspacing=0.5\n";
        let pages = Pages::of(text, 24).unwrap();
        let order = [(Dimension::Channels, 2), (Dimension::Slices, 4), (Dimension::Times, 3)];
        assert_eq!((pages.order, pages.slice_spacing), (order.to_vec(), Some(0.5)));
        assert_eq!(pages.unit.as_deref(), Some("µm"));
        assert_eq!(Pages::of(text, 23), None, "of another number of pages");
        assert_eq!(Pages::promised(text), Some(24));
        let plain = Pages::of("ImageJ=1.0\nimages=10\n", 10).unwrap();
        assert_eq!(plain.order[1], (Dimension::Slices, 10));
    }

    #[test]
    fn ome_tells_an_order_and_lengths() {
        let text = "<?xml version=\"1.0\"?><OME xmlns=\"o\"><Image><Pixels DimensionOrder=\"XYCZT\" SizeC=\"2\" \
            SizeT=\"1\" SizeX=\"9\" SizeY=\"8\" SizeZ=\"3\" PhysicalSizeX=\"0.1\" PhysicalSizeY=\"0.2\" \
            PhysicalSizeZ=\"0.7\"><Channel/></Pixels></Image></OME>";
        let pages = Pages::of(text, 6).unwrap();
        assert_eq!(pages.order[..2], [(Dimension::Channels, 2), (Dimension::Slices, 3)]);
        assert_eq!((pages.spacing, pages.slice_spacing), ([Some(0.1), Some(0.2)], Some(0.7)));
        assert_eq!(pages.unit.as_deref(), Some("µm"));
        assert_eq!(Pages::of("<OME", 6), None);
        assert_eq!(Pages::of("anything", 6), None);
        assert!(Pages::are_told("<OME") && !Pages::are_told("anything"));
    }

    #[test]
    fn sizes_whose_product_has_no_number_are_of_no_file() {
        let huge = usize::MAX / 2 + 1;
        let text = format!("ImageJ=1.0\nchannels={huge}\nslices=2\nframes=2\n");
        assert_eq!(Pages::of(&text, 1), None);
    }
}
