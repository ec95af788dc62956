//! One table of scenes, modes and projections, in which every way of drawing has rows: each picture is held
//! to the float64 reference, and its bits can be written down and compared with those of another commit
//! (`scripts/compare-bits.sh`).
//!
//! `scenes` makes every scene, `rows` says what is drawn of which, `floors.txt` how near it must be (of a new row
//! the test tells what is measured), with ` by native` behind a name for that engine alone. `VOXSPLAT_TABLE_BITS=FILE`
//! has the bits of every row written to a file; `bits-llvmpipe.txt` is such a one. A device is required;
//! `VOXSPLAT_GPU=allow-skip` prints what is left out instead.

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
