//! Host and shaders agree: every stitched shader is valid WebGPU, and every struct and constant
//! that crosses stands in both with the same bytes.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs;
use std::mem::offset_of;
use std::path::Path;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Expression, Literal, Module, ShaderStage, Type, TypeInner};
use voxsplat::cells::CellField;
use voxsplat::gpu::layout::{self, COUNT_HEADER_WORDS, RECORD_WORDS, SEGMENT_THREADS};
use voxsplat::gpu::shader::{self, Shader};
use voxsplat::hierarchy::EMPTY_BRICK;
use voxsplat::kernel::COEFFICIENTS;
use voxsplat::plan::SEGMENT;
use voxsplat::rbf::LIT;
use voxsplat::vector::{FORESHORTENINGS, MARK_SIDE, PHASES};
use voxsplat::volume::BRICK;

/// A host struct: its name, its size in bytes, and its members with their offsets.
struct HostStruct {
    name: &'static str,
    size: usize,
    members: Vec<(&'static str, usize)>,
}

/// Lists a struct of `gpu::layout`; a member left out here does not compile.
macro_rules! host_struct {
    ($name:ident { $($member:ident),* $(,)? }) => {{
        let layout::$name { $($member: _),* } = bytemuck::Zeroable::zeroed();
        HostStruct {
            name: stringify!($name),
            size: size_of::<layout::$name>(),
            members: vec![$((stringify!($member), offset_of!(layout::$name, $member))),*],
        }
    }};
}

fn host_structs() -> [HostStruct; 15] {
    [
        host_struct!(Frame {
            view_x,
            view_y,
            view_z,
            view_centre,
            lattice_centre,
            footprint,
            half_size,
            radius,
            extinction_scale,
            footprint_scale,
            padding0,
            padding1,
            padding2,
        }),
        host_struct!(Traversal { dims, bricks, axes, splits, counts, table }),
        host_struct!(Gather {
            base,
            right,
            up,
            ahead,
            reach,
            scale,
            layers,
            centre,
            view_a,
            view_b,
            view_c,
            view_centre,
            low,
            high,
            splits,
            strides,
            bricks,
            piece,
        }),
        host_struct!(Vectors {
            axis_x,
            axis_y,
            axis_z,
            depth,
            picture,
            flags,
            layers,
            second_x,
            second_y,
            second_z,
            second_origin,
            second_flags,
            field_slabs,
            blur,
        }),
        host_struct!(VectorTiles { tiles, more, rays, clip }),
        host_struct!(Polygons { right, up, forward, picture, material, towards, colours, counts }),
        host_struct!(PolygonCorner { place, normal }),
        host_struct!(Scan { counts }),
        host_struct!(Lists { tiles, counts, layers, slabs }),
        host_struct!(Sort { counts }),
        host_struct!(BrickPiece { first, bricks, nodes, scale }),
        host_struct!(Brick {
            appearance,
            emission,
            count,
            weight,
            m2,
            effective,
            error,
            showing,
            slices,
        }),
        host_struct!(Present { background }),
        host_struct!(Slabs {
            base,
            right,
            up,
            along,
            picture,
            dims,
            end,
            stored,
            bricks,
            table,
            below,
            beyond,
            tiles,
            more,
            tops,
            clip,
            slices,
            levels,
            opacities,
        }),
        host_struct!(Shade {
            world_x,
            world_y,
            world_z,
            right,
            up,
            forward,
            material,
            towards,
            colours,
            places,
            tables,
            region_places,
            region_looks,
            region_shapes,
        }),
    ]
}

/// Constants that shaders and host both name, and the host's value.
fn host_constants() -> [(&'static str, f64); 26] {
    [
        ("BRICK", BRICK as f64),
        ("MARK_SIDE", MARK_SIDE as f64),
        ("PHASES", PHASES as f64),
        ("FORESHORTENINGS", FORESHORTENINGS as f64),
        ("RECORD_WORDS", RECORD_WORDS as f64),
        ("COUNT_HEADER_WORDS", COUNT_HEADER_WORDS as f64),
        ("SEGMENT_THREADS", f64::from(SEGMENT_THREADS)),
        ("TILE", f64::from(layout::TILE)),
        ("EMPTY_BRICK", EMPTY_BRICK as f64),
        ("LEAST_HALF_AXIS", layout::LEAST_HALF_AXIS),
        ("POINT_TIE", layout::POINT_TIE),
        ("LAYERS", f64::from(layout::LAYERS)),
        ("LOOK_EVERY", f64::from(layout::LOOK_EVERY)),
        ("CUT_HEAD", f64::from(layout::CUT_HEAD)),
        ("SEGMENT", f64::from(SEGMENT)),
        ("LIFT_CELLS", layout::LIFT_CELLS),
        ("LEVEL_SLACK", CellField::LEVEL_SLACK),
        ("LIT_COVERAGE", LIT),
        ("SHADE_CELLS", f64::from(layout::SHADE_CELLS)),
        ("LAYER_SLABS", f64::from(layout::LAYER_SLABS)),
        ("GROUP_TILES", f64::from(layout::GROUP_TILES)),
        ("LIST_THREADS", f64::from(layout::LIST_THREADS)),
        ("SORT_THREADS", f64::from(layout::SORT_THREADS)),
        ("DIGIT_BITS", f64::from(layout::DIGIT_BITS)),
        ("DIGITS", f64::from(layout::DIGITS)),
        ("FRAGMENT_WORDS", f64::from(layout::FRAGMENT_WORDS)),
    ]
}

/// Parses and validates with the capabilities of WebGPU's defaults.
fn validated(source: &str) -> Result<(Module, ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
    let info = validator.validate(&module).map_err(|e| e.emit_to_string(source))?;
    Ok((module, info))
}

fn parsed(shader: &Shader) -> Module {
    let parsed = naga::front::wgsl::parse_str(&shader.source());
    parsed.unwrap_or_else(|error| panic!("{}: {error}", shader.name))
}

fn named<'a>(module: &'a Module, name: &str) -> Option<&'a Type> {
    module.types.iter().map(|(_, ty)| ty).find(|ty| ty.name.as_deref() == Some(name))
}

/// How the module's struct of the host's name differs; `None` where it has no such struct.
fn differences(module: &Module, host: &HostStruct) -> Option<Vec<String>> {
    let TypeInner::Struct { members, span } = &named(module, host.name)?.inner else { return None };
    let mut found = Vec::new();
    let name = host.name;
    if *span as usize != host.size {
        found.push(format!("{name}: {span} bytes in the shader, {} on the host", host.size));
    }
    if members.len() != host.members.len() {
        let (shader, host) = (members.len(), host.members.len());
        found.push(format!("{name}: {shader} members in the shader, {host} on the host"));
    }
    for (member, (host_member, host_offset)) in members.iter().zip(&host.members) {
        let (member, offset) = (member.name.as_deref().unwrap_or_default(), member.offset);
        if member != *host_member || offset as usize != *host_offset {
            found.push(format!(
                "{name}: {member} at {offset} in the shader, {host_member} at {host_offset} on \
                 the host"
            ));
        }
    }
    Some(found)
}

/// The value of a module's constant.
fn constant(module: &Module, name: &str) -> Option<f64> {
    let (_, constant) = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name))?;
    match module.global_expressions[constant.init] {
        Expression::Literal(Literal::U32(value)) => Some(f64::from(value)),
        Expression::Literal(Literal::I32(value)) => Some(f64::from(value)),
        Expression::Literal(Literal::F32(value)) => Some(f64::from(value)),
        _ => None,
    }
}

/// Fails with all of `found` at once.
fn assert_none(found: &[String]) {
    assert!(found.is_empty(), "{} differences:\n{}", found.len(), found.join("\n"));
}

#[test]
fn every_shader_is_valid_with_the_defaults_of_webgpu() {
    let failures: Vec<String> = shader::ALL
        .iter()
        .filter_map(|s| validated(&s.source()).err().map(|error| format!("{}: {error}", s.name)))
        .collect();
    assert_none(&failures);
}

#[test]
fn the_splat_pass_is_valid_in_every_variant() {
    let (module, info) = validated(&shader::SPLAT.source()).unwrap();
    let names: Vec<&str> = module.overrides.iter().filter_map(|(_, o)| o.name.as_deref()).collect();
    let flags = ["one_footprint", "perspective", "rim_root", "published"];
    // The others are the footprint's coefficients.
    let coefficients = (0..COEFFICIENTS).map(|power| format!("c{power}"));
    let expected: BTreeSet<String> =
        flags.map(str::to_owned).into_iter().chain(coefficients).collect();
    assert_eq!(names.iter().map(|&name| name.to_owned()).collect::<BTreeSet<_>>(), expected);
    let mut failures = Vec::new();
    for variant in 0..16_u32 {
        let constants = (0..4).map(|bit| f64::from(variant >> bit & 1));
        let constants = flags.iter().map(|&f| f.to_owned()).zip(constants).collect();
        let processed =
            naga::back::pipeline_constants::process_overrides(&module, &info, None, &constants);
        if let Err(error) = processed {
            failures.push(format!("{constants:?}: {error}"));
        }
    }
    assert_none(&failures);
}

#[test]
fn the_passes_over_lists_are_valid_in_every_variant() {
    let flags = ["perspective", "rim_root", "slabs", "front_to_back", "published"];
    let mut failures = Vec::new();
    for shader in [shader::COUNT_ENTRIES, shader::WRITE_ENTRIES, shader::COMPOSITE_LISTS] {
        let (module, info) = validated(&shader.source()).unwrap();
        for variant in 0..3 * 32_u32 {
            let mut constants: naga::back::PipelineConstants = (0_u32..)
                .zip(flags)
                .map(|(bit, flag)| (flag.to_owned(), f64::from(variant >> bit & 1)))
                .collect();
            constants.insert("shape".to_owned(), f64::from(variant / 32));
            if shader == shader::WRITE_ENTRIES {
                // What was projected is there already.
                constants.remove("perspective");
                constants.remove("rim_root");
            }
            let processed =
                naga::back::pipeline_constants::process_overrides(&module, &info, None, &constants);
            if let Err(error) = processed {
                failures.push(format!("{} {constants:?}: {error}", shader.name));
            }
        }
    }
    assert_none(&failures);
}

#[test]
fn every_shader_file_is_part_of_some_pass() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let (mut files, mut unused) = (0, Vec::new());
    for folder in [root.clone(), root.join("lib")] {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "wgsl") {
                files += 1;
                let text = fs::read_to_string(&path).unwrap();
                if !shader::ALL.iter().any(|shader| shader.has_piece(&text)) {
                    unused.push(path.display().to_string());
                }
            }
        }
    }
    let passes: HashSet<&str> = shader::ALL.iter().map(|s| s.name).collect();
    assert!(files > passes.len(), "{files} files for {} passes", passes.len());
    assert_none(&unused);
}

#[test]
fn entry_points_bear_the_name_of_their_pass_or_of_their_stage() {
    for shader in &shader::ALL {
        let module = parsed(shader);
        let names = |stage: ShaderStage| -> Vec<&str> {
            let entries = module.entry_points.iter().filter(|e| e.stage == stage);
            entries.map(|e| e.name.as_str()).collect()
        };
        let compute = names(ShaderStage::Compute);
        if !compute.is_empty() {
            assert_eq!((compute, module.entry_points.len()), (vec![shader.name], 1));
            continue;
        }
        let (vertex, fragment) = (names(ShaderStage::Vertex), names(ShaderStage::Fragment));
        if vertex == ["vertex"] {
            assert!(!fragment.is_empty(), "{}", shader.name);
            continue;
        }
        // Each vertex stage has its fragment stage: `vertex_box`, `fragment_box`.
        let variants = |names: &[&str], word: &str| -> Vec<Option<String>> {
            names.iter().map(|name| name.strip_prefix(word).map(str::to_owned)).collect()
        };
        let vertex = variants(&vertex, "vertex_");
        assert!(!vertex.is_empty() && vertex.iter().all(Option::is_some), "{}", shader.name);
        assert_eq!(vertex, variants(&fragment, "fragment_"), "{}", shader.name);
    }
}

/// What a shader is bound to by each number, all in one group; or what is wrong with it.
fn bindings(module: &Module) -> Result<BTreeMap<u32, String>, String> {
    let mut found = BTreeMap::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(bound) = &variable.binding else { continue };
        let name = variable.name.clone().unwrap_or_default();
        if bound.group != 0 {
            return Err(format!("{name} is in group {}", bound.group));
        }
        if let Some(other) = found.insert(bound.binding, name.clone()) {
            return Err(format!("{name} and {other} are both {}", bound.binding));
        }
    }
    Ok(found)
}

#[test]
fn every_binding_of_a_shader_has_a_number_of_its_own_in_one_group() {
    for shader in &shader::ALL {
        let found = bindings(&parsed(shader));
        assert!(found.is_ok(), "{} ({}): {found:?}", shader.name, shader.options);
    }
    let broken = |source: &str| bindings(&naga::front::wgsl::parse_str(source).expect("it parses"));
    let storage = |group: u32, binding: u32, name: &str| {
        format!("@group({group}) @binding({binding}) var<storage, read> {name}: array<u32>;")
    };
    assert!(broken(&(storage(0, 1, "a") + &storage(0, 2, "b"))).is_ok());
    assert!(broken(&(storage(0, 1, "a") + &storage(0, 1, "b"))).is_err());
    assert!(broken(&(storage(0, 1, "a") + &storage(1, 2, "b"))).is_err());
}

#[test]
fn there_are_at_most_forty_shaders_each_by_a_name_of_its_own() {
    let names: BTreeSet<_> = shader::ALL.iter().map(|s| (s.name, s.options)).collect();
    assert!(names.len() == shader::ALL.len() && names.len() <= 40, "{names:?}");
}

#[test]
fn host_structs_have_the_layout_of_the_shaders() {
    let modules = shader::ALL.map(|s| parsed(&s));
    let mut found = Vec::new();
    for host in host_structs() {
        let mut seen = 0;
        for (shader, module) in shader::ALL.iter().zip(&modules) {
            if let Some(differences) = differences(module, &host) {
                seen += 1;
                found.extend(differences.iter().map(|d| format!("{}: {d}", shader.name)));
            }
        }
        if seen == 0 {
            found.push(format!("{}: in no shader", host.name));
        }
    }
    assert_none(&found);
}

#[test]
fn every_uniform_is_a_listed_host_struct() {
    let listed = host_structs().map(|host| host.name);
    for shader in &shader::ALL {
        let module = parsed(shader);
        for (_, variable) in module.global_variables.iter() {
            if variable.space == AddressSpace::Uniform {
                let ty = &module.types[variable.ty];
                if !matches!(ty.inner, TypeInner::Struct { .. }) {
                    // A single vector has no members that could change places.
                    continue;
                }
                let name = ty.name.as_deref().unwrap_or("unnamed");
                assert!(listed.contains(&name), "{}: {name} is not compared", shader.name);
            }
        }
    }
}

#[test]
fn records_are_read_as_they_are_written() {
    let host = host_struct!(Record { centre, extinction, packed });
    let module = parsed(&shader::SPLAT);
    let Some(TypeInner::Struct { members, .. }) = named(&module, "Record").map(|ty| &ty.inner)
    else {
        panic!("splat has no struct Record");
    };
    // A vertex buffer is packed: each attribute begins where the one before ends.
    let mut offset = 0;
    for ((location, member), (name, host_offset)) in (0_u32..).zip(members).zip(&host.members) {
        let bound = matches!(member.binding, Some(naga::Binding::Location { location: l, .. })
            if l == location);
        assert!(bound, "{name} is not at location {location}");
        assert_eq!((member.name.as_deref(), offset), (Some(*name), *host_offset));
        offset += module.types[member.ty].inner.size(module.to_ctx()) as usize;
    }
    assert_eq!((members.len(), offset), (host.members.len(), host.size));
    assert_eq!(host.size, RECORD_WORDS * 4);
}

#[test]
fn shared_constants_are_equal() {
    let modules = shader::ALL.map(|s| parsed(&s));
    let mut found = Vec::new();
    for (name, host) in host_constants() {
        let values = shader::ALL.iter().zip(&modules);
        let values: Vec<(&str, f64)> =
            values.filter_map(|(s, m)| constant(m, name).map(|v| (s.name, v))).collect();
        if values.is_empty() {
            found.push(format!("{name}: in no shader"));
        }
        for (shader, value) in values {
            if value != host {
                found.push(format!("{name}: {value} in {shader}, {host} on the host"));
            }
        }
    }
    assert_none(&found);
}

#[test]
fn workgroups_have_the_size_that_the_host_dispatches() {
    for shader in [shader::COUNT_SEGMENTS, shader::EMIT_KERNELS] {
        let module = parsed(&shader);
        assert_eq!(module.entry_points[0].workgroup_size, [SEGMENT_THREADS, 1, 1]);
    }
    let along_rays = ["gather_kernels", "gather_cells", "reconstruct_slabs", "composite_vectors"];
    for shader in shader::ALL.iter().filter(|shader| along_rays.contains(&shader.name)) {
        assert_eq!(parsed(shader).entry_points[0].workgroup_size, [layout::TILE, layout::TILE, 1]);
    }
    for shader in
        [shader::COUNT_ENTRIES, shader::COUNT_VECTORS, shader::WRITE_ENTRIES, shader::FIND_RANGES]
    {
        let module = parsed(&shader);
        assert_eq!(module.entry_points[0].workgroup_size, [layout::LIST_THREADS, 1, 1]);
    }
    for shader in [shader::PLACE_POLYGONS, shader::SORT_POLYGONS] {
        let module = parsed(&shader);
        assert_eq!(module.entry_points[0].workgroup_size, [layout::POLYGON_THREADS, 1, 1]);
    }
    for shader in [shader::COUNT_DIGITS, shader::SCATTER_DIGITS] {
        let module = parsed(&shader);
        assert_eq!(module.entry_points[0].workgroup_size, [layout::SORT_THREADS, 1, 1]);
    }
    // A thread a node of level 1.
    let edge = BRICK as u32 / 2;
    assert_eq!(parsed(&shader::MERGE_BRICKS).entry_points[0].workgroup_size, [edge; 3]);
    let module = parsed(&shader::COMPOSITE_LISTS);
    let size = module.entry_points[0].workgroup_size;
    assert_eq!([size[0], size[2]], [layout::TILE, layout::GROUP_TILES]);
    assert_eq!(size[0] * size[1], layout::LIST_TILE_THREADS);
    // A workgroup a block of counts, within WebGPU's limit; a run of them a thread.
    for shader in [shader::SUM_COUNTS, shader::SCAN_COUNTS] {
        let module = parsed(&shader);
        let [x, y, z] = module.entry_points[0].workgroup_size;
        assert!(x <= 256 && y == 1 && z == 1, "{x} × {y} × {z}");
        assert_eq!(constant(&module, "BLOCK"), Some(f64::from(layout::SCAN_BLOCK)));
        let run = constant(&module, "RUN").expect("a constant");
        assert_eq!(run * f64::from(x), f64::from(layout::SCAN_BLOCK));
    }
}

#[test]
fn no_data_lies_below_every_sample_on_both_sides() {
    let threshold = constant(&parsed(&shader::COUNT_SEGMENTS), "NO_DATA").unwrap();
    let (no_data, least) = (f64::from(layout::NO_DATA), -f64::from(layout::MOST_SAMPLE));
    assert!(no_data < threshold && threshold < least, "{no_data} {threshold} {least}");
    // A shader need not round a constant the way the host does.
    let margin = 1e-4 * least.abs();
    assert!(threshold - no_data > margin && least - threshold > margin);
}

mod must_fail {
    use super::*;

    const PRESENT_MOVED: &str = "struct Present { shift: f32, background: vec4<f32> }
        @group(0) @binding(0) var<uniform> settings: Present;";

    fn found(source: &str, host: &HostStruct) -> Vec<String> {
        let module = naga::front::wgsl::parse_str(source).expect("it parses");
        differences(&module, host).expect("it has the struct")
    }

    #[test]
    fn a_moved_member_is_caught() {
        let [.., host, _, _] = host_structs();
        assert_eq!(found("struct Present { background: vec4<f32> }", &host), [""; 0]);
        let moved = found(PRESENT_MOVED, &host).join("\n");
        assert!(moved.contains("32 bytes in the shader, 16 on the host"), "{moved}");
        assert!(moved.contains("2 members in the shader, 1 on the host"), "{moved}");
        assert!(moved.contains("shift at 0 in the shader, background at 0"), "{moved}");
    }

    #[test]
    fn two_members_that_changed_places_are_caught() {
        let [_, host, ..] = host_structs();
        let swapped = "struct Traversal { dims: vec4<u32>, bricks: vec4<u32>, splits: vec4<u32>,
            axes: vec4<u32>, counts: vec4<u32>, table: vec4<f32> }";
        assert_eq!(found(swapped, &host).len(), 2);
    }

    #[test]
    fn another_constant_and_a_missing_one_are_caught() {
        let source = "const BRICK: u32 = 4u;";
        let module = naga::front::wgsl::parse_str(source).unwrap();
        assert_eq!(constant(&module, "BRICK"), Some(4.0));
        assert_ne!(constant(&module, "BRICK"), Some(BRICK as f64));
        assert_eq!(constant(&module, "RECORD_WORDS"), None);
    }

    #[test]
    fn shaders_that_do_not_parse_or_ask_for_more_than_the_defaults_are_caught() {
        assert!(validated("fn f() { let x = ; }").is_err());
        assert!(validated("fn f() -> u32 { return 1.5; }").is_err());
        assert!(validated("var<private> x: f64;").is_err());
    }
}
