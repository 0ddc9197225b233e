//! Room 4: numbers about one picture.

pub mod stationarity;
pub mod texture;
