//! Flags of what lets a volume's inside be seen.

use clap::Args;
use glam::DVec3;

use super::flags::SceneFlags;
use super::values;
use crate::core::plain_number;
use crate::kernel::Kernel;
use crate::scene::{
    AlongRay, Clip, ClipBox, CutFaces, Inside, Isosurface, Plane, Slice, SplatSettings,
    projected_range,
};
use crate::transfer::Kind;
use crate::volume::ScalarVolume;

/// What is cut away.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Rendering, surfaces, slices and clipping")]
pub struct ClipFlags {
    /// Cut away what lies outside a box along the volume's own axes: from sample number X0 (the first is
    /// 0) to X1, and so on; of meshes, points and other samples that are not evenly spaced from the coordinate X0 to X1.
    /// 25% is a share of the volume
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = places,
        allow_hyphen_values = true)]
    pub clip_box: Option<[Place; 6]>,
    /// Cut away what lies behind the plane through the world point X,Y,Z; what its normal NX,NY,NZ
    /// points to is kept. Up to 6 times
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = plane, allow_hyphen_values = true)]
    pub clip_plane: Vec<Plane>,
}

/// What is cut away, and what shows where it is.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Rendering, surfaces, slices and clipping")]
pub struct InsideFlags {
    /// What is cut away.
    #[command(flatten)]
    pub clip: ClipFlags,
    /// Show the value where matter is cut, opaque, instead of what lies behind
    #[arg(long)]
    pub cut_faces: bool,
    /// Show the values on a plane across one of the volume's own axes, at a sample number, a coordinate (of meshes and
    /// the like) or a share as with --clip-box, in their colours; opaque, or of an opacity from 0 to 1. Up to 6 planes
    #[arg(long, value_name = "x=V[:A]|y=V[:A]|z=V[:A]", value_parser = slice)]
    pub slice: Vec<SliceAt>,
    /// The same on the plane through the world point X,Y,Z with a normal
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ[:A]", value_parser = slice_plane,
        allow_hyphen_values = true)]
    pub slice_plane: Vec<Slice>,
    /// Leave out of all slices what the transfer function gives no opacity, such as the air around a head; without it
    /// they show every value
    #[arg(long)]
    pub slice_only_shown: bool,
    /// Draw on all slices where they cut from one cell of a mesh into another
    #[arg(long)]
    pub slice_edges: bool,
    /// Show where the values pass V, lit by the scene's lights or, without, by the usual one; opaque, or
    /// of an opacity from 0 to 1; in the colour of V, or another. Up to 6 times
    #[arg(long, value_name = "V[:A[:RRGGBB]]", value_parser = isosurface,
        allow_hyphen_values = true)]
    pub iso: Vec<Isosurface>,
    /// Draw the volume with a five-hundredth of its opacities, so that what lies inside it is seen
    #[arg(long)]
    pub fade: bool,
    /// What is shown along each line of sight: composite or volume (matter, by its opacities), or the maximum (mip),
    /// minimum (minip) or average of the values, in its colour. These have their colours from the least to the
    /// greatest value that rays come to, unless --color, --color-range, --transfer or --preset says which
    /// [default: composite]
    #[arg(long, value_name = "WHAT", value_parser = values::along_ray)]
    pub projection: Option<AlongRay>,
}

/// A slice across one of a volume's own axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceAt {
    axis: usize,
    place: Place,
    opacity: f64,
}

/// A place along one of a volume's own axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// Sample number, from 0; between two it need not be whole. A coordinate where samples have no numbers.
    Number(f64),
    /// Share of the volume's extent.
    Share(f64),
}

impl Place {
    /// The share of a volume's extent along an axis.
    fn share(self, volume: &ScalarVolume, axis: usize) -> f64 {
        match (self, volume.coordinates(axis)) {
            (Self::Number(coordinate), Some(along)) => along.share(coordinate),
            (Self::Number(sample), None) => (sample + 0.5) / volume.lattice.dims[axis] as f64,
            (Self::Share(share), _) => share,
        }
    }

    /// As a flag says it.
    fn words(self) -> String {
        match self {
            Self::Number(number) => plain_number(number),
            Self::Share(share) => format!("{}%", plain_number(100.0 * share)),
        }
    }
}

/// What numbers along an axis of a volume are called, one and several of them, and where they begin and end.
fn numbers_along(volume: &ScalarVolume, axis: usize) -> ([&'static str; 2], String) {
    match volume.coordinates(axis) {
        Some(along) => {
            let [low, high] = along.ends.map(|end| along.words(end));
            (["coordinate", "coordinates"], format!("{low} to {high}"))
        }
        None => (["sample", "samples"], format!("0 to {}", volume.lattice.dims[axis] - 1)),
    }
}

impl ClipFlags {
    /// What they mean for a volume.
    ///
    /// # Errors
    /// One sentence where the box has no inside, or lies beside the volume.
    pub fn resolve(&self, volume: &ScalarVolume) -> Result<Clip, String> {
        let bounds = self.clip_box.map(|places| box_between(places, "--clip-box", volume));
        let bounds = bounds.transpose()?;
        Ok(Clip { bounds, planes: self.clip_plane.clone(), faces: CutFaces::Through })
    }
}

/// The part of a volume between places that a flag gives; what reaches beyond the volume ends with it.
///
/// # Errors
/// One sentence where it has no inside, or lies beside the volume.
pub(super) fn box_between(
    places: [Place; 6],
    flag: &str,
    volume: &ScalarVolume,
) -> Result<ClipBox, String> {
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let ends = [places[2 * axis], places[2 * axis + 1]];
        let [low, high] = ends.map(|place| place.share(volume, axis));
        if !(low < high && low < 1.0 && high > 0.0) {
            let ([_, numbers], range) = numbers_along(volume, axis);
            return Err(format!(
                "expected {flag} from a lesser to a greater place along {name}, about some of the {numbers} {range} or of \
                 0% to 100%, found {} to {}; give two such",
                ends[0].words(),
                ends[1].words()
            ));
        }
    }
    let end =
        |end: usize| std::array::from_fn(|a| places[2 * a + end].share(volume, a).clamp(0.0, 1.0));
    Ok(ClipBox { low: end(0), high: end(1) })
}

impl InsideFlags {
    /// Whether surfaces at levels are asked for, which lie between values and so need a mode in which there are such.
    pub(super) fn asks_for_levels(&self) -> bool {
        !self.iso.is_empty()
    }

    /// What they mean for a volume.
    ///
    /// # Errors
    /// One sentence where a mode cannot show it, or it means nothing.
    pub fn resolve(&self, volume: &ScalarVolume, splat: &SplatSettings) -> Result<Inside, String> {
        let clip = self.clip.resolve(volume)?;
        self.refuse_beside(volume)?;
        let faces = if self.cut_faces { CutFaces::Coloured } else { CutFaces::Through };
        let lattice = &volume.lattice;
        let across = self.slice.iter().map(|&SliceAt { axis, place, opacity }| {
            Slice::across(lattice, axis, place.share(volume, axis), opacity)
        });
        let (only_shown, edges) = (self.slice_only_shown, self.slice_edges);
        let slices = across.chain(self.slice_plane.iter().copied());
        let inside = Inside {
            clip: Clip { faces, ..clip },
            along: self.projection.unwrap_or_default(),
            slices: slices.map(|slice| Slice { only_shown, edges, ..slice }).collect(),
            isosurfaces: self.iso.clone(),
            is_faded: self.fade,
            ..Inside::default()
        };
        inside.check(splat).map_err(|error| error.to_string())?;
        if self.cut_faces && !inside.clip.cuts() {
            return Err(
                "expected --clip-box or --clip-plane with --cut-faces, found neither; cut \
                        something away, or leave it out"
                    .to_owned(),
            );
        }
        self.refuse_twins()?;
        Ok(inside)
    }

    /// The same, with a range of its own for what is projected where the flags of a scene choose no colours.
    ///
    /// # Errors
    /// See [`InsideFlags::resolve`].
    pub fn resolve_in(
        &self,
        scene: &SceneFlags,
        volume: &ScalarVolume,
        splat: &SplatSettings,
    ) -> Result<Inside, String> {
        let inside = self.resolve(volume, splat)?;
        // Names of things keep their own colours.
        let is_free = !scene.chooses_colours() && splat.kernel != Kernel::Nearest;
        let range = is_free.then(|| projected_range(volume, inside.along));
        let projected_grey = is_free
            && scene.colormap.is_none()
            && inside.along != AlongRay::Composite
            && Kind::of(&volume.statistics).is_of_scan();
        Ok(Inside { projected_range: range.flatten(), projected_grey, ..inside })
    }

    /// Refuses slices across an axis that meet nothing of the volume.
    fn refuse_beside(&self, volume: &ScalarVolume) -> Result<(), String> {
        let is_beside = |at: &&SliceAt| !(0.0..=1.0).contains(&at.place.share(volume, at.axis));
        let Some(SliceAt { axis, place, .. }) = self.slice.iter().find(is_beside) else {
            return Ok(());
        };
        let name = ["x", "y", "z"][*axis];
        let ([number, _], range) = numbers_along(volume, *axis);
        Err(format!(
            "expected --slice {name}= with a {number} from {range} or a share from 0% to 100%, found {}, which lies beside \
             the volume; give one of those",
            place.words()
        ))
    }

    /// Refuses two isosurfaces in one place, of which nothing says which lies before the other.
    fn refuse_twins(&self) -> Result<(), String> {
        let values: Vec<f64> = self.iso.iter().map(|iso| iso.value).collect();
        let twin = values.iter().enumerate().find(|(i, value)| values[..*i].contains(value));
        match twin {
            None => Ok(()),
            Some((_, value)) => Err(format!(
                "expected every --iso at a value of its own, found {} twice; give one of the two \
                 another value, or leave it out",
                plain_number(*value)
            )),
        }
    }
}

/// A place along an axis: a number, or a percentage.
fn place(text: &str) -> Result<Place, String> {
    let text = text.trim();
    match text.strip_suffix('%') {
        Some(percent) => Ok(Place::Share(values::number(percent)? / 100.0)),
        None => values::number(text).map(Place::Number),
    }
}

/// Where a box begins and ends along each axis.
pub(super) fn places(text: &str) -> Result<[Place; 6], String> {
    let places: Vec<Place> = text.split(',').map(place).collect::<Result<_, _>>()?;
    places.try_into().map_err(|_| {
        format!(
            "expected six places X0,X1,Y0,Y1,Z0,Z1 such as 0%,50%,10,90,0%,100%, found {}",
            values::found(text)
        )
    })
}

fn plane(text: &str) -> Result<Plane, String> {
    let [x, y, z, nx, ny, nz] = values::numbers(text, "six numbers X,Y,Z,NX,NY,NZ")?;
    let normal = DVec3::new(nx, ny, nz);
    if normal == DVec3::ZERO {
        return Err("expected a normal of non-zero length, found 0,0,0".to_owned());
    }
    let normal = DVec3::from(values::of_plain_length(normal.to_array()));
    Ok(Plane { point: DVec3::new(x, y, z), normal })
}

/// What stands before the first colon, and an opacity after it.
fn with_opacity(text: &str) -> Result<(&str, f64), String> {
    match text.split_once(':') {
        Some((first, opacity)) => Ok((first, values::share(opacity)?)),
        None => Ok((text, 1.0)),
    }
}

fn slice(text: &str) -> Result<SliceAt, String> {
    let (at, opacity) = with_opacity(text)?;
    let parts = at.split_once('=');
    let axis = parts.and_then(|(axis, _)| ["x", "y", "z"].iter().position(|a| *a == axis.trim()));
    match axis.zip(parts) {
        Some((axis, (_, at))) => Ok(SliceAt { axis, place: place(at)?, opacity }),
        None => {
            let found = values::found(text);
            Err(format!("expected an axis and a place such as x=40 or z=50%, found {found}"))
        }
    }
}

fn slice_plane(text: &str) -> Result<Slice, String> {
    let (at, opacity) = with_opacity(text)?;
    Ok(Slice { plane: plane(at)?, opacity, only_shown: false, edges: false })
}

fn isosurface(text: &str) -> Result<Isosurface, String> {
    let mut parts = text.splitn(3, ':');
    let value = values::number(parts.next().unwrap_or_default())?;
    let opacity = parts.next().map_or(Ok(1.0), values::share)?;
    let colour = parts.next().map(values::colour).transpose()?;
    Ok(Isosurface { value, opacity, colour })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    #[test]
    fn boxes_end_with_the_volume_and_are_refused_beside_it() {
        let samples = Samples::UInt8(vec![1; 160]);
        let volume = ScalarVolume::from_samples("one", Lattice::unit([8, 4, 5]), samples).unwrap();
        let between = |text: &str| box_between(places(text).unwrap(), "--clip-box", &volume);
        let found = between("-9,3,0%,250%,1.5,1e9").unwrap();
        assert_eq!(found, ClipBox { low: [0.0, 0.0, 0.4], high: [0.4375, 1.0, 1.0] });
        // Half a sample beyond the last one it ends.
        assert!(between("7.4,9,0,1,0,1").is_ok());
        for beside in ["7.5,9,0,1,0,1", "-2,-0.5,0,1,0,1", "0,1,0,1,3,3", "100%,120%,0,1,0,1"] {
            let refused = between(beside).unwrap_err();
            assert!(refused.contains("about some of the samples 0 to"), "{beside}: {refused}");
        }
    }

    #[test]
    fn boxes_are_of_samples_or_shares_and_planes_of_world_units() {
        let flags = InsideFlags {
            clip: ClipFlags {
                clip_box: Some(places("0,7,25%,100%,1.5,4").unwrap()),
                clip_plane: vec![plane("1,2,-3,0,0.5,-1").unwrap()],
            },
            cut_faces: true,
            slice: vec![slice("z=50%:0.25").unwrap()],
            slice_plane: vec![slice_plane("1,2,3,0,0,-1:0.5").unwrap()],
            slice_only_shown: true,
            slice_edges: true,
            iso: vec![isosurface("-300:0.4:ff8000").unwrap(), isosurface("12.5").unwrap()],
            fade: true,
            projection: None,
        };
        let samples = Samples::UInt8((0..160).map(|i| i as u8).collect());
        let lattice = Lattice::unit([8, 4, 5]);
        let volume = ScalarVolume::from_samples("ramp", lattice, samples).unwrap();
        let Inside { clip, slices, isosurfaces, is_faded, .. } =
            flags.resolve(&volume, &SplatSettings::EXACT).unwrap();
        assert!(is_faded);
        let bounds = ClipBox { low: [0.0625, 0.25, 0.4], high: [0.9375, 1.0, 0.9] };
        assert_eq!((clip.bounds, clip.faces), (Some(bounds), CutFaces::Coloured));
        let [low, high] = bounds.in_index([8, 4, 5]);
        assert_eq!((low, high), (DVec3::new(0.0, 0.5, 1.5), DVec3::new(7.0, 3.5, 4.0)));
        let expected =
            Plane { point: DVec3::new(1.0, 2.0, -3.0), normal: DVec3::new(0.0, 0.5, -1.0) };
        assert_eq!(clip.planes, [expected]);
        assert!((slices[0].plane.share_across(&lattice, 2).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!((slices[0].opacity, slices[1].opacity, slices.len()), (0.25, 0.5, 2));
        assert!(slices.iter().all(|slice| slice.only_shown && slice.edges));
        let colour = Some(crate::core::Srgb8([255, 128, 0]));
        let expected = [
            Isosurface { value: -300.0, opacity: 0.4, colour },
            Isosurface { value: 12.5, opacity: 1.0, colour: None },
        ];
        assert_eq!(isosurfaces, expected);
        assert!(flags.resolve(&volume, &SplatSettings::SHADE_FIRST).is_err());
        let mut twins = flags;
        twins.iso.push(isosurface("-3e2:0.5").unwrap());
        let refused = twins.resolve(&volume, &SplatSettings::EXACT).unwrap_err();
        assert!(refused.contains("found -300 twice"), "{refused}");
        let uncut = InsideFlags { cut_faces: true, ..InsideFlags::default() };
        let refused = uncut.resolve(&volume, &SplatSettings::EXACT).unwrap_err();
        assert!(refused.contains("--clip-box or --clip-plane with --cut-faces"), "{refused}");
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_what_was_found() {
        for refused in [
            places("0,1,0,1").unwrap_err(),
            places("0,1,0,1,0,half").unwrap_err(),
            places("0,1,0,1,0,%").unwrap_err(),
            plane("0,0,0,0,0,0").unwrap_err(),
            plane("0,0,0").unwrap_err(),
            slice("w=3").unwrap_err(),
            slice("x").unwrap_err(),
            slice("x=3:2").unwrap_err(),
            slice_plane("0,0,0").unwrap_err(),
            isosurface("").unwrap_err(),
            isosurface("3:1:red").unwrap_err(),
        ] {
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
    }
}
