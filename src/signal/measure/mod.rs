//! The statistics that can be made equal everywhere: one file each, as a cost and as a projection.

mod histogram;
mod moments;
mod pearson;
mod steerable;

pub use moments::{ORDERS, Order};
pub use pearson::Pearson;

use std::ops::Range;

use rayon::prelude::*;

use crate::signal::histogram::{Soft, bin_of, rounded};
use crate::signal::localhist::EDGES;
use crate::signal::window::{Domain, Grid, Summed, Window};

/// A statistic of the surroundings of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statistic {
    /// Histograms of each colour.
    Histogram,
    /// Moments of each colour, from the first up to this one.
    Moments(Order),
    /// Histograms of each colour's responses to filters of four orientations.
    Steerable,
}

impl Statistic {
    /// How different the places of a picture are from each other: the mean, over all pairs of
    /// places, of the difference of their statistics; 0 for a picture that is the same everywhere.
    /// `pixels` are colours in any units, on which the cost's units depend:
    /// [`Histogram`](Self::Histogram) and [`Steerable`](Self::Steerable): earth mover's distance,
    /// summed over the channels or responses, in the pixels' units. [`Moments`](Self::Moments): see
    /// there, in their square.
    ///
    /// # Paper
    /// Moritz et al. 2017, eq. 1 with eq. 2, 3 or 4.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn cost(self, pixels: &[[f32; 3]], domain: Domain, window: &Window) -> f64 {
        match self {
            Self::Histogram => histogram::cost(pixels, domain, window),
            Self::Moments(order) => moments::cost(order, pixels, domain, window),
            Self::Steerable => steerable::cost(pixels, domain, window),
        }
    }

    /// Moves the picture by `share` (1: all the way) towards one whose statistic is the same
    /// everywhere, namely that of the whole picture.
    ///
    /// # Paper
    /// Moritz et al. 2017, Sec. 4.3. A grid of cells replaces the paper's overlapping blocks; as
    /// there, each cell's own mapping is computed and the mappings are blended.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn project(self, pixels: &mut [Soft], domain: Domain, window: &Window, share: f32) {
        match self {
            Self::Histogram => histogram::project(pixels, domain, window, share),
            Self::Moments(order) => moments::project(order, pixels, domain, window, share),
            Self::Steerable => steerable::project(pixels, domain, window, share),
        }
    }
}

/// What every soft code becomes in every cell of a grid: values at the edges of the codes' bins.
struct Mapping {
    grid: Grid,
    /// `EDGES` values a cell, in soft codes.
    tables: Vec<f32>,
}

/// What every pixel's code should become: a mapping for each size of window, blended as it says.
struct Wanted<'a> {
    /// Each with its weight at every pixel (`None`: 1).
    mappings: Vec<(Mapping, Option<&'a [f32]>)>,
}

impl<'a> Wanted<'a> {
    /// `mapping` is asked for each size of window.
    fn new(window: &'a Window, mapping: impl Fn(f64) -> Mapping) -> Self {
        let scales = window.scales().iter();
        let mappings = scales.map(|scale| (mapping(scale.sigma), scale.weight.as_deref()));
        Self { mappings: mappings.collect() }
    }

    /// Of the pixels of row `y`, in soft codes; `blended` is room for tables.
    fn row(&self, y: usize, code: impl Fn(usize) -> u16, blended: &mut Vec<f32>, out: &mut [f32]) {
        let place = |x: usize| bin_of(code(x));
        let first = y * out.len();
        out.fill(0.0);
        for (Mapping { grid, tables }, weight) in &self.mappings {
            match weight {
                None => grid.look_up(tables, EDGES, y, place, blended, |x, v| out[x] = v),
                Some(weight) => {
                    let weight = &weight[first..][..out.len()];
                    let add = |x: usize, v: f32| out[x] += weight[x] * v;
                    grid.look_up(tables, EDGES, y, place, blended, add);
                }
            }
        }
    }
}

/// Moves the codes of each of these channels that is not constant by `share` towards what `mapping(codes,
/// sigma)` makes of them.
fn project_channels(
    pixels: &mut [Soft],
    channels: Range<usize>,
    domain: Domain,
    window: &Window,
    share: f32,
    mapping: impl Fn(&(dyn Fn(usize) -> u16 + Sync), f64) -> Mapping + Sync,
) {
    let wanted = |k: usize| {
        let first = pixels[0][k];
        let code = |i: usize| pixels[i][k];
        let varies = pixels.iter().any(|px| px[k] != first);
        varies.then(|| (k, Wanted::new(window, |sigma| mapping(&code, sigma))))
    };
    // Of a small picture a channel alone is too little work to share.
    let wanted: Vec<(usize, Wanted<'_>)> = channels.into_par_iter().filter_map(wanted).collect();
    pixels.par_chunks_mut(domain.width).enumerate().for_each_init(
        || (Vec::new(), vec![0.0; domain.width]),
        |(blended, values), (y, row)| {
            for (k, wanted) in &wanted {
                wanted.row(y, |x| row[x][*k], blended, values);
                for (px, &value) in row.iter_mut().zip(&*values) {
                    let now = px[*k] as f32;
                    px[*k] = rounded(now + share * (value - now));
                }
            }
        },
    );
}

/// Of the middles of a grid's cells, `n` numbers each: `cell(sigma)` gives a grid and the numbers of
/// its cells for each size of window; between the sizes they are blended as the window says.
fn at_places<T: Summed>(
    n: usize,
    domain: Domain,
    window: &Window,
    cells: impl Fn(f64) -> (Grid, Vec<T>),
) -> Vec<T> {
    if let [even] = window.scales() {
        return cells(even.sigma).1;
    }
    // The smallest windows have the finest grid.
    let finest = Grid::new(domain, window.scales()[0].sigma);
    let mut places = vec![T::default(); finest.cells() * n];
    for scale in window.scales() {
        let (grid, values) = cells(scale.sigma);
        for (out, (y, x)) in places.chunks_exact_mut(n).zip(finest.middles()) {
            let weight = scale.weight.as_ref().map_or(1.0, |w| w[y * domain.width + x]);
            if weight > 0.0 {
                for (j, out) in out.iter_mut().enumerate() {
                    *out += T::from(weight) * grid.between(y, x, |cell| values[cell * n + j]);
                }
            }
        }
    }
    places
}

#[cfg(test)]
mod tests;
