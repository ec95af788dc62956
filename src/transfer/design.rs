//! A transfer function as people keep and exchange it: text in JSON.

use std::fmt::Write as _;

use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::gaussian::{Gaussian, MOST_GAUSSIANS, points_of};
use super::{
    ColourMap, ColourSource, NoData, Region, RegionError, RegionShape, TransferError,
    TransferFunction, regions,
};
use crate::core::Srgb8;

/// What the text says that it is.
const FORMAT: &str = "voxsplat transfer function";
/// The version written, and the only one read.
const VERSION: u64 = 1;
/// Longer texts are not looked at.
pub const MOST_TEXT_BYTES: usize = 1 << 20;
/// How many opacity points, and how many colour stops, a text may hold.
pub const MOST_POINTS: usize = 4096;

/// A transfer function, and what its opacities were made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// What is drawn.
    pub function: TransferFunction,
    /// The bells that its opacity points follow; none where the points are their own source.
    pub gaussians: Vec<Gaussian>,
    /// Opacities and colours by value and gradient strength, in place of its opacities; perhaps none.
    pub regions: Vec<Region>,
}

impl From<TransferFunction> for Design {
    fn from(function: TransferFunction) -> Self {
        Self { function, gaussians: Vec::new(), regions: Vec::new() }
    }
}

/// Why a text is no transfer function.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// More text than any transfer function needs.
    #[error(
        "expected a transfer function of at most {} KiB, found {bytes} bytes; is it another file?",
        MOST_TEXT_BYTES / 1024
    )]
    TooLong {
        /// Its length.
        bytes: u64,
    },
    /// No JSON, or JSON of something else.
    #[error("expected a transfer function as JSON (\"format\": \"{FORMAT}\"), found {found}")]
    Unrecognised {
        /// What was found.
        found: String,
    },
    /// From a program that knows more.
    #[error(
        "expected version {VERSION} of the transfer function format, found version {found}; \
         a newer program may read it"
    )]
    Version {
        /// The version.
        found: String,
    },
    /// Entries missing, of the wrong kind or too many.
    #[error("expected {expected} in the transfer function, found {found}")]
    Entry {
        /// What it should have been.
        expected: String,
        /// What was found.
        found: String,
    },
    /// All entries are there, but they mean nothing.
    #[error(transparent)]
    Meaning(#[from] TransferError),
    /// The same of a region.
    #[error(transparent)]
    Region(#[from] RegionError),
}

/// The first look: whether it is one at all.
#[derive(Deserialize)]
struct Header {
    format: Option<serde_json::Value>,
    version: Option<serde_json::Value>,
}

/// The second look. Either opacity points or Gaussians.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    #[serde(rename = "format")]
    _format: IgnoredAny,
    #[serde(rename = "version")]
    _version: IgnoredAny,
    opacity: Option<Vec<(f64, f64)>>,
    gaussians: Option<Vec<Gaussian>>,
    colours: Colours,
    no_data: Option<NoDataText>,
    #[serde(default)]
    regions: Vec<RegionText>,
}

/// A region of value and gradient strength.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "entries with names, in braces")]
struct RegionText {
    shape: String,
    values: [f64; 2],
    strengths: [f64; 2],
    softness: f64,
    opacity: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    colour: Option<String>,
}

impl From<&Region> for RegionText {
    fn from(region: &Region) -> Self {
        let Region { shape, values, strengths, softness, opacity, colour } = *region;
        let (shape, colour) = (shape.name().to_owned(), colour.map(hex));
        Self { shape, values, strengths, softness, opacity, colour }
    }
}

impl RegionText {
    fn region(self) -> Result<Region, DesignError> {
        let Self { shape, values, strengths, softness, opacity, colour } = self;
        let shape = RegionShape::from_name(&shape).ok_or_else(|| {
            let names = RegionShape::ALL.map(RegionShape::name).join(", ");
            entry(format!("one of the shapes {names}"), shortened(&shape))
        })?;
        let colour = colour.map(|text| read_colour(&text)).transpose()?;
        Ok(Region { shape, values, strengths, softness, opacity, colour })
    }
}

/// What NaN looks like, where it is seen.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "entries with names, in braces")]
struct NoDataText {
    opacity: f64,
    colour: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "entries with names, in braces")]
struct Colours {
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stops: Option<Vec<(f64, String)>>,
}

fn entry(expected: impl Into<String>, found: impl Into<String>) -> DesignError {
    DesignError::Entry { expected: expected.into(), found: found.into() }
}

impl Design {
    /// A function of bells.
    ///
    /// # Errors
    /// Where a bell is none, there are more than [`MOST_GAUSSIANS`], or the colours mean nothing.
    pub fn of_gaussians(
        gaussians: Vec<Gaussian>,
        colour: ColourSource,
    ) -> Result<Self, DesignError> {
        at_most(MOST_GAUSSIANS, gaussians.len(), "Gaussians")?;
        for bell in &gaussians {
            bell.validate()?;
        }
        let function = TransferFunction::of(points_of(&gaussians), colour);
        function.validate()?;
        Ok(Self { function, gaussians, regions: Vec::new() })
    }

    /// With NaN looking so.
    #[must_use]
    fn with_no_data(mut self, no_data: NoData) -> Self {
        self.function.no_data = no_data;
        self
    }

    /// The text that [`Design::from_text`] reads: JSON with a line for each point.
    pub fn to_text(&self) -> String {
        let rows = if self.gaussians.is_empty() {
            list("opacity", &self.function.opacity)
        } else {
            list("gaussians", &self.gaussians)
        };
        let colours = match &self.function.colour {
            ColourSource::Map { map, range } => {
                let map = Some(map.name().to_owned());
                let colours = Colours { map, range: Some(*range), stops: None };
                format!("  \"colours\": {}", json(&colours))
            }
            ColourSource::Stops(stops) => {
                let stops: Vec<_> = stops.iter().map(|(v, c)| (*v, hex(*c))).collect();
                let list = list("stops", &stops).replace('\n', "\n  ");
                format!("  \"colours\": {{\n  {list}\n  }}")
            }
        };
        let mut more = String::new();
        if self.function.no_data != NoData::default() {
            let NoData { opacity, colour } = self.function.no_data;
            let text = NoDataText { opacity, colour: hex(colour) };
            write!(more, ",\n  \"no_data\": {}", json(&text)).ok();
        }
        if !self.regions.is_empty() {
            let texts: Vec<RegionText> = self.regions.iter().map(RegionText::from).collect();
            write!(more, ",\n{}", list("regions", &texts)).ok();
        }
        format!(
            "{{\n  \"format\": \"{FORMAT}\",\n  \"version\": {VERSION},\n{rows},\n{colours}{more}\n}}\n"
        )
    }

    /// Reads what [`Design::to_text`] writes, and what people make of it: entries in any order.
    ///
    /// # Errors
    /// See [`DesignError`].
    pub fn from_text(text: &str) -> Result<Self, DesignError> {
        if text.len() > MOST_TEXT_BYTES {
            return Err(DesignError::TooLong { bytes: text.len() as u64 });
        }
        // Entries in an order are no names for them.
        if !text.trim_start().starts_with('{') {
            let found = match text.trim().is_empty() {
                true => "no text".to_owned(),
                false => format!("what is none ({})", shortened(text.trim())),
            };
            return Err(DesignError::Unrecognised { found });
        }
        let header: Header = serde_json::from_str(text).map_err(|error| {
            DesignError::Unrecognised { found: format!("what is none ({error})") }
        })?;
        match &header.format {
            Some(serde_json::Value::String(format)) if format == FORMAT => {}
            Some(other) => {
                let found = format!("\"format\": {}", shortened(&other.to_string()));
                return Err(DesignError::Unrecognised { found });
            }
            None => {
                let found = "JSON without \"format\"".to_owned();
                return Err(DesignError::Unrecognised { found });
            }
        }
        match &header.version {
            Some(version) if version.as_u64() == Some(VERSION) => {}
            Some(version) => {
                return Err(DesignError::Version { found: shortened(&version.to_string()) });
            }
            None => return Err(DesignError::Version { found: "nothing".to_owned() }),
        }
        let text: Text = serde_json::from_str(text).map_err(|error| {
            entry("\"opacity\" or \"gaussians\", and \"colours\"", error.to_string())
        })?;
        let colour = text.colours.source()?;
        let no_data = match text.no_data {
            None => NoData::default(),
            Some(NoDataText { opacity, colour }) => {
                NoData { opacity, colour: read_colour(&colour)? }
            }
        };
        let design = match (text.opacity, text.gaussians) {
            (Some(opacity), None) => {
                at_most(MOST_POINTS, opacity.len(), "opacity points")?;
                let function = TransferFunction { opacity, colour, no_data };
                function.validate()?;
                Ok(function.into())
            }
            (None, Some(gaussians)) if gaussians.is_empty() => {
                Err(entry("at least one Gaussian", "none"))
            }
            (None, Some(gaussians)) => Self::of_gaussians(gaussians, colour),
            (Some(_), Some(_)) => Err(entry("either \"opacity\" or \"gaussians\"", "both")),
            (None, None) => Err(entry("\"opacity\" or \"gaussians\"", "neither")),
        }?;
        let mut design = design.with_no_data(no_data);
        design.function.validate()?;
        design.regions =
            text.regions.into_iter().map(RegionText::region).collect::<Result<_, _>>()?;
        regions::validate(&design.regions)?;
        Ok(design)
    }
}

impl Colours {
    fn source(self) -> Result<ColourSource, DesignError> {
        match (self.map, self.range, self.stops) {
            (Some(name), Some(range), None) => {
                let map = ColourMap::from_name(&name).ok_or_else(|| {
                    let names = ColourMap::ALL.map(ColourMap::name).join(", ");
                    entry(format!("one of the colour maps {names}"), shortened(&name))
                })?;
                Ok(ColourSource::Map { map, range })
            }
            (None, None, Some(stops)) => {
                at_most(MOST_POINTS, stops.len(), "colour stops")?;
                let read = |(value, text): (f64, String)| Ok((value, read_colour(&text)?));
                Ok(ColourSource::Stops(
                    stops.into_iter().map(read).collect::<Result<_, DesignError>>()?,
                ))
            }
            (map, range, stops) => {
                let given = [
                    (map.is_some(), "map"),
                    (range.is_some(), "range"),
                    (stops.is_some(), "stops"),
                ];
                let given: Vec<_> =
                    given.into_iter().filter_map(|(is, name)| is.then_some(name)).collect();
                let found =
                    if given.is_empty() { "none of them".to_owned() } else { given.join(" and ") };
                Err(entry("\"colours\" by \"map\" and \"range\", or by \"stops\"", found))
            }
        }
    }
}

fn hex(Srgb8([r, g, b]): Srgb8) -> String {
    format!("{r:02x}{g:02x}{b:02x}")
}

fn read_colour(text: &str) -> Result<Srgb8, DesignError> {
    Srgb8::parse(text).ok_or_else(|| entry("colours RRGGBB such as ff8000", shortened(text)))
}

fn at_most(most: usize, found: usize, what: &str) -> Result<(), DesignError> {
    if found <= most {
        return Ok(());
    }
    Err(entry(format!("at most {most} {what}"), found.to_string()))
}

/// What was found, on one line that is not too long.
fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(MOST) {
        Some((at, _)) => format!("{}…", &line[..at]),
        None => line,
    }
}

fn json(value: &impl Serialize) -> String {
    // Numbers and strings of ours always can be written.
    serde_json::to_string(value).unwrap_or_default()
}

/// `"name": [` with a line for each item.
fn list(name: &str, items: &[impl Serialize]) -> String {
    let mut text = format!("  \"{name}\": [");
    for (i, item) in items.iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        // Writing to a string never fails.
        write!(text, "{comma}\n    {}", json(item)).ok();
    }
    text + if items.is_empty() { "]" } else { "\n  ]" }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn map() -> ColourSource {
        ColourSource::Map { map: ColourMap::CtLike, range: [-600.0, 900.0] }
    }

    fn points() -> Design {
        let opacity = vec![(-450.0, 0.0), (0.1, 0.25), (0.1, 0.5)];
        TransferFunction::of(opacity, map()).into()
    }

    #[test]
    fn the_text_is_for_people_too() {
        let expected = r#"{
  "format": "voxsplat transfer function",
  "version": 1,
  "opacity": [
    [-450.0,0.0],
    [0.1,0.25],
    [0.1,0.5]
  ],
  "colours": {"map":"ct-like","range":[-600.0,900.0]}
}
"#;
        assert_eq!(points().to_text(), expected);
        assert_eq!(Design::from_text(expected), Ok(points()));
        let stops = ColourSource::Stops(vec![(1.0, Srgb8([255, 128, 0])), (2.5, Srgb8::WHITE)]);
        let bells = vec![Gaussian { centre: 1.0, height: 0.5, width: 0.25 }];
        let design = Design::of_gaussians(bells, stops).unwrap();
        let text = design.to_text();
        assert!(text.contains("\n      [1.0,\"ff8000\"],\n"), "{text}");
        assert!(text.contains("\n    {\"centre\":1.0,\"height\":0.5,\"width\":0.25}\n"), "{text}");
        assert!(!text.contains("\"opacity\""), "points are made again: {text}");
        assert_eq!(Design::from_text(&text), Ok(design));
    }

    #[test]
    fn regions_are_kept_a_line_each() {
        let mut design = points();
        let region = Region {
            shape: RegionShape::Triangle,
            values: [-100.0, 0.1],
            strengths: [0.0, 25.5],
            softness: 0.25,
            opacity: 0.5,
            colour: None,
        };
        let red = Region { colour: Some(Srgb8([255, 0, 0])), ..region };
        design.regions = vec![region, red];
        let text = design.to_text();
        let line = "\n    {\"shape\":\"triangle\",\"values\":[-100.0,0.1],\"strengths\":[0.0,25.5],\
                    \"softness\":0.25,\"opacity\":0.5";
        assert!(
            text.contains(&format!("\"regions\": [{line}}},{line},\"colour\":\"ff0000\"}}\n  ]")),
            "{text}"
        );
        assert_eq!(Design::from_text(&text), Ok(design.clone()));
        design.regions = vec![region; 17];
        let many = design.to_text();
        for (text, words) in [
            (
                text.replacen("triangle", "circle", 1),
                "one of the shapes rectangle, ellipse, triangle",
            ),
            (text.replacen("[0.0,25.5]", "[30,25.5]", 1), "strengths as two numbers"),
            (text.replacen("\"opacity\":0.5", "\"opacity\":5", 1), "region's opacity from 0 to 1"),
            (text.replacen(",\"softness\":0.25", "", 1), "missing field `softness`"),
            (many, "at most 16 regions, found 17"),
        ] {
            let refused = Design::from_text(&text).unwrap_err().to_string();
            assert!(refused.contains(words), "{words}: {refused}");
        }
    }

    #[test]
    fn the_look_of_nan_is_kept_where_there_is_one() {
        let mut design = points();
        design.function.no_data = NoData { opacity: 0.25, colour: Srgb8([255, 0, 128]) };
        let text = design.to_text();
        assert!(
            text.contains(",\n  \"no_data\": {\"opacity\":0.25,\"colour\":\"ff0080\"}\n}"),
            "{text}"
        );
        assert_eq!(Design::from_text(&text), Ok(design));
        for (from, to, words) in [
            ("0.25,\"colour", "7,\"colour", "opacity of NaN from 0 to 1, found 7"),
            ("\"ff0080\"", "\"red\"", "RRGGBB"),
            ("\"opacity\":0.25,\"c", "\"c", "missing field `opacity`"),
        ] {
            assert!(text.contains(from), "{from}");
            let refused = Design::from_text(&text.replace(from, to)).unwrap_err().to_string();
            assert!(refused.contains(words), "{words}: {refused}");
        }
    }

    #[test]
    fn what_is_no_transfer_function_is_refused_in_one_sentence() {
        let good = points().to_text();
        let with = |from: &str, to: &str| {
            assert!(good.contains(from), "{from}");
            good.replace(from, to)
        };
        let many = format!("[{}[1,0]]", "[0,0],".repeat(MOST_POINTS));
        let many = with("[\n    [-450.0,0.0],\n    [0.1,0.25],\n    [0.1,0.5]\n  ]", &many);
        let colours = "{\"map\":\"ct-like\",\"range\":[-600.0,900.0]}";
        for (text, words) in [
            (String::new(), "no text"),
            ("volume".into(), "what is none (volume)"),
            ("[1, 2]".into(), "what is none ([1, 2])"),
            ("{}".into(), "without \"format\""),
            ("{\"format\": \"glTF\"}".into(), "\"glTF\""),
            (with("\"version\": 1", "\"version\": 2"), "found version 2"),
            (with("\"version\": 1", "\"version\": \"1\""), "found version \"1\""),
            (with("\"version\": 1,", ""), "found version nothing"),
            (with("0.25", "NaN"), "what is none"),
            (with("0.25", "null"), "invalid type: null"),
            (with("0.25", "\"much\""), "invalid type: string"),
            (with("0.25", "1e999"), "number out of range"),
            (with("0.25", "1.25"), "opacities from 0 to 1, found 1.25"),
            (with("0.25", "-0.25"), "opacities from 0 to 1, found -0.25"),
            (with("-450.0", "7"), "sorted by value, found 0.1 after 7"),
            (with("[0.1,0.25]", "[0.1]"), "invalid length"),
            (with("ct-like", "jet"), "one of the colour maps viridis"),
            (with(",\"range\":[-600.0,900.0]", ""), "found map"),
            (with(colours, "{}"), "none of them"),
            (with(colours, "{\"stops\":[]}"), "at least one colour stop"),
            (with(colours, "{\"stops\":[[0,\"red\"]]}"), "RRGGBB"),
            (with("\"opacity\"", "\"gaussians\""), "expected a Gaussian"),
            (with("\"opacity\"", "\"opacities\""), "unknown field `opacities`"),
            (with("\"colours\"", "\"gaussians\": [], \"colours\""), "both"),
            (with("\"colours\"", "\"opacity\": [], \"colours\""), "duplicate field"),
            (many, "at most 4096 opacity points in the transfer function, found 4097"),
            ("[".repeat(100_000), "what is none ([[["),
            (format!("{{\"format\":{}", "[".repeat(100_000)), "recursion limit"),
            (with(colours, "[1]"), "expected"),
            (with(colours, "5"), "expected entries with names, in braces"),
            (" ".repeat(MOST_TEXT_BYTES + 1), "at most 1024 KiB, found 1048577 bytes"),
        ] {
            let refused = Design::from_text(&text).unwrap_err().to_string();
            assert!(refused.contains(words), "{words}: {refused}");
            assert!(refused.starts_with("expected") && refused.contains("found"), "{refused}");
            assert!(!refused.contains("struct"), "{refused}");
            assert!(!refused.contains('\n') && refused.len() < 400, "{refused}");
        }
    }

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![-1e3..1e3_f64, any::<f64>().prop_filter("finite", |v| v.is_finite())]
    }

    fn colours() -> impl Strategy<Value = ColourSource> {
        let of_map = (0..ColourMap::ALL.len(), number(), number())
            .prop_map(|(i, a, b)| ColourSource::Map { map: ColourMap::ALL[i], range: [a, b] });
        let of_stops = proptest::collection::vec((number(), any::<[u8; 3]>()), 1..9)
            .prop_map(|s| ColourSource::Stops(s.into_iter().map(|(v, c)| (v, Srgb8(c))).collect()));
        prop_oneof![of_map, of_stops]
    }

    proptest! {
        #[test]
        fn every_number_survives_being_written_and_read(
            opacity in proptest::collection::vec((number(), 0.0..=1.0_f64), 0..40),
            colour in colours(),
            bells in proptest::collection::vec((-1e3..1e3_f64, 0.0..=1.0_f64, 1e-3..1e3_f64), 1..5),
        ) {
            let function = TransferFunction::new(opacity, colour).unwrap();
            let design: Design = function.into();
            prop_assert_eq!(Design::from_text(&design.to_text()), Ok(design.clone()));
            let bells = bells.into_iter();
            let bells = bells.map(|(centre, height, width)| Gaussian { centre, height, width });
            let design = Design::of_gaussians(bells.collect(), design.function.colour).unwrap();
            prop_assert_eq!(Design::from_text(&design.to_text()), Ok(design));
        }

        #[test]
        fn no_damage_is_more_than_a_refusal(cut in 0_usize..400, byte in any::<u8>(), at in 0_usize..400) {
            let text = points().to_text();
            let mut bytes = text.clone().into_bytes();
            let at = at % bytes.len();
            bytes[at] = byte;
            for damaged in [String::from_utf8_lossy(&bytes).into_owned(),
                            text.chars().take(cut).collect::<String>()] {
                if let Ok(design) = Design::from_text(&damaged) {
                    prop_assert_eq!(design.function.validate(), Ok(()));
                }
            }
        }
    }
}
