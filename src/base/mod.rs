//! Room 0: errors, parameters, progress, random numbers, threads. Knows no pixels.

pub mod ctx;
pub mod error;
pub mod memory;
pub mod params;
pub(crate) mod record;
pub mod rng;
