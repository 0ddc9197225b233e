//! Wang tiles (Cohen, Shade, Hiller and Deussen 2003): a few squares whose edges have colours, laid such
//! that colours agree, fill a plane of any size without repeating.
//!
//! Each colour of each direction has a sample of the photo, with the edge in its middle. A tile is put
//! together from the samples of its four edges and cut inside, so tiles that meet in a colour show one
//! piece of the photo across the edge.

mod choice;
mod quadrant;
mod set;

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::search::patch::MatchImage;

pub use choice::{Grid, choose, phases};
pub use set::{Edges, TileSet};

use quadrant::Quadrant;

/// A displacement: rows, columns.
pub type Offset = [i64; 2];

/// Where the samples lie: for each colour of an edge, the photo's place of the tile's first pixel if the
/// tile below the edge, or on its right, were the photo's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Samples {
    /// Of upper and lower edges.
    pub horizontal: [Offset; 2],
    /// Of left and right edges.
    pub vertical: [Offset; 2],
}

/// Steps of progress that [`phases`], [`choose`] and [`atlas`] count together.
pub const STEPS: u64 = 2 + QUADRANTS;

/// Quadrants of all colours.
const QUADRANTS: u64 = 16;

/// All tiles of a set, of size `tile` (height, width), as their atlas: the photo's pixel for each of its
/// pixels, row by row.
///
/// # Determinism
/// Integers: the same for any thread count.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
///
/// # Panics
/// If a sample reaches over the picture's edge.
pub fn atlas(
    ctx: &Ctx,
    image: &MatchImage,
    samples: &Samples,
    tile: (usize, usize),
    set: TileSet,
) -> Result<Vec<[u32; 2]>> {
    let quadrants = Quadrant::all(tile);
    // A quadrant knows two of the four edges only.
    let joined = |k: usize| {
        let (piece, _) = quadrants[k / 4].joined(image, samples, (k / 2 % 2, k % 2));
        ctx.step(1).map(|()| piece)
    };
    let pieces: Vec<Vec<[u32; 2]>> =
        (0..QUADRANTS as usize).into_par_iter().map(joined).collect::<Result<_>>()?;
    let (rows, columns) = set.atlas();
    let mut pixels = vec![[0; 2]; rows * tile.0 * columns * tile.1];
    for (i, edges) in set.tiles().into_iter().enumerate() {
        let (top, left) = (i / columns * tile.0, i % columns * tile.1);
        let colors = [
            (edges.north, edges.west),
            (edges.north, edges.east),
            (edges.south, edges.west),
            (edges.south, edges.east),
        ];
        for (k, (quadrant, (horizontal, vertical))) in quadrants.iter().zip(colors).enumerate() {
            let piece = &pieces[4 * k + 2 * usize::from(horizontal) + usize::from(vertical)];
            let ((y, x), (_, w)) = (quadrant.corner(), quadrant.size());
            for (row, of_piece) in piece.chunks_exact(w).enumerate() {
                let at = (top + y + row) * columns * tile.1 + left + x;
                pixels[at..at + w].copy_from_slice(of_piece);
            }
        }
    }
    Ok(pixels)
}
