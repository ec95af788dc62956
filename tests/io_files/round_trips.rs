//! What is written is read, in every encoding, type and byte order.

use proptest::prelude::*;
use voxsplat::core::Ticket;
use voxsplat::io::{Endian, Format, OpenOptions, Opened, RawOverrides, open, raw};
use voxsplat::volume::{Association, ScalarType, Shape};
use voxsplat::with_samples;

use crate::write::{self, META_STORAGES, NRRD_ENCODINGS, VTI_FORMATS, VTI_KINDS, Volume, Vti};
use crate::write_legacy::{self, DATASETS, Legacy, ROLES};

/// What differs between a volume and what was read of it.
fn difference(volume: &Volume, opened: &Opened) -> Option<String> {
    let lattice = &opened.grid.lattice;
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    let checks = [
        (near(&lattice.spacing.to_array(), &volume.spacing), "spacing"),
        (near(&lattice.origin.to_array(), &volume.origin), "origin"),
        (near(&lattice.direction.to_cols_array(), &volume.direction), "direction"),
    ];
    difference_of_samples(volume, opened).or_else(|| {
        let wrong = checks.iter().find(|(same, _)| !same)?.1;
        Some(format!("{wrong} of {opened:?}"))
    })
}

/// What differs between the samples of a volume and those that were read.
fn difference_of_samples(volume: &Volume, opened: &Opened) -> Option<String> {
    let field = &opened.grid.fields[0];
    let dims = opened.grid.lattice_of(field).dims;
    let mut bytes = Vec::new();
    with_samples!(&*field.samples, values => {
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    });
    let checks = [
        (dims == volume.dims, "dims"),
        (field.components == volume.components, "components"),
        (field.samples.scalar_type() == volume.scalar_type, "type"),
        (bytes == volume.bytes, "samples"),
    ];
    let wrong = checks.iter().find(|(same, _)| !same)?.1;
    Some(format!("{wrong} of {opened:?}"))
}

/// Points that are not where the writers put them.
fn difference_of_shape(opened: &Opened) -> Option<String> {
    let [x, y, _] = opened.grid.lattice.dims;
    match &opened.grid.shape {
        Shape::Affine => None,
        Shape::Rectilinear(lists) => (0..3).find_map(|axis| {
            let wrong =
                lists[axis].iter().enumerate().find(|(i, v)| **v != write::coordinate(axis, *i));
            wrong.map(|(i, v)| format!("{v} at {i} along {axis}"))
        }),
        Shape::Curvilinear(points) => {
            let expected = |i: usize| write::point([i % x, i / x % y, i / (x * y)]);
            let mut places = points.iter().enumerate();
            let wrong = places.find(|(i, p)| p.to_array() != expected(*i));
            wrong.map(|(i, p)| format!("{p} for point {i}"))
        }
        Shape::Unstructured(_) => Some("cells that nobody wrote".to_owned()),
    }
}

fn read(path: &std::path::Path) -> Opened {
    let opened = open(path, &OpenOptions::default(), &Ticket::new());
    opened.unwrap_or_else(|error| panic!("{error}"))
}

fn volumes() -> impl Strategy<Value = Volume> {
    let types = (0..ScalarType::ALL.len()).prop_map(|i| ScalarType::ALL[i]);
    (1..7_usize, 1..6_usize, 1..8_usize, types, 1..4_usize, any::<u64>())
        .prop_map(|(x, y, z, t, components, seed)| Volume::new([x, y, z], t, components, seed))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..Default::default() })]

    #[test]
    fn nrrd(v in volumes(), e in 0..NRRD_ENCODINGS.len(), big: bool, detached: bool) {
        let folder = tempfile::tempdir().unwrap();
        let opened = read(&write::nrrd(folder.path(), &v, NRRD_ENCODINGS[e], big, detached));
        prop_assert_eq!(difference(&v, &opened), None);
        prop_assert_eq!(&opened.warnings, &Vec::<String>::new());
        prop_assert_eq!(opened.grid.space.as_deref(), Some("left-posterior-superior"));
    }

    #[test]
    fn metaimage(v in volumes(), s in 0..META_STORAGES.len(), big: bool, detached: bool) {
        let folder = tempfile::tempdir().unwrap();
        let opened = read(&write::metaimage(folder.path(), &v, META_STORAGES[s], big, detached));
        prop_assert_eq!(difference(&v, &opened), None);
        prop_assert_eq!(&opened.warnings, &Vec::<String>::new());
    }

    #[test]
    fn vti(
        v in volumes(), f in 0..VTI_FORMATS.len(), k in 0..VTI_KINDS.len(),
        compressed: bool, wide: bool, big: bool, split: bool, cells: bool,
    ) {
        let folder = tempfile::tempdir().unwrap();
        let (format, kind) = (VTI_FORMATS[f], VTI_KINDS[k]);
        let how = Vti { kind, format, compressed, wide, big, split, cells };
        let opened = read(&write::vti(folder.path(), &v, how));
        if k == 0 {
            prop_assert_eq!(difference(&v, &opened), None);
            prop_assert_eq!(&opened.warnings, &Vec::<String>::new());
        } else {
            prop_assert_eq!(difference_of_samples(&v, &opened), None);
            prop_assert_eq!(difference_of_shape(&opened), None);
        }
        prop_assert_eq!(&opened.grid.fields[0].name, "a & b");
        let association = if cells { Association::Cell } else { Association::Point };
        prop_assert_eq!(opened.grid.fields[0].association, association);
    }

    #[test]
    fn legacy_vtk(
        mut v in volumes(), d in 0..DATASETS.len(), r in 0..ROLES.len(),
        binary: bool, cells: bool, extras: bool,
    ) {
        // Images know no direction, and vectors have three components.
        v.direction = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        if ROLES[r] == "VECTORS" {
            v = Volume { direction: v.direction, ..Volume::new(v.dims, v.scalar_type, 3, 5) };
        }
        let folder = tempfile::tempdir().unwrap();
        let how = Legacy { dataset: DATASETS[d], role: ROLES[r], binary, cells, extras };
        let opened = read(&write_legacy::legacy(folder.path(), &v, how));
        prop_assert_eq!(opened.format, Format::Vtk);
        let told = if d == 0 { difference(&v, &opened) } else { difference_of_samples(&v, &opened) };
        prop_assert_eq!(told, None);
        prop_assert_eq!(difference_of_shape(&opened), None);
        prop_assert_eq!(opened.grid.fields.len(), 1);
        prop_assert_eq!(&opened.grid.fields[0].name, "a b");
        let association = if cells { Association::Cell } else { Association::Point };
        prop_assert_eq!(opened.grid.fields[0].association, association);
        let ignored = opened.warnings.iter().filter(|w| w.contains("ignored")).count();
        prop_assert_eq!(ignored > 0, extras, "{:?}", opened.warnings);
    }

    #[test]
    fn raw_with_a_given_layout(mut v in volumes(), big: bool, skip in 0..50_usize) {
        // Raw files know neither components nor a place in the world.
        v = Volume::new(v.dims, v.scalar_type, 1, 5);
        v.origin = [0.0; 3];
        v.direction = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let folder = tempfile::tempdir().unwrap();
        let path = write::raw(folder.path(), &v, big, skip);
        let known = RawOverrides {
            dims: Some(v.dims),
            scalar_type: Some(v.scalar_type),
            endian: Some(if big { Endian::Big } else { Endian::Little }),
            skip_bytes: Some(skip as u64),
            spacing: Some(v.spacing.into()),
        };
        let options = OpenOptions { raw: Some(known), ..Default::default() };
        let opened = open(&path, &options, &Ticket::new()).unwrap();
        prop_assert_eq!(difference(&v, &opened), None);
        prop_assert_eq!(opened.format, Format::Raw);
        // The preview's slice is the volume's.
        let layout = raw::layout(&path, known).unwrap();
        let z = v.dims[2] - 1;
        let slice = raw::read_slice(&path, &layout, z).unwrap();
        for i in 0..slice.len() {
            let (a, b) = (slice.get(i), opened.grid.fields[0].samples.get(z * slice.len() + i));
            prop_assert_eq!(a.to_bits(), b.to_bits());
        }
        prop_assert!(raw::read_slice(&path, &layout, z + 1).is_err());
    }
}

#[test]
fn the_comparison_notices_each_thing_that_can_differ() {
    let folder = tempfile::tempdir().unwrap();
    let v = Volume::new([2, 3, 4], ScalarType::Int16, 1, 3);
    let opened = read(&write::nrrd(folder.path(), &v, "raw", false, false));
    assert_eq!(difference(&v, &opened), None);
    let mut bytes = v.clone();
    bytes.bytes[7] ^= 1;
    let wrong = [
        bytes,
        Volume { dims: [3, 2, 4], ..v.clone() },
        Volume { components: 2, ..v.clone() },
        Volume { scalar_type: ScalarType::UInt16, ..v.clone() },
        Volume { spacing: [0.5, 2.0, 1.250_001], ..v.clone() },
        Volume { origin: [-3.0, 1e7, 0.125_001], ..v.clone() },
        Volume { direction: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0], ..v },
    ];
    for wrong in wrong {
        assert!(difference(&wrong, &opened).is_some(), "{wrong:?}");
    }
}
