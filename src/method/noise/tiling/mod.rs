//! Tiling and blending (Heitz and Neyret, "High-Performance By-Example Noise using a Histogram-Preserving
//! Blending Operator", 2018): a texture whose parts are parts of the photo.
//!
//! The photo's independent channels are stored as standard normal numbers ([`Input`]). A triangular lattice
//! lies over the plane; each vertex shows a part of them, and a point blends those of its three vertices
//! so that their sum is a standard normal number again, which is then given the photo's histogram. Past the
//! paper, parts are chosen so that they go on into each other ([`Table`]), the blend knows how alike they
//! are, and it is sharper ([`blend`]).

mod blend;
pub mod fit;
pub mod input;
mod lattice;
pub mod table;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::method::noise::score::blurred;
use input::{Input, Pyramid};
use lattice::{Lattice, Triangle};
use table::{Places, Plane, Search, Table};

/// How a texture is tiled and blended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// Distance of vertices in a row, which is even, and of rows, in pixels of the photo. The vertices of
    /// a row lie half the former to the right of those of the row above it.
    pub cell: [u32; 2],
    /// Power of the vertices' weights, 1 to 16: with 1 tiles blend all over a triangle.
    pub sharpness: u32,
    /// What lies at each of as many rows of vertices as columns, row by row; then they repeat.
    pub table: Table,
    /// The photo.
    pub input: Input,
}

/// The greatest sharpness.
pub const SHARPEST: u32 = 16;

/// Rows and columns of vertices before they repeat, a power of two.
pub const SIDE: usize = 32;

impl Layout {
    /// Where in the input vertices may lie; `None` if it is too small for the cells.
    pub fn places(&self) -> Option<Places> {
        Places::new(self.input.size, self.cell)
    }

    /// How often the input is halved: up to where a cell is some pixels, and as often as its sides allow.
    pub fn halvings(&self) -> u32 {
        let [width, height] = self.input.size.map(u32::trailing_zeros);
        halvings(self.cell).min(width).min(height)
    }

    /// What is wrong with it for so many independent channels.
    pub(super) fn fault(&self, channels: usize) -> Option<String> {
        let [a, b] = self.cell;
        if !(1..=SHARPEST).contains(&self.sharpness) {
            return Some(format!("its sharpness is {}, not 1 to {SHARPEST}", self.sharpness));
        }
        if a < 2 || a % 2 != 0 || b == 0 {
            return Some(format!(
                "its cells are {a}x{b}, not an even number of columns and some rows"
            ));
        }
        let [width, height] = self.input.size;
        let Some(places) = self.places() else {
            return Some(format!(
                "its cells of {a}x{b} are too large for an input of {width}x{height}"
            ));
        };
        if self.table.choices.len() != SIDE * SIDE {
            let len = self.table.choices.len();
            return Some(format!("its table has {len} vertices, not {SIDE} x {SIDE}"));
        }
        if self.table.choices.iter().any(|c| (0..2).any(|k| u32::from(c[k]) >= places.count[k])) {
            return Some("its table shows what lies outside the input".into());
        }
        if !self.input.is_of(channels) {
            return Some(format!("its input is not of {channels} independent channels"));
        }
        None
    }

    /// Chooses the table for a seed, given the standard deviations of the channels.
    pub(super) fn choose(&mut self, ctx: &Ctx, deviations: &[f64], seed: u32) -> Result<()> {
        let pyramid = Pyramid::new(&self.input, deviations.len(), self.halvings().min(SCREENED));
        let lattice = Lattice::endless(self.cell, SIDE);
        if let Some(places) = self.places() {
            self.table = choose(ctx, &pyramid, &lattice, places, self.sharpness, deviations, seed)?;
        }
        Ok(())
    }
}

/// Steps of progress that a fit takes.
pub fn steps() -> u64 {
    table::steps(&Lattice::endless([2, 2], SIDE))
}

/// Coarsest level of the input in which most choices are compared.
const SCREENED: u32 = 2;

/// How often an input can be halved until a cell is some pixels.
fn halvings(cell: [u32; 2]) -> u32 {
    (cell[1] / 4).max(1).ilog2()
}

/// Chooses which part of the input lies at every vertex.
fn choose(
    ctx: &Ctx,
    pyramid: &Pyramid,
    lattice: &Lattice,
    places: Places,
    sharpness: u32,
    deviations: &[f64],
    seed: u32,
) -> Result<Table> {
    let level = pyramid.telling(deviations).min(SCREENED);
    // Each channel as strong as it is in the texture.
    let (coarse_shape, coarse) = pyramid.planes(level, deviations);
    let (shape, exact) = pyramid.planes(0, deviations);
    // What lies within a pixel or two of where it should need not be told apart.
    let smooth: Vec<Vec<f32>> = exact.iter().map(|plane| blurred(plane, shape, 1)).collect();
    let search = Search {
        lattice,
        places,
        sharpness,
        coarse: Plane::new(level, coarse_shape, &coarse),
        smooth: Plane::new(0, shape, &smooth),
        exact: Plane::new(0, shape, &exact),
        seed,
    };
    table::choose(ctx, &search)
}

/// What a triangle's corners show.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tiles {
    /// From a point to its place in the input.
    ways: [[f64; 2]; 3],
    /// Correlations of corners 0 and 1, 0 and 2, 1 and 2.
    alike: [f32; 3],
}

/// A layout made ready to give values at points.
#[derive(Debug, Clone)]
pub(super) struct Tiling {
    lattice: Lattice,
    cell: [u32; 2],
    sharpness: u32,
    places: Places,
    table: Table,
    pyramid: Arc<Pyramid>,
}

impl Tiling {
    /// Of a valid layout.
    pub(super) fn new(layout: &Layout, channels: usize) -> Option<Self> {
        Some(Self {
            lattice: Lattice::endless(layout.cell, SIDE),
            cell: layout.cell,
            sharpness: layout.sharpness,
            places: layout.places()?,
            table: layout.table.clone(),
            pyramid: Arc::new(Pyramid::new(&layout.input, channels, layout.halvings())),
        })
    }

    /// The same that goes round after `period` pixels of the photo.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub(super) fn periodic(
        &self,
        ctx: &Ctx,
        period: [f64; 2],
        deviations: &[f64],
        seed: u32,
    ) -> Result<Self> {
        let lattice = Lattice::fitting(self.cell, period);
        let (pyramid, places) = (&self.pyramid, self.places);
        let table = choose(ctx, pyramid, &lattice, places, self.sharpness, deviations, seed)?;
        Ok(Self { lattice, table, ..self.clone() })
    }

    /// Number of tiles that [`Tiling::periodic`] chooses.
    pub(super) fn count(&self, period: [f64; 2]) -> usize {
        Lattice::fitting(self.cell, period).len()
    }

    /// Steps of progress that [`Tiling::periodic`] takes.
    pub(super) fn steps(&self, period: [f64; 2]) -> u64 {
        table::steps(&Lattice::fitting(self.cell, period))
    }

    /// Sets `out` to the channels' standard normal numbers at a point, between the levels of the input
    /// that `level` says. `known` is the triangle of the point before, which often is this one's, too.
    #[inline]
    pub(super) fn at(
        &self,
        point: [f64; 2],
        level: f32,
        known: &mut Option<(Triangle, Tiles)>,
        out: &mut [f32],
    ) {
        let (triangle, weights) = self.lattice.triangle(point);
        let tiles = match known {
            Some((of, tiles)) if *of == triangle => tiles,
            _ => &known.insert((triangle, self.tiles(triangle))).1,
        };
        out.fill(0.0);
        let shares = blend::shares(weights, tiles.alike, self.sharpness);
        for (way, share) in tiles.ways.iter().zip(shares) {
            if share != 0.0 {
                let at = std::array::from_fn(|k| point[k] + way[k]);
                self.pyramid.add(at, level, share, out);
            }
        }
    }

    /// What a triangle's corners show.
    fn tiles(&self, triangle: Triangle) -> Tiles {
        let corners = self.lattice.corners(triangle);
        let way = |corner: usize| {
            let place = self.places.at(self.table.choices[corners.index[corner]]);
            std::array::from_fn(|k| place[k] - corners.at[corner][k])
        };
        let alike = |k: usize| f32::from(self.table.alike[corners.begins[k]][k]) * (1.0 / 255.0);
        Tiles { ways: [0, 1, 2].map(way), alike: [0, 1, 2].map(alike) }
    }

    /// Standard deviation of every channel in every level of the input.
    pub(super) fn deviations(&self) -> &[Vec<f64>] {
        self.pyramid.deviations()
    }

    /// What of the input is kept for samples `footprint` apart.
    pub(super) fn kept(&self, footprint: f64) -> Kept {
        let octaves = if footprint > 1.0 { libm::log2(footprint) } else { 0.0 };
        let coarsest = f64::from(self.pyramid.coarsest());
        let level = octaves.min(coarsest);
        let deviations = self.pyramid.deviations();
        let below = level as usize;
        let above = (below + 1).min(deviations.len() - 1);
        let t = (1.0 + coarsest - octaves).clamp(0.0, 1.0);
        let fade = t * t * (3.0 - 2.0 * t);
        let between = |(a, b): (&f64, &f64)| a + (level - below as f64) * (b - a);
        let deviations = deviations[below].iter().zip(&deviations[above]).map(between).collect();
        Kept { level: level as f32, fade, deviations }
    }
}

/// What of the input is kept for samples some way apart.
pub(super) struct Kept {
    /// The level to take it from, between two.
    pub(super) level: f32,
    /// Factor of it: beyond the coarsest level all fades.
    pub(super) fade: f64,
    /// Standard deviation of every channel in that level.
    pub(super) deviations: Vec<f64>,
}
