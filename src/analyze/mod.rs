//! Room 4: numbers about one picture.

pub mod appearance;
pub mod lattice;
pub mod nearest;
pub mod period;
pub mod stationarity;
pub mod texture;
