//! A scene's picture by its own mode, or as what the mode converges to.

use glam::DVec2;

use super::RefKernel;
use super::classes::Classes;
use super::cut::Cut;
use super::field::{Field, Shape};
use super::inside::{Layer, Opening, Part, Slice, Surface, woven, woven_among};
use super::kernels::grid_kernels;
use super::layers::{self, Planes};
use super::line::ENDLESS;
use super::mesh::Meshes;
use super::polygons::Polygons;
use super::projection;
use super::quadrature::{Density, Light};
use super::shading::{RayShader, SampleShader, Shader};
use super::sources::{GridKernels, Hit, Line, ListKernels};
use super::truth;
use super::vectors::{Vectors, merged};
use crate::core::Camera;
use crate::core::parallel;
use crate::kernel::{Kernel, RadialKernel, SplatMesh};
use crate::scene::{Classify, ModeError, OpacityModel, Order, Scene, SplatSettings, Visibility};
use crate::transfer::TRANSMITTANCE_FLOOR;
use crate::volume::Lattice;

/// Error allowed in a pixel of the continuous integral. Measured: what is found differs from what a
/// hundredth of it finds by less than this.
pub const TOLERANCE: f64 = 1e-7;

/// A surface so few steps of the lattice behind a slice counts as before it.
const SLICE_TIE: f64 = 1.0 / 256.0;

/// The float64 picture of a scene, pixel by pixel: linear premultiplied RGBA, without background.
///
/// All rays are the pixels' true ones, also in perspective, where they begin at the eye; but meshes
/// ([`Kernel::Gouraud`]) lie in the picture, on the ellipses of the linearised projection.
pub struct Reference {
    camera: Camera,
    lattice: Lattice,
    /// Of the picture, and rays along the edge of a pixel.
    size: [usize; 2],
    fine: usize,
    splat: SplatSettings,
    exact: bool,
    tolerance: f64,
    shape: Option<RadialKernel>,
    opening: Opening,
    source: Source,
    /// What the field's slabs are of, if not all of it.
    cut: Option<Cut>,
    vectors: Vec<Vectors>,
    polygons: Option<Polygons>,
}

enum Source {
    Grid(Box<GridKernels>, Shape),
    List(Box<ListKernels>),
    Nothing,
    Field { field: Box<Field>, classes: Classes, visible: Vec<bool>, shader: Option<Box<Shader>> },
    Meshes(Meshes),
}

impl Reference {
    /// The picture by the scene's own mode, `size` [width, height] pixels.
    ///
    /// # Errors
    /// [`ModeError`] for a mode that means nothing, and for layers that cannot be drawn.
    pub fn new(scene: &Scene, size: [usize; 2]) -> Result<Self, ModeError> {
        Self::of(scene, size, 1, false, None)
    }

    /// The continuous integral that the mode converges to: shade first, or of values classified
    /// after reconstruction, by `scene.splat.classify`. Its optical depths are exact, whatever the
    /// opacity model and visibility. Points are taken as their voxels' boxes. Vectors are in it alone, and
    /// beside values that are classified after reconstruction.
    ///
    /// # Errors
    /// As [`Reference::new`].
    pub fn exact(scene: &Scene, size: [usize; 2]) -> Result<Self, ModeError> {
        Self::of(scene, size, 1, true, None)
    }

    /// The mean of `rays` × `rays` rays a pixel, for kernels smaller than one; by the scene's mode,
    /// or `exact`.
    ///
    /// # Errors
    /// As [`Reference::new`].
    pub fn supersampled(
        scene: &Scene,
        size: [usize; 2],
        rays: usize,
        exact: bool,
    ) -> Result<Self, ModeError> {
        Self::of(scene, size, rays.max(1), exact, None)
    }

    /// Kernels of any kind, as of an octree cut, in place of the scene's samples: given from back to
    /// front, shaded first.
    ///
    /// # Errors
    /// As [`Reference::new`].
    ///
    /// # Panics
    /// Where the scene's mode classifies after reconstruction, or its kernel is separable.
    pub fn of_kernels(
        kernels: Vec<RefKernel>,
        scene: &Scene,
        size: [usize; 2],
        exact: bool,
    ) -> Result<Self, ModeError> {
        assert!(
            scene.splat.classify == Classify::Before && !scene.splat.kernel.is_separable(),
            "a list of kernels is shaded first"
        );
        Self::of(scene, size, 1, exact, Some(kernels))
    }

    /// The same of a cut of the field: a level a brick of 4³ cells, x fastest; of level 0 is the field itself, of 1 and 2 tents
    /// through means of 2³ and of 4³ samples; what has another is left out. Slabs are found for one ray by itself.
    ///
    /// # Panics
    /// Where there are not as many levels as bricks; where the mode does not lay pre-integrated slabs of products of a natural
    /// width down from the front on.
    #[must_use]
    pub fn of_cut(mut self, scene: &Scene, bricks: [usize; 3], levels: &[u8]) -> Self {
        assert_eq!(levels.len(), bricks.iter().product::<usize>(), "a level a brick");
        let SplatSettings { classify, visibility, order, opacity_model, .. } = self.splat;
        assert!(
            classify == Classify::PreIntegrated
                && visibility == Visibility::Slabs
                && order == Order::FrontToBack
                && opacity_model == OpacityModel::OpticalDepth
                && Shape::of(&self.splat).is_some_and(Cut::is_of)
                && !self.exact
                && self.vectors.is_empty(),
            "a mode that has cuts"
        );
        self.cut = scene.volume().map(|volume| Cut::new(volume, (bricks, levels)));
        self
    }

    /// Another error allowed in the continuous integral than [`TOLERANCE`].
    #[must_use]
    pub fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    fn of(
        scene: &Scene,
        size: [usize; 2],
        fine: usize,
        exact: bool,
        kernels: Option<Vec<RefKernel>>,
    ) -> Result<Self, ModeError> {
        scene.splat.check()?;
        scene.check_layers()?;
        let mut splat = scene.splat;
        if exact && splat.kernel == Kernel::Point {
            splat.kernel = Kernel::Nearest;
        }
        let unit = scene.opacity_unit_distance();
        let published = !exact && splat.opacity_model == OpacityModel::Published;
        let transfer = scene.drawn_transfer();
        let transfer = transfer.as_deref().map(|transfer| scene.shading.by_value(transfer));
        let classes = transfer.as_ref().map(|transfer| Classes::new(transfer, unit, published));
        let field = scene.volume().zip(classes).filter(|_| scene.shows_field());
        let shape = RadialKernel::new(splat.kernel, splat.extent);
        let list = |kernels: Vec<RefKernel>| {
            let weight = |k: &RefKernel| density(k, unit, published);
            let size = size.map(|n| n * fine);
            let (camera, lattice) = (&scene.camera, &scene.lattice());
            let SplatSettings { kernel, extent, .. } = splat;
            let list = ListKernels::new(kernels, kernel, extent, camera, lattice, weight, size);
            Source::List(Box::new(list))
        };
        let meshes = |kernels: &[RefKernel], shape: RadialKernel| {
            let mesh = SplatMesh::of(shape, splat.gouraud);
            let (size, opacity) = (size.map(|n| n * fine), (splat.opacity_model, unit));
            Source::Meshes(Meshes::new(kernels, mesh, shape, &scene.camera, size, opacity))
        };
        let mesh_shape = shape.filter(|_| !exact && splat.kernel == Kernel::Gouraud);
        let source = match (kernels, field, Shape::of(&splat)) {
            (Some(kernels), ..) if let Some(shape) = mesh_shape => meshes(&kernels, shape),
            (Some(kernels), ..) => list(kernels),
            (None, None, _) => Source::Nothing,
            (None, ..) if let Some(shape) = mesh_shape => meshes(&grid_kernels(scene), shape),
            (None, _, None) => list(grid_kernels(scene)),
            (None, Some((volume, classes)), Some(shape)) if splat.classify == Classify::Before => {
                let shader = SampleShader::of(scene, exact);
                let grid = GridKernels::new(volume, &scene.camera, classes, shader);
                Source::Grid(Box::new(grid), shape)
            }
            (None, Some((volume, classes)), Some(shape)) => {
                let field = Field::new(volume, shape, splat.reconstruction);
                let holes = scene.transfer().is_some_and(|transfer| transfer.no_data.shows());
                let visible = field.bricks_where(holes, |low, high| !classes.is_clear(low, high));
                let shader = Shader::of(scene, exact).map(Box::new);
                Source::Field { field: Box::new(field), classes, visible, shader }
            }
        };
        Ok(Self {
            camera: scene.camera,
            lattice: scene.lattice(),
            size,
            fine,
            splat,
            exact,
            tolerance: TOLERANCE,
            shape,
            opening: Opening::of(scene),
            source,
            cut: None,
            vectors: Vectors::of(scene, (size[1] * fine) as f64, exact),
            polygons: Polygons::of(scene, size),
        })
    }

    /// The pixel at [column, row], (0, 0) top left. Takes milliseconds where the ray meets
    /// hundreds of voxels.
    pub fn pixel(&self, [x, y]: [usize; 2]) -> [f64; 4] {
        let n = self.fine;
        let mut sum = [0.0; 4];
        for i in 0..n * n {
            let ray = self.trace([x * n + i % n, y * n + i / n]);
            sum.iter_mut().zip(ray).for_each(|(s, v)| *s += v);
        }
        sum.map(|s| s / (n * n) as f64)
    }

    /// Several pixels, in parallel.
    pub fn pixels(&self, pixels: &[[usize; 2]]) -> Vec<[f64; 4]> {
        parallel::list(pixels.len(), |i| self.pixel(pixels[i]))
    }

    /// Every pixel, top row first. For small pictures.
    pub fn picture(&self) -> Vec<[f64; 4]> {
        let [width, height] = self.size;
        let pixel = |i: usize| self.pixel([i % width, i / width]);
        parallel::list(width * height, pixel)
    }

    /// One ray: a pixel of the finer picture.
    fn trace(&self, pixel: [usize; 2]) -> [f64; 4] {
        let size = self.size.map(|n| (n * self.fine) as f64);
        let at = DVec2::new(pixel[0] as f64 + 0.5, pixel[1] as f64 + 0.5);
        let ray = Line::through(&self.camera, at, size);
        let half = self.fine as f64 / 2.0;
        let sides = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
        let beside: Vec<Line> = match self.opening.has_edges() {
            true => sides.map(|side| Line::through(&self.camera, at + half * side, size)).into(),
            false => Vec::new(),
        };
        let Some(polygons) = &self.polygons else {
            return self.traced(pixel, (&ray, &beside), &[]);
        };
        let seen = polygons.seen_by(pixel.map(|i| i / self.fine), &ray);
        let samples = seen.map(|polygons| self.traced(pixel, (&ray, &beside), &polygons));
        std::array::from_fn(|c| samples.iter().map(|sample| sample[c]).sum::<f64>() / 4.0)
    }

    /// One ray, with the polygons that a sample of its pixel sees, from the eye inwards.
    fn traced(
        &self,
        pixel: [usize; 2],
        (ray, beside): (&Line, &[Line]),
        polygons: &[Surface],
    ) -> [f64; 4] {
        let ray = *ray;
        let is_alone = matches!(self.source, Source::Nothing);
        if is_alone && self.exact {
            let part = Part { ends: [0.0; 2], surfaces: polygons.to_vec() };
            let splats = Vectors::on_ray(&self.vectors, &ray, ENDLESS);
            return truth::among_vectors(None, &part, &splats, self.tolerance);
        }
        if is_alone && !self.vectors.is_empty() {
            let mut planes = self.slabs(&ray);
            planes.step *= Vectors::step(&self.vectors) / self.lattice.smallest_spacing();
            let sums = Vectors::sums(&self.vectors, &ray, &planes, ENDLESS);
            let layers = woven(&merged(Vec::new(), &sums, &planes, ENDLESS), polygons);
            return layers::composite(&layers, self.splat.opacity_model, self.splat.order);
        }
        let layers = match &self.source {
            Source::Nothing => woven(&[], polygons),
            Source::Field { field, classes, visible, shader } => {
                let field: &Field = field;
                let map = self.lattice.axes().inverse();
                let line = ray.mapped(map, self.lattice.origin);
                let shader = shader.as_deref();
                let shade = RayShader { shader, field, world: &ray, index: &line, beside: &[] };
                let part = self.opening.part((field, classes), (&ray, &line), beside);
                if part.is_none() && self.vectors.is_empty() && polygons.is_empty() {
                    return [0.0; 4];
                }
                let part = Part::among(part, polygons.to_vec());
                if let Some(along) = self.opening.projects() {
                    // The same in every mode: what a mode finds of it is near to this.
                    let found = projection::projected(field, &line, along, part.ends);
                    let colour = |value| {
                        let [r, g, b] = classes.colour(value);
                        [r, g, b, 1.0]
                    };
                    return found.map_or([0.0; 4], colour);
                }
                if self.exact && !self.vectors.is_empty() {
                    let kept = self.opening.kept(&ray, &line, ENDLESS, &mut false);
                    let splats = Vectors::on_ray(&self.vectors, &ray, kept);
                    let matter = Some((field, classes, visible.as_slice(), shade));
                    return truth::among_vectors(matter, &part, &splats, self.tolerance);
                }
                if self.exact {
                    return truth::after(field, classes, visible, shade, &part, self.tolerance);
                }
                let (planes, model) = (self.slabs(&ray), self.splat.opacity_model);
                let classify = self.splat.classify;
                let slabs = match &self.cut {
                    Some(cut) => cut.classified((field, classes), &planes, shade, &part),
                    None => {
                        layers::classified(field, classes, &planes, classify, model, shade, &part)
                    }
                };
                let slabs = match self.vectors.as_slice() {
                    [] => slabs,
                    vectors => {
                        let kept = self.opening.kept(&ray, &line, ENDLESS, &mut false);
                        let sums = Vectors::sums(vectors, &ray, &planes, kept);
                        merged(slabs, &sums, &planes, kept)
                    }
                };
                woven(&slabs, &part.surfaces)
            }
            Source::Grid(grid, shape) if let Some(product) = shape.product() => {
                if self.exact {
                    // The span only shares out the error: any measure of the volume will do.
                    let span = 2.0 * self.lattice.bounding_radius();
                    let mut light = Light::new(self.tolerance, span);
                    let mut surfaces = truth::Surfaces(polygons);
                    truth::separable_cells(grid, product, &ray, |a, b, density| {
                        surfaces.add(&mut light, a, b, &density);
                        !light.is_opaque()
                    });
                    surfaces.lay_until(&mut light, f64::INFINITY);
                    return light.pixel();
                }
                let planes = self.slabs(&ray);
                let slabs = layers::separable_between_planes(grid, product, &ray, &planes);
                woven(&self.beside(slabs, &ray, &planes), polygons)
            }
            Source::Grid(grid, _) => {
                return self.splatted(grid.hits(&ray, self.shape), &ray, polygons);
            }
            Source::List(list) => return self.splatted(list.hits(&ray, pixel), &ray, polygons),
            Source::Meshes(meshes) => return meshes.pixel(&self.camera, pixel),
        };
        layers::composite(&layers, self.splat.opacity_model, self.splat.order)
    }

    /// Kernels that are shaded first, by the mode, and the surfaces among them from the eye inwards.
    ///
    /// Samples and whole slices stay whole: a surface has its turn between two slices of the traversal, as
    /// a sample would in its place, and a slab of vectors as one in its middle. What is summed up between
    /// two planes is taken to be as dense everywhere there, and split by both; in slabs, which vectors
    /// have in common with kernels, by surfaces.
    fn splatted(&self, hits: Vec<Hit>, ray: &Line, surfaces: &[Surface]) -> [f64; 4] {
        let (shape, from) = (self.shape, ray.from);
        if self.exact {
            return truth::shade_first(&hits, shape, from, self.tolerance, surfaces);
        }
        let between = |planes: &Planes| layers::between_planes(&hits, shape, planes, from);
        let layers = match self.splat.visibility {
            Visibility::EverySample => {
                layers::every_sample(hits, shape, from, &self.seats(ray, surfaces))
            }
            Visibility::Sheets if self.splat.sheets_per_kernel == 1 => {
                layers::slices(&hits, shape, from, &self.seats(ray, surfaces))
            }
            Visibility::Sheets => {
                woven_among(&between(&self.sheets(ray)), &self.others(ray, surfaces))
            }
            Visibility::Slabs => {
                let planes = self.slabs(ray);
                woven(&self.beside(between(&planes), ray, &planes), surfaces)
            }
        };
        layers::composite(&layers, self.splat.opacity_model, self.splat.order)
    }

    /// What slabs hold, with what they hold of vectors.
    fn beside(&self, slabs: Vec<Slice>, ray: &Line, planes: &Planes) -> Vec<Slice> {
        if self.vectors.is_empty() {
            return slabs;
        }
        merged(slabs, &Vectors::sums(&self.vectors, ray, planes, ENDLESS), planes, ENDLESS)
    }

    /// Surfaces and slabs of vectors, these in their middles, from the eye inwards.
    fn others(&self, ray: &Line, surfaces: &[Surface]) -> Vec<(f64, Layer)> {
        let planes = self.slabs(ray);
        let slabs = Vectors::sums(&self.vectors, ray, &planes, ENDLESS);
        let middle = |slab| f64::midpoint(planes.face(slab), planes.face(slab + 1));
        let slabs = slabs.into_iter().map(|(slab, sum)| (middle(slab), Layer::Matter(sum)));
        let surfaces = surfaces.iter().map(|surface| (surface.t, Layer::Surface(*surface)));
        let mut others: Vec<_> = surfaces.chain(slabs).collect();
        others.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        others
    }

    /// The same, and how many slices of the traversal are farther than each: if it is close behind one,
    /// that too.
    fn seats(&self, ray: &Line, surfaces: &[Surface]) -> Vec<layers::Seated> {
        let others = self.others(ray, surfaces);
        if others.is_empty() {
            return Vec::new();
        }
        let (order, runs) = super::kernels::loops(&self.lattice, &self.camera);
        let axis = order[0];
        let line = ray.mapped(self.lattice.axes().inverse(), self.lattice.origin);
        let eye = match self.camera.eye_distance() {
            Some(_) => self.lattice.index_from_world(self.camera.view_origin())[axis],
            None if line.step[axis] > 0.0 => f64::NEG_INFINITY,
            None => f64::INFINITY,
        };
        let seat = |(t, layer): (f64, Layer)| {
            let place = line.at(t)[axis];
            let is_beyond = place > eye;
            let is_farther = |&&slice: &&usize| {
                let slice = slice as f64;
                match (is_beyond, slice > eye) {
                    (true, true) => slice > place - SLICE_TIE,
                    (false, false) => slice < place + SLICE_TIE,
                    (_, slice_is_beyond) => slice_is_beyond,
                }
            };
            (layer, runs[0].iter().take_while(is_farther).count())
        };
        others.into_iter().map(seat).collect()
    }

    /// Image-aligned planes Δ = smallest spacing / N apart, one through the lattice's centre.
    fn slabs(&self, ray: &Line) -> Planes {
        let depth = self.camera.direction;
        let along = ray.step.dot(depth);
        let step = self.lattice.smallest_spacing() / self.splat.slabs_per_voxel;
        Planes {
            centre: (self.lattice.centre() - ray.start).dot(depth) / along,
            step: step / along,
        }
    }

    /// Planes across the outermost axis, 2R/N slices apart, one through the lattice's centre.
    fn sheets(&self, ray: &Line) -> Planes {
        let line = ray.mapped(self.lattice.axes().inverse(), self.lattice.origin);
        let (order, _) = super::kernels::loops(&self.lattice, &self.camera);
        let axis = order[0];
        let centre = (self.lattice.dims[axis] as f64 - 1.0) / 2.0;
        let radius = self.shape.map_or(0.5, RadialKernel::radius);
        let step = 2.0 * radius / f64::from(self.splat.sheets_per_kernel);
        let along = line.step[axis];
        if along.abs() < 1e-12 * line.step.length() {
            return Planes { centre: 0.0, step: f64::INFINITY };
        }
        Planes { centre: (centre - line.start[axis]) / along, step: step / along.abs() }
    }
}

/// A kernel's weights per world unit.
fn density(k: &RefKernel, unit: f64, published: bool) -> Density {
    let weight = if published {
        (-(-k.extinction * unit).exp_m1()).min(1.0 - TRANSMITTANCE_FLOOR) / unit
    } else {
        k.extinction
    };
    let [r, g, b] = k.colour;
    [weight, weight * r, weight * g, weight * b]
}
