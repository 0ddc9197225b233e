//! Room 5: the methods, one paper or baseline each.

pub mod make_seamless;
pub mod stationary;
