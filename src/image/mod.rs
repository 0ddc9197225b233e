//! Room 1: what a picture is, where its pixels come from, and how it is read and written.

pub mod blend;
pub mod color;
pub mod interpolate;
pub mod io;
pub mod mask;
pub mod material;
pub mod normals;
pub mod overlay;
pub mod picture;
pub mod rect;
pub mod sheet;
pub mod sigma_map;
pub mod sourcemap;
pub mod symmetry;
