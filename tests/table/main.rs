//! One table of scenes, modes and projections, in which every way of drawing has rows: each picture is held
//! to the float64 reference, and its bits can be written down and compared with those of another commit
//! (`scripts/compare-bits.sh`).
//!
//! `scenes` makes every scene, `rows` says what is drawn of which, `floors.txt` how near it must be (of a new row
//! the test tells what is measured), with ` by native` behind a name for that engine alone. `VOXSPLAT_TABLE_BITS=FILE`
//! has the bits of every row by the GPU engine written to a file; `bits-llvmpipe.txt` is such a one. A device is required;
//! with `VOXSPLAT_GPU=allow-skip` the native engine's rows are judged without one, and what is left out is counted and
//! printed. `VOXSPLAT_TABLE_SHARE=I/N` has a process draw one row in N, where an adapter's compiler takes long: then the
//! test of nearness alone is of use, since the others know all rows.

mod bits;
mod cells;
mod coverage;
mod drawing;
mod every_row;
mod judging;
mod plans;
mod points;
mod rows;
mod saved;
mod scenes;
