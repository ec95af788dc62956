//! The readers on files written here: round trips in every encoding, damage, and what it says.

mod basis_functions;
mod cells;
mod damage;
mod mesh;
mod messages;
mod others;
mod round_trips;
mod series;
mod special;
mod watching;
mod winds;
mod write;
mod write_dicom;
mod write_legacy;
mod write_netcdf;
mod write_segmentation;
