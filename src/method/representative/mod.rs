//! The representative tile of a near-periodic photo: one cell of it that, repeated, is most like all.
//!
//! Representative Tile Extraction from near-periodic textures. The paper tries a fraction of the
//! positions, and builds a tiling for each; here all are tried, in time linear in the pixels.

mod frame;
mod search;

pub use frame::Frame;
pub use search::{Codes, Costs, Place, STEPS, Similarity};
