//! Samples by name: what layers are made of, kept apart from how they look.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::FieldOnMesh;
use crate::core::counted;
use crate::polygons::Mesh;
use crate::volume::{Component, ScalarVolume, VectorField};

/// Where samples come from, so that they can be read, or made, again.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SampleSource {
    /// A file, or `demo:NAME`; empty where the program made them of other samples.
    pub path: PathBuf,
    /// The name of the field in it.
    pub field: String,
    /// What of the field; `None` is all of it.
    pub component: Option<Component>,
    /// 0, and counted up where the rest is the same and the samples are not.
    pub copy: u32,
}

impl SampleSource {
    /// A number of a field of a file.
    pub fn component(path: &Path, field: &str, component: Component) -> Self {
        Self { component: Some(component), ..Self::whole(path, field) }
    }

    /// All of a field of a file, or of a mesh.
    pub fn whole(path: &Path, field: &str) -> Self {
        Self { path: path.to_owned(), field: field.to_owned(), component: None, copy: 0 }
    }

    /// What the program made itself.
    pub fn made(name: &str) -> Self {
        Self::whole(Path::new(""), name)
    }
}

/// Samples of one source. Cheap to clone: they are shared.
#[derive(Debug, Clone)]
pub enum Sampled {
    /// Values on a lattice.
    Volume(Arc<ScalarVolume>),
    /// Vectors at places.
    Vectors(Arc<VectorField>),
    /// Triangles.
    Mesh(Arc<Mesh>),
}

impl Sampled {
    /// What they are, for people: a name, and how much there is.
    pub fn about(&self) -> String {
        match self {
            Self::Volume(volume) => volume.name.clone(),
            Self::Vectors(field) => {
                format!("{} ({})", field.name, counted(field.vectors.len(), "vector"))
            }
            Self::Mesh(mesh) => format!("{} ({})", mesh.name(), counted(mesh.len(), "triangle")),
        }
    }
}

impl PartialEq for Sampled {
    /// The same samples, not equal ones.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Volume(a), Self::Volume(b)) => Arc::ptr_eq(a, b),
            (Self::Vectors(a), Self::Vectors(b)) => Arc::ptr_eq(a, b),
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// The samples that the layers of a scene name. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Store {
    held: Vec<(SampleSource, Sampled)>,
    /// Made of these, and to be made again where it is not there: the field's values on meshes. The newest last.
    pub(super) on_meshes: Vec<FieldOnMesh>,
}

impl Store {
    /// The samples of a source, if they are there.
    pub fn get(&self, source: &SampleSource) -> Option<&Sampled> {
        self.held.iter().find(|(held, _)| held == source).map(|(_, samples)| samples)
    }

    /// Takes samples in; the source by which they are found from now on, which is another copy's where
    /// other samples have this one already.
    pub fn insert(&mut self, mut source: SampleSource, samples: Sampled) -> SampleSource {
        while let Some(held) = self.get(&source) {
            if *held == samples {
                return source;
            }
            source.copy += 1;
        }
        self.held.push((source.clone(), samples));
        source
    }

    /// Lets go of samples that are not asked for.
    pub fn retain(&mut self, is_named: impl Fn(&SampleSource) -> bool) {
        self.held.retain(|(source, _)| is_named(source));
    }

    /// All of them.
    pub fn samples(&self) -> impl Iterator<Item = &Sampled> {
        self.held.iter().map(|(_, samples)| samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    fn volume() -> Sampled {
        let samples = Samples::UInt8(vec![0]);
        let volume = ScalarVolume::from_samples("v", Lattice::unit([1; 3]), samples);
        Sampled::Volume(Arc::new(volume.unwrap()))
    }

    #[test]
    fn samples_of_one_name_are_told_apart_and_the_same_ones_are_held_once() {
        let (mut store, a, b) = (Store::default(), volume(), volume());
        let source = SampleSource::component(Path::new("a.vti"), "v", Component::Index(0));
        let first = store.insert(source.clone(), a.clone());
        assert_eq!(store.insert(source.clone(), a.clone()), first);
        let second = store.insert(source.clone(), b.clone());
        assert_eq!((first.copy, second.copy, store.samples().count()), (0, 1, 2));
        assert_eq!([store.get(&first), store.get(&second)], [Some(&a), Some(&b)]);
        store.retain(|source| *source == second);
        assert!(store.get(&first).is_none() && store.get(&second).is_some());
        // What was let go of gives its name back.
        assert_eq!(store.insert(source, a).copy, 0);
    }
}
