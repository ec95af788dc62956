//! Exodus II: points, blocks of elements and their variables, in NetCDF of any version. (*EXODUS II: A Finite Element Data
//! Model*, SAND92-2137.)

mod elements;

use glam::DVec3;
use netcdf_reader::{NcFile, NcSliceInfo, NcSliceInfoElem, NcVariable};

use self::elements::Element;
use super::super::error::{Problem, header, quoted, unsupported};
use super::super::unstructured::{self, Part};
use super::super::{Format, Opened, bytes};
use super::{MOST_FIELDS, damaged, panicked, scalar_type};
use crate::cells::Listing;
use crate::core::memory;
use crate::core::panics::caught;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Samples, ScalarType};

/// More blocks or variables than this are no list that anybody looks at.
const MOST_LISTED: u64 = 100_000;

/// Whether a file has the nodes of a mesh: their number, and that of their coordinates, or these.
pub(super) fn is_it(file: &NcFile) -> bool {
    let has_places = || ["coord", "coordx"].iter().any(|name| file.variable(name).is_ok());
    file.dimension("num_nodes").is_ok() && (file.dimension("num_dim").is_ok() || has_places())
}

/// One block of elements of a kind.
struct Block {
    number: u64,
    elements: usize,
}

/// The file, and what may be taken for it.
struct Reader<'a> {
    file: &'a NcFile,
    /// Most bytes that the file can hold.
    most_bytes: u64,
    ticket: &'a Ticket,
}

pub(super) fn read(
    file: &NcFile,
    most_bytes: u64,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Opened, Problem> {
    let reader = Reader { file, most_bytes, ticket };
    let mut warnings = Vec::new();
    let nodes = reader.dimension("num_nodes");
    let elements = reader.dimension("num_elem");
    // What blocks really have is in the file, which is in memory.
    bytes::require_stored(nodes.saturating_mul(4), most_bytes)?;
    unstructured::require_memory(nodes, elements, 0, free_bytes)?;
    let mut listing = Listing { starts: vec![0], ..Listing::default() };
    listing.points = reader.points(nodes)?;
    let blocks = reader.blocks(&mut listing, free_bytes, &mut warnings)?;
    let steps = reader.dimension("time_step");
    let mut fields = Vec::new();
    if steps > 0 {
        let values = [("num_nod_var", nodes), ("num_elem_var", elements)];
        let numbers = values.map(|(of, count)| reader.dimension(of).saturating_mul(count));
        let numbers = numbers.into_iter().fold(0, u64::saturating_add);
        let variables = values.into_iter().map(|(of, _)| reader.dimension(of));
        let variables = variables.fold(0, u64::saturating_add).saturating_mul(steps);
        // As they are kept, and as one step of them is read.
        let needed =
            |steps: u64| numbers.saturating_mul(steps.saturating_mul(8).saturating_add(16));
        let is_room = variables <= MOST_FIELDS as u64 && needed(steps) <= free_bytes;
        let opened = if is_room { steps } else { 1 };
        memory::require("the variables of the first time step", needed(opened), free_bytes)?;
        let told = reader.told(steps);
        for step in 0..opened {
            // What is said of one is true of all.
            let (mut rest, first) = (Vec::new(), &mut warnings);
            let said = if step == 0 { first } else { &mut rest };
            let mut own = reader.nodal((nodes, step), said)?;
            own.extend(reader.of_elements((&blocks, step), said)?);
            if let Some(told) = told.get(step as usize) {
                own.iter_mut().for_each(|field| field.name.push_str(told));
            }
            fields.extend(own);
        }
        if steps > 1 {
            let what = match opened == steps {
                true => ": each is a field of its own",
                false => ", more than there is room for: the first is opened",
            };
            warnings.push(format!("the file has {steps} time steps{what}"));
        }
    }
    fields.extend(reader.ids(&blocks));
    let has_elements = !listing.types.is_empty();
    if !has_elements {
        warnings.push(reader.no_elements(elements));
    }
    let grid = unstructured::grid(Part { listing, fields }, &[], free_bytes, &mut warnings)?;
    warnings.extend(unstructured::points_alone(&grid).filter(|_| has_elements));
    Ok(Opened::of(grid, Format::Exodus, warnings))
}

impl Reader<'_> {
    /// 0 where there is none.
    fn dimension(&self, name: &str) -> u64 {
        self.file.dimension(name).map_or(0, |dimension| dimension.size)
    }

    fn variable(&self, name: &str) -> Option<&NcVariable> {
        self.file.variable(name).ok()
    }

    /// A variable of so many numbers along its last dimension, at indices of those before; in its own type.
    fn numbers(&self, variable: &NcVariable, at: &[u64]) -> Result<Samples, Problem> {
        self.ticket.checkpoint(0, 1)?;
        let name = variable.name();
        let stored = scalar_type(variable).ok_or_else(|| {
            header(
                format!("the variable {} of numbers", quoted(name)),
                "another type",
                "write the file again",
            )
        })?;
        let shape = variable.shape();
        if shape.len() < at.len() || at.iter().zip(&shape).any(|(index, size)| index >= size) {
            return Err(header(
                format!("the variable {} of {} dimensions or more", quoted(name), at.len() + 1),
                format!("the sizes {shape:?}"),
                "write the file again",
            ));
        }
        let rest = &shape[at.len()..];
        let count = memory::checked_product(rest).unwrap_or(u64::MAX);
        bytes::require_stored(count.saturating_mul(stored.size_bytes() as u64), self.most_bytes)?;
        let mut selections: Vec<NcSliceInfoElem> =
            at.iter().map(|&index| NcSliceInfoElem::Index(index)).collect();
        selections.resize(shape.len(), NcSliceInfoElem::Slice { start: 0, end: u64::MAX, step: 1 });
        let slice = NcSliceInfo { selections };
        let values = caught(|| self.file.read_variable_slice_as_f64(name, &slice))
            .map_err(|words| panicked(&words))?
            .map_err(damaged)?;
        let (values, _offset) = values.into_raw_vec_and_offset();
        Ok(of_type(stored, values))
    }

    /// Numbers that must be so many.
    fn counted(
        &self,
        variable: &NcVariable,
        at: &[u64],
        expected: usize,
    ) -> Result<Samples, Problem> {
        let samples = self.numbers(variable, at)?;
        if samples.len() == expected {
            return Ok(samples);
        }
        Err(header(
            format!("{expected} numbers of the variable {}", quoted(variable.name())),
            samples.len().to_string(),
            "the file was altered: copy or write it again",
        ))
    }

    /// How many coordinates a node has; where that is not told, as many as there are.
    fn dimensions(&self) -> u64 {
        let listed = || {
            let names = ["coordx", "coordy", "coordz"];
            let each = names.iter().filter(|name| self.variable(name).is_some()).count() as u64;
            let all = self.variable("coord").and_then(|all| all.shape().first().copied());
            all.unwrap_or(each)
        };
        match self.dimension("num_dim") {
            0 => listed(),
            told => told,
        }
    }

    /// What is said of a file without elements that are read.
    fn no_elements(&self, promised: u64) -> String {
        let promised = match promised {
            0 => String::new(),
            1 => ", though the file promises 1 element".to_owned(),
            many => format!(", though the file promises {many} elements"),
        };
        format!("no block of elements was found{promised}: its nodes are shown as points")
    }

    fn points(&self, nodes: u64) -> Result<Vec<DVec3>, Problem> {
        let count = usize::try_from(nodes).unwrap_or(usize::MAX);
        let dimensions = self.dimensions().min(3);
        let mut lists = Vec::new();
        for axis in 0..dimensions {
            // In one variable, or in one for each axis.
            let name = ["coordx", "coordy", "coordz"][usize::try_from(axis).unwrap_or(0)];
            let list = match (self.variable("coord"), self.variable(name)) {
                (_, Some(own)) => self.counted(own, &[], count)?,
                (Some(all), None) => self.counted(all, &[axis], count)?,
                (None, None) => {
                    return Err(header(
                        format!("coordinates in the variable coord or {name}"),
                        "neither",
                        "write the file again",
                    ));
                }
            };
            lists.push(list);
        }
        // Of flat meshes z is 0. Lists have as many numbers as there are nodes: they were counted.
        let place = |at: usize| {
            let axis = |axis: usize| lists.get(axis).map_or(0.0, |list| list.get(at));
            DVec3::new(axis(0), axis(1), axis(2))
        };
        Ok(if lists.is_empty() { Vec::new() } else { (0..count).map(place).collect() })
    }

    fn blocks(
        &self,
        listing: &mut Listing,
        free_bytes: u64,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Block>, Problem> {
        let count = self.dimension("num_el_blk");
        if count > MOST_LISTED {
            return Err(unsupported(
                format!("at most {MOST_LISTED} blocks"),
                count.to_string(),
                "extract some of them first",
            ));
        }
        let mut blocks = Vec::new();
        let mut faces = None;
        for number in 1..=count {
            let named = |of: &str| self.variable(&format!("{of}{number}"));
            // Polyhedra have faces; blocks of nothing have neither.
            let Some(variable) = named("connect").or_else(|| named("facconn")) else { continue };
            let kind = variable.attribute("elem_type").and_then(|kind| kind.value.as_string());
            let kind = kind.unwrap_or_default();
            let kind = kind.trim_matches(['\0', ' ']).to_ascii_uppercase();
            let sizes = variable.shape();
            let all = memory::checked_product(&sizes).unwrap_or(u64::MAX);
            let rows = sizes.first().copied().unwrap_or(0);
            unstructured::require_memory(0, rows, all, free_bytes)?;
            let mut numbers = unstructured::whole_numbers(&self.numbers(variable, &[])?);
            // The first is 1.
            numbers.iter_mut().for_each(|number| *number = number.saturating_sub(1));
            let before = listing.types.len();
            if kind.starts_with("NSIDED") {
                self.add_polygons(listing, &numbers, number)?;
            } else if kind.starts_with("NFACED") {
                let known = match &mut faces {
                    Some(known) => known,
                    none => none.insert((self.faces(free_bytes)?, 0)),
                };
                self.add_polyhedra(listing, (&numbers, number), known, free_bytes)?;
            } else {
                let per_element = match sizes[..] {
                    [_, per_element] => usize::try_from(per_element).unwrap_or(usize::MAX),
                    _ => 0,
                };
                let element = Element::of(&kind, per_element).ok_or_else(|| {
                    unsupported(
                        "elements that are points, lines, triangles, squares, polygons, tetrahedra, pyramids, wedges, hexahedra or polyhedra",
                        format!("{} of {per_element} nodes in block {number}", quoted(&kind)),
                        "convert these elements first",
                    )
                })?;
                if element.corners() < per_element {
                    warnings.push(format!(
                        "elements {kind} of block {number} have {per_element} nodes: the first {} are used",
                        element.corners()
                    ));
                }
                element.add(listing, &numbers, per_element)?;
            }
            blocks.push(Block { number, elements: listing.types.len() - before });
        }
        Ok(blocks)
    }

    /// Where each of some lists ends that lie one after another, by a variable of how long each is.
    fn ends(&self, what: &str, name: &str) -> Result<Vec<i64>, Problem> {
        let Some(sizes) = self.variable(name) else {
            return Err(header(
                format!("the sizes of {what} in the variable {name}"),
                "none",
                "write the file again",
            ));
        };
        let mut end = 0_i64;
        let to_end = |size: &i64| {
            end = end.saturating_add(*size);
            end
        };
        Ok(unstructured::whole_numbers(&self.numbers(sizes, &[])?).iter().map(to_end).collect())
    }

    /// Polygons, each of as many nodes as a variable beside says.
    fn add_polygons(
        &self,
        listing: &mut Listing,
        numbers: &[i64],
        block: u64,
    ) -> Result<(), Problem> {
        let ends = self.ends("polygons", &format!("ebepecnt{block}"))?;
        let starts = unstructured::starts(&ends, ends.len(), numbers.len())?;
        unstructured::add_parted(listing, numbers, &starts, (unstructured::Group::Polygons, &[]))
    }

    /// Polyhedra, each of as many faces as a variable beside says; with all faces, and what those of the polyhedra before take.
    fn add_polyhedra(
        &self,
        listing: &mut Listing,
        (numbers, block): (&[i64], u64),
        (faces, taken): &mut (Vec<Vec<i64>>, u64),
        free_bytes: u64,
    ) -> Result<(), Problem> {
        let ends = self.ends("polyhedra", &format!("ebepecnt{block}"))?;
        let starts = unstructured::starts(&ends, ends.len(), numbers.len())?;
        unstructured::require_faces(faces, numbers.iter(), (taken, free_bytes))?;
        for pair in starts.windows(2) {
            let of = (listing.types.len(), listing.points.len());
            let mut own = unstructured::faces_among(faces, &numbers[pair[0]..pair[1]], of)?;
            turn_outwards(&mut own, &listing.points);
            unstructured::add_polyhedron(listing, own);
        }
        Ok(())
    }

    /// The faces of all polyhedra, one block after another: of as many nodes each as a variable beside says, or all of as many.
    fn faces(&self, free_bytes: u64) -> Result<Vec<Vec<i64>>, Problem> {
        let count = self.dimension("num_fa_blk").min(MOST_LISTED);
        let mut faces = Vec::new();
        for block in 1..=count {
            let Some(variable) = self.variable(&format!("fbconn{block}")) else { continue };
            let sizes = variable.shape();
            let all = memory::checked_product(&sizes).unwrap_or(u64::MAX);
            unstructured::require_memory(0, sizes.first().copied().unwrap_or(0), all, free_bytes)?;
            let mut numbers = unstructured::whole_numbers(&self.numbers(variable, &[])?);
            // The first is 1.
            numbers.iter_mut().for_each(|number| *number = number.saturating_sub(1));
            let starts = match sizes[..] {
                [_, each] => {
                    let each = usize::try_from(each).unwrap_or(usize::MAX).max(1);
                    (0..=numbers.len() / each).map(|face| face * each).collect()
                }
                _ => {
                    let ends = self.ends("faces", &format!("fbepecnt{block}"))?;
                    unstructured::starts(&ends, ends.len(), numbers.len())?
                }
            };
            faces.extend(starts.windows(2).map(|pair| numbers[pair[0]..pair[1]].to_vec()));
        }
        Ok(faces)
    }

    fn names(&self, variable: &str) -> Result<Vec<String>, Problem> {
        let Some(variable) = self.variable(variable) else { return Ok(Vec::new()) };
        let count = memory::checked_product(&variable.shape()).unwrap_or(u64::MAX);
        bytes::require_stored(count, self.most_bytes)?;
        let names = caught(|| self.file.read_variable_as_strings(variable.name()))
            .map_err(|words| panicked(&words))?
            .map_err(damaged)?;
        if names.len() as u64 > MOST_LISTED {
            return Err(unsupported(
                format!("at most {MOST_LISTED} variables"),
                names.len().to_string(),
                "extract some of them first",
            ));
        }
        Ok(names.iter().map(|name| name.trim_matches(['\0', ' ']).to_owned()).collect())
    }

    /// Variables on the nodes, of a time step.
    fn nodal(
        &self,
        (nodes, step): (u64, u64),
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Field>, Problem> {
        let count = usize::try_from(nodes).unwrap_or(usize::MAX);
        let mut found = Vec::new();
        for (index, name) in self.names("name_nod_var")?.into_iter().enumerate() {
            let own = format!("vals_nod_var{}", index + 1);
            let samples = match (self.variable(&own), self.variable("vals_nod_var")) {
                (Some(own), _) => self.counted(own, &[step], count)?,
                (None, Some(all)) => self.counted(all, &[step, index as u64], count)?,
                (None, None) => continue,
            };
            found.push((name, samples));
        }
        Ok(self.fields(found, Association::Point, warnings))
    }

    /// Variables on the elements, of a time step; NaN on blocks that have none.
    fn of_elements(
        &self,
        (blocks, step): (&[Block], u64),
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Field>, Problem> {
        let all = blocks.iter().map(|block| block.elements).sum::<usize>();
        let mut found = Vec::new();
        for (index, name) in self.names("name_elem_var")?.into_iter().enumerate() {
            let of_block = |block: &Block| {
                self.variable(&format!("vals_elem_var{}eb{}", index + 1, block.number))
            };
            let Some(stored) = blocks.iter().find_map(of_block).and_then(scalar_type) else {
                continue;
            };
            let mut values = unstructured::reserved("a variable of the elements", all)?;
            let mut without = 0;
            for block in blocks {
                match of_block(block) {
                    Some(variable) => {
                        let own = self.counted(variable, &[step], block.elements)?;
                        values.extend((0..own.len()).map(|at| own.get(at)));
                    }
                    None => {
                        without += 1;
                        values.resize(values.len() + block.elements, f64::NAN);
                    }
                }
            }
            if without > 0 {
                warnings.push(format!(
                    "the variable {} is NaN on {without} of {} blocks, which have none",
                    quoted(&name),
                    blocks.len()
                ));
            }
            found.push((name, of_type(stored, values)));
        }
        Ok(self.fields(found, Association::Cell, warnings))
    }

    /// Variables as fields; those that end in X, Y and Z as vectors.
    fn fields(
        &self,
        mut variables: Vec<(String, Samples)>,
        association: Association,
        warnings: &mut Vec<String>,
    ) -> Vec<Field> {
        let is_flat = self.dimensions() == 2;
        let mut fields = Vec::new();
        while !variables.is_empty() {
            let names: Vec<&str> = variables.iter().map(|(name, _)| name.as_str()).collect();
            let (stem, parts) = elements::vector_of(&names, is_flat).unwrap_or(("", 1));
            let stem = stem.to_owned();
            let mut own: Vec<(String, Samples)> = variables.drain(..parts).collect();
            let is_one_type = own.iter().all(|(_, s)| {
                s.scalar_type() == own[0].1.scalar_type() && s.len() == own[0].1.len()
            });
            if parts == 1 || !is_one_type {
                let alone = own.drain(..);
                fields.extend(
                    alone.map(|(name, s)| unstructured::field_of(name, (1, association), s)),
                );
                continue;
            }
            let names: Vec<String> = own.iter().map(|(name, _)| name.clone()).collect();
            let rest = if parts == 2 { ", with 0 along z" } else { "" };
            warnings.push(format!("{} are joined to the vectors {stem}{rest}", names.join(", ")));
            let stored = own[0].1.scalar_type();
            let value = |at: usize| own.get(at % 3).map_or(0.0, |(_, samples)| samples.get(at / 3));
            let values = (0..3 * own[0].1.len()).map(value).collect();
            let samples = of_type(stored, values);
            fields.push(unstructured::field_of(stem, (3, association), samples));
        }
        fields
    }

    /// The numbers of the blocks that elements belong to, as VTK calls them.
    fn ids(&self, blocks: &[Block]) -> Option<Field> {
        let told = self.variable("eb_prop1").and_then(|ids| self.numbers(ids, &[]).ok());
        let mut values: Vec<i32> = Vec::new();
        for block in blocks {
            let at = usize::try_from(block.number - 1).ok();
            let told = told.as_ref().zip(at).filter(|(told, at)| *at < told.len());
            #[expect(clippy::cast_possible_truncation, reason = "numbers of blocks have 32 bits")]
            let id = told.map_or(block.number as i32, |(told, at)| told.get(at) as i32);
            values.resize(values.len() + block.elements, id);
        }
        let samples = Samples::Int32(values);
        (!samples.is_empty())
            .then(|| unstructured::field_of("ObjectId", (1, Association::Cell), samples))
    }

    /// What stands behind the names of variables for their time steps, where there are several: times, or numbers from 0
    /// where some are alike, or not told.
    fn told(&self, steps: u64) -> Vec<String> {
        if steps < 2 {
            return Vec::new();
        }
        let times = self.variable("time_whole").and_then(|times| self.numbers(times, &[]).ok());
        let times: Vec<f64> =
            times.map_or(Vec::new(), |times| (0..times.len()).map(|at| times.get(at)).collect());
        let are_apart = times.windows(2).all(|pair| pair[0] < pair[1]);
        match are_apart && times.len() as u64 == steps {
            true => times.iter().map(|time| format!("[time={time}]")).collect(),
            false => (0..steps.min(MOST_FIELDS as u64)).map(|at| format!("[step={at}]")).collect(),
        }
    }
}

/// Makes the faces of a polyhedron go round as seen from outside it: a face that two share goes round one way for both.
fn turn_outwards(faces: &mut [Vec<u32>], points: &[DVec3]) {
    let place = |point: &u32| points[*point as usize];
    let mean = |of: &[u32]| of.iter().map(place).sum::<DVec3>() / of.len().max(1) as f64;
    let middle = mean(&faces.concat());
    for face in faces {
        let centre = mean(face);
        let next = face.iter().cycle().skip(1);
        let sides = face.iter().zip(next);
        let area: DVec3 = sides.map(|(a, b)| (place(a) - centre).cross(place(b) - centre)).sum();
        if area.dot(centre - middle) < 0.0 {
            face.reverse();
        }
    }
}

/// Numbers in the type that the file has them in.
fn of_type(stored: ScalarType, values: Vec<f64>) -> Samples {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "they were of this type in the file; 64-bit numbers of points are below 2^53"
    )]
    match stored {
        ScalarType::UInt8 => Samples::UInt8(values.iter().map(|v| *v as u8).collect()),
        ScalarType::Int8 => Samples::Int8(values.iter().map(|v| *v as i8).collect()),
        ScalarType::UInt16 => Samples::UInt16(values.iter().map(|v| *v as u16).collect()),
        ScalarType::Int16 => Samples::Int16(values.iter().map(|v| *v as i16).collect()),
        ScalarType::UInt32 => Samples::UInt32(values.iter().map(|v| *v as u32).collect()),
        ScalarType::Int32 => Samples::Int32(values.iter().map(|v| *v as i32).collect()),
        ScalarType::UInt64 => Samples::UInt64(values.iter().map(|v| *v as u64).collect()),
        ScalarType::Int64 => Samples::Int64(values.iter().map(|v| *v as i64).collect()),
        ScalarType::Float32 => Samples::Float32(values.iter().map(|v| *v as f32).collect()),
        ScalarType::Float64 => Samples::Float64(values),
    }
}
