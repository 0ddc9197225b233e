//! Which tiles there are, and how they are laid.

use serde::Serialize;

use crate::base::params::choice;
use crate::base::rng::Rng;

/// Stage of the random numbers: those of no other.
const STAGE: u32 = 0x57a9;

choice! {
    /// Which tiles a set holds. Edges have two colours in either direction.
    pub enum TileSet {
        /// All 16.
        Complete = "complete",
        /// The 8 with an even number of edges of the second colour: still two that fit any two edges.
        Minimal = "minimal",
    }
}

/// The colours of a tile's edges, 0 or 1. Tiles fit where they meet in edges of the same colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Edges {
    /// The upper one.
    pub north: u8,
    /// The right one.
    pub east: u8,
    /// The lower one.
    pub south: u8,
    /// The left one.
    pub west: u8,
}

/// The upper and the left edges of the minimal set's atlas: one of the 48 ways in which each of its
/// tiles stands there once.
const MINIMAL: ([[u8; 4]; 2], [[u8; 4]; 2]) =
    ([[0, 0, 0, 1], [0, 1, 1, 1]], [[0, 0, 1, 0], [1, 1, 0, 1]]);

impl TileSet {
    /// Rows and columns of the atlas, in which every tile stands once.
    pub fn atlas(self) -> (usize, usize) {
        match self {
            Self::Complete => (4, 4),
            Self::Minimal => (2, 4),
        }
    }

    /// Every tile in the order of the atlas, row by row. Neighbours in it fit, around its edges too, so
    /// that it can be filtered as a picture (Wei 2004).
    pub fn tiles(self) -> Vec<Edges> {
        let (rows, columns) = self.atlas();
        // In this order, around, every two colours follow each other once.
        let ring = [0, 0, 1, 1];
        let edges = |i: usize, j: usize| match self {
            Self::Complete => (ring[i % 4], ring[j % 4]),
            Self::Minimal => (MINIMAL.0[i % rows][j % columns], MINIMAL.1[i % rows][j % columns]),
        };
        let tile = |i: usize, j: usize| Edges {
            north: edges(i, j).0,
            east: edges(i, j + 1).1,
            south: edges(i + 1, j).0,
            west: edges(i, j).1,
        };
        (0..rows * columns).map(|k| tile(k / columns, k % columns)).collect()
    }

    /// The colours of the tile in row `i` and column `j` of a plane that repeats after `rows` and
    /// `columns` of them: a function of these numbers alone. The edges are random (of the minimal set
    /// the corners, and an edge says whether its two differ), and any edges make a tile of the set.
    pub fn at(self, seed: u64, (i, j): (u32, u32), (rows, columns): (u32, u32)) -> Edges {
        let bit = |pass: u32, i: u32, j: u32| {
            let item = u64::from(i % rows) << 32 | u64::from(j % columns);
            (Rng::new(seed, STAGE, pass, item).next_u32() & 1) as u8
        };
        let (below, right) = (i.wrapping_add(1), j.wrapping_add(1));
        match self {
            Self::Complete => Edges {
                north: bit(0, i, j),
                east: bit(1, i, right),
                south: bit(0, below, j),
                west: bit(1, i, j),
            },
            Self::Minimal => {
                let corners =
                    [bit(0, i, j), bit(0, i, right), bit(0, below, right), bit(0, below, j)];
                let edge = |k: usize| corners[k] ^ corners[(k + 1) % 4];
                Edges { north: edge(0), east: edge(1), south: edge(2), west: edge(3) }
            }
        }
    }

    /// Which tile of the atlas lies where on such a plane, row by row.
    pub fn layout(self, seed: u64, (rows, columns): (usize, usize)) -> Vec<u8> {
        let tiles = self.tiles();
        let at = |k: usize| {
            let place = ((k / columns) as u32, (k % columns) as u32);
            self.at(seed, place, (rows as u32, columns as u32))
        };
        let index = |edges: Edges| tiles.iter().position(|tile| *tile == edges).unwrap_or(0) as u8;
        (0..rows * columns).map(|k| index(at(k))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [TileSet; 2] = [TileSet::Complete, TileSet::Minimal];

    /// Whether neighbours agree, around the edges too.
    fn fits(tiles: &[Edges], (rows, columns): (usize, usize)) -> bool {
        (0..rows * columns).all(|k| {
            let (i, j) = (k / columns, k % columns);
            let right = tiles[i * columns + (j + 1) % columns];
            let below = tiles[(i + 1) % rows * columns + j];
            tiles[k].east == right.west && tiles[k].south == below.north
        })
    }

    #[test]
    fn an_atlas_holds_every_tile_once_and_neighbours_fit() {
        for set in BOTH {
            let tiles = set.tiles();
            assert!(fits(&tiles, set.atlas()), "{set:?}");
            for (k, tile) in tiles.iter().enumerate() {
                assert!(!tiles[..k].contains(tile), "{set:?} holds {tile:?} twice");
                let odd = (tile.north + tile.east + tile.south + tile.west) % 2;
                assert!(set == TileSet::Complete || odd == 0, "{tile:?}");
            }
        }
        assert_eq!(BOTH.map(|set| set.tiles().len()), [16, 8]);
    }

    #[test]
    fn a_plane_fits_everywhere_and_uses_all_tiles_alike() {
        for set in BOTH {
            let tiles = set.tiles();
            let layout = set.layout(5, (40, 50));
            let laid: Vec<Edges> = layout.iter().map(|&k| tiles[usize::from(k)]).collect();
            assert!(fits(&laid, (40, 50)), "{set:?}");
            let expected = 2000 / tiles.len();
            for k in 0..tiles.len() {
                let count = layout.iter().filter(|&&l| usize::from(l) == k).count();
                assert!(count.abs_diff(expected) < expected / 2, "{set:?}: {count} of tile {k}");
            }
            assert_eq!(layout, set.layout(5, (40, 50)));
            assert_ne!(layout, set.layout(6, (40, 50)));
        }
    }

    #[test]
    fn a_tile_is_a_function_of_its_place() {
        for set in BOTH {
            let whole = set.layout(3, (9, 11));
            let at = set.at(3, (4, 7), (u32::MAX, u32::MAX));
            assert_eq!(set.tiles()[usize::from(whole[4 * 11 + 7])], at);
        }
    }
}
