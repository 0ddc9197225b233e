//! Room 7: the public functions, one file each. They pick methods, combine them and report.

mod costs;
pub mod extract;
pub mod inputs;
pub mod lattice;
mod maker;
pub mod noise;
pub mod palette;
pub mod params;
pub mod redo;
pub mod regular;
pub mod texture_cost;
pub mod tile;
