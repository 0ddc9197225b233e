//! Procedural textures by example (Lagae, Vangorp, Lenaerts and Dutré, "Procedural Textures by Example",
//! 2009): a photo's statistics as a small document, from which noise like it is evaluated anywhere.
//!
//! [`fit`] and [`oriented`] analyse, [`Document`] is what remains, [`Evaluator`] gives values at points, [`raster`]
//! pictures.

mod colour;
pub mod document;
mod edit;
pub mod evaluate;
pub mod fit;
mod morph;
pub mod oriented;
mod points;
mod ranks;
pub mod raster;
pub mod score;
mod shape;
pub mod tiling;

pub use document::{Band, BandShape, Channel, Document, MapSpec, Model, Score};
pub use evaluate::{Evaluator, Filter};
pub use morph::morph;
pub use shape::{KNOTS, Shape};
