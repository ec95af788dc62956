//! What NetCDF files become: fields by name and time, vectors by the names of their components, and places.

use std::path::{Path, PathBuf};

use voxsplat::core::Ticket;
use voxsplat::io::{Format, OpenOptions, Opened, open};
use voxsplat::volume::Shape;

use crate::write_netcdf::{Attribute, Values, Variable, netcdf, plain};

const DIMS: [(&str, usize); 4] = [("time", 2), ("lev", 2), ("lat", 3), ("lon", 5)];

fn read(path: &Path) -> Opened {
    open(path, &OpenOptions::default(), &Ticket::new()).unwrap_or_else(|error| panic!("{error}"))
}

fn with(variable: Variable, attributes: &[(&'static str, Attribute)]) -> Variable {
    Variable { attributes: attributes.to_vec(), ..variable }
}

fn coordinates() -> Vec<Variable> {
    let units = |text: &'static str| [("units", Attribute::Text(text))];
    vec![
        with(
            plain("time", &[0], Values::Double(vec![6.0, 12.5])),
            &units("hours since 2000-01-01"),
        ),
        with(plain("lev", &[1], Values::Float(vec![200.0, 850.0])), &units("hPa")),
        with(plain("lat", &[2], Values::Float(vec![10.0, 0.0, -10.0])), &units("degrees_north")),
        with(
            plain("lon", &[3], Values::Float(vec![0.0, 4.0, 8.0, 12.0, 16.0])),
            &units("degrees_east"),
        ),
    ]
}

/// Packed winds over the equator at two times and levels, and what is beside them in such files.
pub(crate) fn winds(folder: &Path, version: u8) -> PathBuf {
    let packed = |start: i16| Values::Short((0..60).map(|i| start + i).collect());
    let speed = [
        ("scale_factor", Attribute::Double(-0.5)),
        ("add_offset", Attribute::Double(10.0)),
        ("_FillValue", Attribute::Short(7)),
        ("units", Attribute::Text("m s**-1")),
    ];
    let mut variables = coordinates();
    variables.push(with(plain("u", &[0, 1, 2, 3], packed(0)), &speed));
    variables.push(with(plain("v", &[0, 1, 2, 3], packed(1000)), &speed));
    let vertical = [("units", Attribute::Text("Pa s**-1"))];
    variables.push(with(plain("w", &[0, 1, 2, 3], packed(0)), &vertical));
    variables.push(plain("height", &[2, 3], Values::Double((0..15).map(f64::from).collect())));
    netcdf(folder, version, &DIMS, &variables)
}

#[test]
fn winds_are_unpacked_and_named_by_time_and_become_vectors() {
    let folder = tempfile::tempdir().unwrap();
    for version in [1, 2] {
        let opened = read(&winds(folder.path(), version));
        assert_eq!(opened.format, Format::NetCdf);
        assert_eq!(opened.grid.lattice.dims, [5, 3, 2]);
        let names: Vec<&str> = opened.grid.fields.iter().map(|f| f.name.as_str()).collect();
        let expected = [
            "u[time=6]",
            "u[time=12.5]",
            "v[time=6]",
            "v[time=12.5]",
            "w[time=6]",
            "w[time=12.5]",
            "(u, v)[time=6]",
            "(u, v)[time=12.5]",
        ];
        assert_eq!(names, expected);
        let field = |name: &str| opened.grid.field(Some(name)).unwrap();
        let late = &field("u[time=12.5]").samples;
        assert_eq!((late.get(0), late.get(29)), (10.0 - 0.5 * 30.0, 10.0 - 0.5 * 59.0));
        // The fill value is a hole.
        assert!(field("u[time=6]").samples.get(7).is_nan());
        let vectors = field("(u, v)[time=12.5]");
        assert_eq!((vectors.components, vectors.is_vectors()), (3, true));
        let vector = [0, 1, 2].map(|c| vectors.samples.get(3 + c));
        assert_eq!(vector, [10.0 - 0.5 * 31.0, 10.0 - 0.5 * 1031.0, 0.0]);
        let told = opened.warnings.join("\n");
        for words in ["height", "(u, v), with 0 upward", "lev (200 to 850 hpa)", "the least on top"]
        {
            assert!(told.contains(words), "{words}: {told}");
        }
        assert_eq!(opened.warnings.len(), 3, "{told}");
    }
}

#[test]
fn degrees_are_kept_and_pressures_are_laid_evenly_with_the_least_on_top() {
    let folder = tempfile::tempdir().unwrap();
    let opened = read(&winds(folder.path(), 1));
    let Shape::Rectilinear([x, y, z]) = &opened.grid.shape else { panic!("{opened:?}") };
    assert_eq!((&x[..], &y[..]), (&[0.0, 4.0, 8.0, 12.0, 16.0][..], &[10.0, 0.0, -10.0][..]));
    // An eighth of 20 degrees.
    assert_eq!(&z[..], &[2.5, 0.0]);
    let vectors = opened.grid.vectors(&opened.grid.fields[6], &Ticket::new()).unwrap();
    let (place, axes) = vectors.places.at(16);
    assert_eq!(place.to_array(), [4.0, 10.0, 0.0]);
    assert_eq!((axes.y_axis.y, axes.z_axis.z), (-10.0, -2.5));
}

#[test]
fn upward_components_count_in_the_same_units_and_three_like_axes_stay_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let values = |start: i16| Values::Float((0..8).map(|i| f32::from(start + i)).collect());
    let metres = [("units", Attribute::Text("m"))];
    let axis = |name, dim| with(plain(name, &[dim], Values::Double(vec![3.0, 8.0])), &metres);
    let mut variables = vec![axis("x", 2), axis("y", 1), axis("z", 0)];
    for (name, start) in [("U", 0), ("V", 10), ("W", 20)] {
        variables.push(plain(name, &[0, 1, 2], values(start)));
    }
    let opened = read(&netcdf(folder.path(), 2, &[("z", 2), ("y", 2), ("x", 2)], &variables));
    let vectors = opened.grid.field(Some("(U, V, W)")).unwrap();
    assert_eq!([0, 1, 2].map(|c| vectors.samples.get(3 + c)), [1.0, 11.0, 21.0]);
    assert!(matches!(&opened.grid.shape, Shape::Rectilinear(lists) if lists[2][..] == [3.0, 8.0]));
}

#[test]
fn axes_without_coordinates_are_counted_and_said_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let variables = [plain("t", &[0, 1], Values::Short(vec![1, 2, 3, 4, 5, 6]))];
    let opened = read(&netcdf(folder.path(), 1, &[("row", 2), ("column", 3)], &variables));
    assert_eq!(opened.grid.lattice.dims, [3, 2, 1]);
    assert!(
        matches!(&opened.grid.shape, Shape::Rectilinear(lists) if lists[0][..] == [0.0, 1.0, 2.0])
    );
    let told = opened.warnings.join("\n");
    assert!(told.contains("along column") && told.contains("along row"), "{told}");
}

#[test]
fn depths_go_down_and_lists_are_counted_with_the_last_the_fastest() {
    let folder = tempfile::tempdir().unwrap();
    let metres = ("units", Attribute::Text("m"));
    let axis = |name, dim, more: &[(&'static str, Attribute)]| {
        with(plain(name, &[dim], Values::Double(vec![3.0, 8.0])), more)
    };
    let down = ("positive", Attribute::Text("down"));
    let values = Values::Float((0..48_i16).map(f32::from).collect());
    let variables = [
        axis("x", 4, std::slice::from_ref(&metres)),
        axis("y", 3, std::slice::from_ref(&metres)),
        axis("depth", 2, &[metres.clone(), down]),
        plain("heat", &[0, 1, 2, 3, 4], values),
    ];
    let dims = [("time", 2), ("member", 3), ("depth", 2), ("y", 2), ("x", 2)];
    let opened = read(&netcdf(folder.path(), 2, &dims, &variables));
    assert!(
        matches!(&opened.grid.shape, Shape::Rectilinear(lists) if lists[2][..] == [-3.0, -8.0])
    );
    let told: Vec<(&str, f64)> =
        opened.grid.fields.iter().map(|f| (f.name.as_str(), f.samples.get(0))).collect();
    assert_eq!(told[..2], [("heat[time=0,member=0]", 0.0), ("heat[time=0,member=1]", 8.0)]);
}
