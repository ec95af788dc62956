//! What the device draws, held to the float64 reference and to exact integers: never to itself.
//!
//! Every tolerance carries what was measured: on llvmpipe (Mesa 22.3.6, LLVM 15, 256 bits), Vulkan,
//! 2026-11-21. A device is required; `VOXSPLAT_GPU=allow-skip` prints what is left out instead.

mod against_reference;
mod cells;
mod engine;
mod field_storage;
mod gathered;
mod gathered_edges;
mod gathered_polygons;
mod gathered_vectors;
mod gouraud;
mod hard_cases;
#[path = "../hard_scenes/mod.rs"]
mod hard_scenes;
mod inside;
mod invariants;
mod judging;
mod jumps;
mod layered_truth;
mod long_lists;
mod long_rays;
mod no_data;
mod nodes;
mod octrees;
mod order;
mod polygon_edges;
mod polygons;
mod preview_fields;
mod previews;
mod reconstructed;
mod regions;
mod scattered;
mod shaded_samples;
mod shading;
mod small_kernels;
mod sort;
mod specks;
mod stills;
mod support;
mod transfer_moves;
mod two_vectors;
mod vectors;
mod vectors_on_the_way;
