//! Flags of polygons in the volume.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use super::{Failure, note, values};
use crate::core::{Srgb8, Ticket};
use crate::io::{labels, mesh};
use crate::polygons::Mesh;
use crate::scene::{ByArray, PolygonLayer, PolygonLook, SampleSource, place_over};
use crate::transfer::ColourMap;
use crate::volume::Lattice;

/// Polygons among what else is seen.
#[derive(Debug, Args)]
#[command(next_help_heading = "Polygons")]
pub struct PolygonFlags {
    /// Embed the polygons of an STL, PLY or OBJ file, or the surface of a mesh of VTK or Exodus, in the volume's world space
    /// and lit from both sides: in their own colours or one, or by one of the file's arrays of numbers (by="NAME" where the
    /// name has a comma or is field; map: a colour map;
    /// range: the numbers that take its first and last colour), or with by=field by the volume's values at the triangles, in the
    /// colours of its transfer function; opaque, or of an opacity from 0 to 1; each flat, or smooth (by
    /// the file's normals, or across edges at which triangles are turned by less than 30°) [default: smooth]. May be given again
    #[arg(long,
        value_name = "FILE[,color=RRGGBB][,by=field|ARRAY[,map=NAME][,range=LOW:HIGH]][,opacity=A][,shading=flat|smooth]",
        value_parser = mesh_at)]
    pub mesh: Vec<MeshAt>,

    /// Show the labels of another volume (a segmentation: whole numbers, 0 is nothing) as a surface each, in the file's
    /// colours or colours of their own, at their place in the patient or the world. Where the volume hides them,
    /// lower its opacity (--opacity) or clip it. May be given again
    #[arg(long, value_name = "FILE[,opacity=A]", value_parser = labels_at)]
    pub labels: Vec<MeshAt>,
}

/// Whose numbers colour polygons.
#[derive(Debug, Clone, PartialEq)]
enum By {
    /// An array of their file.
    Array(String),
    /// The field that they lie in.
    Field,
}

/// A file of polygons, and how they look.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshAt {
    path: PathBuf,
    colour: Option<Srgb8>,
    /// What colours it by its numbers.
    by: Option<By>,
    map: Option<ColourMap>,
    range: Option<[f64; 2]>,
    opacity: f64,
    is_smooth: Option<bool>,
}

impl MeshAt {
    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The colours by an array that were asked for.
    ///
    /// # Errors
    /// No such array, or one without any number.
    fn by_of(&self, mesh: &Mesh) -> Result<Option<ByArray>, String> {
        let Some(By::Array(name)) = &self.by else { return Ok(None) };
        let names: Vec<&str> = mesh.arrays().iter().map(|array| &*array.name).collect();
        let file = self.path.display();
        let array = names.iter().position(|known| known == name).ok_or_else(|| {
            let known = match &names[..] {
                [] => "none: leave by= out".to_owned(),
                names => format!("{}; choose one of these", names.join(", ")),
            };
            format!("expected the name of an array of numbers, found {name}, and the file has {known}: {file}")
        })?;
        let own = mesh.arrays()[array].range().ok_or_else(|| {
            format!("expected numbers in the array {name}, found that none is finite; choose another: {file}")
        })?;
        let map = self.map.unwrap_or(ByArray::FIRST_MAP);
        Ok(Some(ByArray { array, map, range: self.range.unwrap_or(own) }))
    }
}

impl PolygonFlags {
    /// The flag that asks for polygons, if it was given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let mesh = (!self.mesh.is_empty()).then_some("--mesh");
        mesh.or_else(|| (!self.labels.is_empty()).then_some("--labels"))
    }

    /// Whether the surface of a file is asked for, opaque.
    pub(super) fn embeds_opaque(&self, file: &Path) -> bool {
        self.mesh.iter().any(|asked| asked.path == file && asked.opacity >= 1.0)
    }

    /// The files that are asked for, with the flag that asks.
    pub(super) fn files(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        let meshes = self.mesh.iter().map(|asked| ("--mesh", asked.path()));
        meshes.chain(self.labels.iter().map(|asked| ("--labels", asked.path())))
    }

    /// The files' polygons, in the world of a volume of this lattice, whose file calls its space so.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(super) fn layers(
        &self,
        volume: (&Lattice, Option<&str>),
    ) -> Result<Vec<(SampleSource, PolygonLayer)>, Failure> {
        let mut layers = self.meshes()?;
        for asked in &self.labels {
            let place = |theirs: &Lattice, space: Option<&str>| place_over((theirs, space), volume);
            let opened = labels::open(&asked.path, None, place, &Ticket::new());
            let opened = opened.map_err(Failure::failed)?;
            for warning in &opened.warnings {
                note(&format!("{warning}: {}", asked.path.display()));
            }
            for (number, label) in opened.labels.into_iter().enumerate() {
                let source = SampleSource::whole(&opened.path, label.mesh.name());
                let layer = PolygonLayer::of_label(Arc::new(label.mesh), number, label.colour);
                let look = PolygonLook { opacity: asked.opacity, ..layer.look };
                layers.push((source, PolygonLayer { look, ..layer }));
            }
        }
        Ok(layers)
    }

    fn meshes(&self) -> Result<Vec<(SampleSource, PolygonLayer)>, Failure> {
        let read = self.mesh.iter().map(|asked| {
            let opened = mesh::open(&asked.path, None, &Ticket::new()).map_err(Failure::failed)?;
            for warning in &opened.warnings {
                note(&format!("{warning}: {}", asked.path.display()));
            }
            let source = SampleSource::whole(&opened.path, opened.mesh.name());
            let layer = PolygonLayer::new(Arc::new(opened.mesh));
            let is_smooth = asked.is_smooth.unwrap_or(layer.look.is_smooth);
            let by = asked.by_of(&layer.mesh).map_err(Failure::Failed)?;
            let by_field = asked.by == Some(By::Field);
            let (colour, opacity) = (asked.colour, asked.opacity);
            let look = PolygonLook { colour, by, by_field, opacity, is_smooth };
            look.check().map_err(|error| Failure::Usage(error.to_string()))?;
            Ok((source, PolygonLayer { look, ..layer }))
        });
        read.collect()
    }
}

/// A file's name, which may hold commas, and after it what is said of its polygons.
fn mesh_at(text: &str) -> Result<MeshAt, String> {
    let (mut colour, mut opacity, mut is_smooth) = (None, None, None);
    let (mut by, mut map, mut range) = (None, None, None);
    let mut rest = text;
    while let Some((before, last)) = last_part(rest) {
        let Some((key, value)) = last.split_once('=') else { break };
        let is_new = match key {
            "color" => colour.replace(values::colour(value)?).is_none(),
            "by" => by.replace(numbers_of(value, text)?).is_none(),
            "map" => map.replace(values::colour_map(value)?).is_none(),
            "range" => range.replace(ends(value)?).is_none(),
            "opacity" => opacity.replace(values::share(value)?).is_none(),
            "shading" => {
                let smooth = match value {
                    "smooth" => true,
                    "flat" => false,
                    _ => {
                        let found = values::found(value);
                        return Err(format!(
                            "expected shading=flat or shading=smooth, found {found}"
                        ));
                    }
                };
                is_smooth.replace(smooth).is_none()
            }
            _ => break,
        };
        if !is_new {
            return Err(format!("expected {key} once, found it twice in {}", values::found(text)));
        }
        rest = before;
    }
    if let Some(key) = unknown_key(rest) {
        let key = values::found(key);
        return Err(format!(
            "expected color=, by=, map=, range=, opacity= or shading= after the file's name, found {key}"
        ));
    }
    if rest.is_empty() {
        return Err(format!("expected the name of a file, found {}", values::found(text)));
    }
    match (&by, &colour, map.is_some() || range.is_some()) {
        (Some(By::Field), None, true) => {
            return Err(format!(
                "expected by=field without map= and range=, as the field has colours of its own, found one of these in {}; give \
                 --colormap or --color-range, or name an array of that name as by=\"field\"",
                values::found(text)
            ));
        }
        (Some(_), Some(_), _) => {
            return Err(format!(
                "expected one of color= and by=, found both in {}",
                values::found(text)
            ));
        }
        (None, _, true) => {
            return Err(format!(
                "expected by=ARRAY with map= or range=, which colour numbers, found none in {}",
                values::found(text)
            ));
        }
        _ => {}
    }
    let (path, opacity) = (PathBuf::from(rest), opacity.unwrap_or(1.0));
    Ok(MeshAt { path, colour, by, map, range, opacity, is_smooth })
}

/// What is before the last comma, and behind it; a comma between quotes is none.
fn last_part(text: &str) -> Option<(&str, &str)> {
    let quote = text.strip_suffix('"').and_then(|text| text.rfind("=\""));
    let end = quote.unwrap_or(text.len());
    let comma = text[..end].rfind(',')?;
    Some((&text[..comma], &text[comma + 1..]))
}

/// The field, or the name of an array, which may stand between quotes.
fn numbers_of(value: &str, text: &str) -> Result<By, String> {
    let unquoted = value.strip_prefix('"').and_then(|value| value.strip_suffix('"'));
    match unquoted.unwrap_or(value) {
        "field" if unquoted.is_none() => Ok(By::Field),
        "" => Err(format!(
            "expected the name of an array after by=, found none in {}; leave by= out, or name one: `voxsplat info` lists them",
            values::found(text)
        )),
        name => Ok(By::Array(name.to_owned())),
    }
}

/// Two different numbers with a colon between.
fn ends(text: &str) -> Result<[f64; 2], String> {
    let wrong =
        || format!("expected two different numbers LOW:HIGH, found {}", values::found(text));
    let (low, high) = text.split_once(':').ok_or_else(wrong)?;
    let ends = [values::number(low)?, values::number(high)?];
    if ends[0] == ends[1] { Err(wrong()) } else { Ok(ends) }
}

/// What stands before "=" behind the last comma of a name that is none of a file.
fn unknown_key(name: &str) -> Option<&str> {
    let (before, last) = name.rsplit_once(',')?;
    let (key, _) = last.split_once('=')?;
    let is_word = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphabetic());
    (is_word && !before.is_empty() && !Path::new(name).exists()).then_some(key)
}

/// A file's name, and after it how opaque the surfaces of its labels are.
fn labels_at(text: &str) -> Result<MeshAt, String> {
    let asked = mesh_at(text)?;
    match (asked.colour, asked.is_smooth, &asked.by) {
        (None, None, None) => Ok(asked),
        _ => Err(format!("expected FILE[,opacity=A], found {}", values::found(text))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_a_file_and_an_opacity_alone() {
        let said = labels_at("seg.nrrd,opacity=0.25").unwrap();
        assert_eq!((said.path(), said.opacity), (Path::new("seg.nrrd"), 0.25));
        for wrong in ["seg.nrrd,color=ff0000", "seg.nrrd,shading=flat", "", "a,opacity=x"] {
            let refused = labels_at(wrong).unwrap_err();
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
    }

    #[test]
    fn a_mesh_is_a_file_and_what_is_said_of_it() {
        let plain = mesh_at("a,b-1=c.stl").unwrap();
        assert_eq!(plain.path(), Path::new("a,b-1=c.stl"));
        assert_eq!((plain.colour, plain.opacity, plain.is_smooth), (None, 1.0, None));
        let said = mesh_at("x.ply,shading=flat,color=#ff8000,opacity=0.5").unwrap();
        let colour = Some(Srgb8([255, 128, 0]));
        let expected = MeshAt {
            path: "x.ply".into(),
            colour,
            by: None,
            map: None,
            range: None,
            opacity: 0.5,
            is_smooth: Some(false),
        };
        assert_eq!(said, expected);
        let by = mesh_at("x.vtu,by=T,map=inferno,range=1:5").unwrap();
        assert_eq!((by.by, by.map), (Some(By::Array("T".into())), Some(ColourMap::Inferno)));
        assert_eq!(by.range, Some([1.0, 5.0]));
        assert_eq!(mesh_at("x.vtu,by=field").unwrap().by, Some(By::Field));
        assert_eq!(mesh_at("x.vtu,by=\"field\"").unwrap().by, Some(By::Array("field".into())));
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        for wrong in [
            "",
            "x,color=red",
            "x,opacity=2",
            "x,shading=gouraud",
            ",opacity=1",
            "x,opacity=1,opacity=1",
            "x,colour=ff0000",
            "x,colour=ff0000,opacity=1",
            "x,by=T,color=ff0000",
            "x,map=viridis",
            "x,range=0:1",
            "x,by=T,range=1:1",
            "x,by=T,map=none",
            "x,by=field,range=0:1",
            "x,by=field,color=ff0000",
        ] {
            let refused = mesh_at(wrong).unwrap_err();
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
    }
}
