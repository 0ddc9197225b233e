//! [`Tiles`]: a tiled texture as numbers and pictures for node graphs.
//!
//! A point blends the parts of the input at the three vertices of its triangle. Vertex (i, j) has color
//! (i - j) mod 3, in which all neighbors differ; so a graph computes three colors, not three vertices.
//! What a color looks up changes only where its weight is 0, and no border shows where a host takes
//! smaller copies of pictures for coordinates that jump from pixel to pixel.
//!
//! In a graph, as three numbers, one for each color, with (u, v) in the skewed axes of the cells:
//!
//! 1. i, j = floor u, floor v; f, g = u - i, v - j. The color's vertex is one of the cell's: m = (color -
//!    (i - j)) mod 3 is 0 for the near or the far corner, of which the triangle has one, 1 for (i + 1, j)
//!    and 2 for (i, j + 1).
//! 2. (x, y) is the way from the vertex to the point along the axes, and z = x + y. Its weight is
//!    1 - max(|x|, |y|, |z|).
//! 3. The next color's vertex lies along (1, 0), (0, -1) or (-1, 1) from it; its weight there is
//!    max(0, min(x, z)), max(0, min(-y, -z)) or max(0, min(-x, y)), of which at most one is not 0. So with
//!    the correlations along these three ways, each pair is a dot product.

use super::super::ProgramTiling;
use crate::method::noise::tiling::SIDE;
use crate::method::noise::tiling::table::Table;

/// A tiled texture for node graphs.
#[derive(Debug)]
pub(in crate::export) struct Tiles {
    /// Distance of vertices in a row, and of rows, in pixels.
    pub(in crate::export) cell: [f64; 2],
    /// Power of the weights.
    pub(in crate::export) sharpness: u32,
    /// Height of the photo in rows of vertices: where v is 0.
    pub(in crate::export) top: f64,
    /// The places in the input: the first, and the way to the next.
    pub(in crate::export) first: [f64; 2],
    pub(in crate::export) step: [f64; 2],
    /// Width and height of the input.
    pub(in crate::export) size: [usize; 2],
    /// Pictures of the input, rows from the top, and how many numbers a pixel has.
    pub(in crate::export) inputs: Vec<Vec<u16>>,
    pub(in crate::export) together: usize,
    /// Of each vertex, row by row, its steps along x and y, and nothing.
    pub(in crate::export) choices: Vec<[u8; 3]>,
    /// Of each vertex, how alike the next color is along its three ways: 255 is 1.
    pub(in crate::export) alike: Vec<[u8; 3]>,
}

impl Tiles {
    /// Of a photo that is so many pixels high.
    pub(super) fn new(tiling: &ProgramTiling, height: u32) -> Self {
        let ProgramTiling { layout, places, .. } = tiling;
        let cell = layout.cell.map(f64::from);
        Self {
            cell,
            sharpness: layout.sharpness,
            top: f64::from(height) / cell[1],
            first: places.first.map(f64::from),
            step: places.step.map(f64::from),
            size: layout.input.size.map(|n| n as usize),
            inputs: layout.input.pictures.to_vec(),
            together: layout.input.together(),
            choices: layout.table.choices.iter().map(|&[x, y]| [x, y, 0]).collect(),
            alike: alike(&layout.table),
        }
    }
}

/// The correlations of every vertex with the next color's along (1, 0), (0, -1) and (-1, 1).
fn alike(table: &Table) -> Vec<[u8; 3]> {
    let of = |index: usize| {
        let above = (index + SIDE * (SIDE - 1)) % (SIDE * SIDE);
        let [right, _, below_left] = table.alike[index];
        [right, table.alike[above][1], below_left]
    };
    (0..table.alike.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table's own words: the next in the row, in the row below to the right, and there to the left.
    fn by_its_words(table: &Table, [i, j]: [i64; 2], along: [i64; 2]) -> u8 {
        let around = |v: i64| v.rem_euclid(SIDE as i64) as usize;
        let begins = |[i, j]: [i64; 2]| table.alike[around(j) * SIDE + around(i)];
        let other = [i + along[0], j + along[1]];
        match along {
            [1, 0] => begins([i, j])[0],
            [0, -1] => begins(other)[1],
            [-1, 1] => begins([i, j])[2],
            _ => panic!("{along:?} is no way to the next color"),
        }
    }

    #[test]
    fn ways_lead_to_the_next_color() {
        let mut rng = crate::base::rng::Rng::new(2, 0, 0, 0);
        let bytes: Vec<[u8; 3]> =
            (0..SIDE * SIDE).map(|_| std::array::from_fn(|_| rng.below(256) as u8)).collect();
        let table = Table { choices: vec![[0; 2]; SIDE * SIDE], alike: bytes };
        let color = |[i, j]: [i64; 2]| (i - j).rem_euclid(3);
        for (index, stored) in alike(&table).iter().enumerate() {
            let at = [(index % SIDE) as i64, (index / SIDE) as i64];
            for (k, along) in [[1, 0], [0, -1], [-1, 1]].into_iter().enumerate() {
                let other = [at[0] + along[0], at[1] + along[1]];
                assert_eq!(color(other), (color(at) + 1) % 3, "{along:?}");
                assert_eq!(stored[k], by_its_words(&table, at, along), "{at:?} {along:?}");
            }
        }
    }
}
