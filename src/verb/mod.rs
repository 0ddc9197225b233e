//! Room 7: the public functions, one file each. They pick methods, combine them and report.

pub mod inputs;
pub mod lattice;
pub mod params;
pub mod texture_cost;
pub mod tile;
