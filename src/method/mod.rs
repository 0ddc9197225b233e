//! Room 5: the methods, one paper or baseline each.

pub mod flatten;
pub mod make_seamless;
pub mod noise;
pub mod representative;
pub mod rsgf;
pub mod stationary;
pub mod wang;
