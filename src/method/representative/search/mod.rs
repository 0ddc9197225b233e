//! What a tile at every position would cost, and the best positions.

mod unlike;

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::base::params::choice;

/// Largest code. A difference squared and summed over three channels is below 2^28, so a sum over all
/// pairs of 2^32 pixels fits 64 bits.
const MOST: f32 = 8191.0;

/// Steps of progress that [`Costs::new`] counts.
pub const STEPS: u64 = 3;

choice! {
    /// How a difference of two colours counts.
    pub enum Similarity {
        /// Squared, as in the paper: the best tile is near the mean of the picture's periods.
        Squared = "squared",
        /// As it is: near the median, which a few things that are elsewhere in no period do not move.
        Absolute = "absolute",
    }
}

impl Similarity {
    /// The difference of two colours, summed over the channels.
    #[inline]
    fn apart(self, a: [i16; 3], b: [i16; 3]) -> u64 {
        let one = |k: usize| {
            let d = u64::from(a[k].abs_diff(b[k]));
            if self == Self::Squared { d * d } else { d }
        };
        (0..3).map(one).sum()
    }

    /// What a difference of one code is worth if a code is worth `step`.
    fn unit(self, step: f64) -> f64 {
        if self == Self::Squared { step * step } else { step }
    }
}

/// The colours of a picture as integers: all sums are exact, whatever their order.
#[derive(Debug, Clone)]
pub struct Codes {
    height: usize,
    width: usize,
    pixels: Vec<[i16; 3]>,
    /// One flag a pixel; `None` is everywhere.
    usable: Option<Vec<bool>>,
    /// What a code is worth.
    step: f64,
}

impl Codes {
    /// Of `pixels`, row by row, any range: one scale for all channels, such that the widest range of
    /// the `usable` pixels fills it. What is not usable has no say.
    ///
    /// # Panics
    /// If the pixels or the flags do not fill the picture.
    pub fn new(
        pixels: &[[f32; 3]],
        (height, width): (usize, usize),
        usable: Option<Vec<bool>>,
    ) -> Self {
        assert_eq!(pixels.len(), height * width, "pixels do not fill the picture");
        assert!(usable.as_ref().is_none_or(|u| u.len() == pixels.len()), "flags do not fill it");
        let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
        for (i, px) in pixels.iter().enumerate() {
            if usable.as_ref().is_none_or(|u| u[i]) {
                for k in 0..3 {
                    (low[k], high[k]) = (low[k].min(px[k]), high[k].max(px[k]));
                }
            }
        }
        let widest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f32::max);
        let scale = if widest > 0.0 { MOST / widest } else { 0.0 };
        let code = |px: &[f32; 3]| {
            std::array::from_fn(|k| ((px[k] - low[k]) * scale).round().clamp(0.0, MOST) as i16)
        };
        let step = f64::from(widest) / f64::from(MOST);
        Self { height, width, pixels: pixels.par_iter().map(code).collect(), usable, step }
    }

    /// The codes, row by row.
    pub fn pixels(&self) -> &[[i16; 3]] {
        &self.pixels
    }

    /// What a code is worth, in the units that the pixels came in.
    pub fn step(&self) -> f64 {
        self.step
    }

    fn is_usable(&self, i: usize) -> bool {
        self.usable.as_ref().is_none_or(|u| u[i])
    }
}

/// A position of the tile, and what it costs there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Row of the tile's first pixel.
    pub y: usize,
    /// Its column.
    pub x: usize,
    /// The mean difference of the pixels that meet where tiles do, squared or absolute: h(T).
    pub continuity: f64,
    /// The mean difference of the picture and the tiling, likewise: `SSDN(I, I_T)` if squared.
    pub resemblance: f64,
    /// alpha h + beta SSDN.
    pub score: f64,
}

/// What a tile costs at every position.
#[derive(Debug, Clone)]
pub struct Costs {
    /// Positions: how many rows and columns of them.
    rows: usize,
    cols: usize,
    tile: (usize, usize),
    /// c(T) of eq. 5, in codes; `NOWHERE` where the tile would hold a pixel that is not usable.
    seams: Vec<u64>,
    /// The differences of the picture and the tiling, summed, in codes.
    unlike: Vec<u64>,
    /// From those sums to means in the units of the pixels.
    per_seam: f64,
    per_unlike: f64,
}

/// The share of the positions, one in so many, that could be chosen at all by either criterion.
const TENTH: usize = 10;

const NOWHERE: u64 = u64::MAX;

impl Costs {
    /// Of tiles of size `tile` (height, width) anywhere in the picture.
    ///
    /// A tile holds one pixel of each residue class modulo its size, wherever it lies, and its tiling
    /// has that pixel at all places of the class. So what a pixel adds to the difference is known
    /// before any tile is, and a tile's difference is the sum over its box.
    ///
    /// # Paper
    /// Sec. 4.1, eq. 5, and sec. 4.2, with p = 1. Pixels that are not usable are not compared.
    ///
    /// # Determinism
    /// Integers: exact.
    ///
    /// # Cost
    /// Linear in the pixels, whatever the size of the tile (absolute: times the logarithm of the number
    /// of periods); about 64 bytes a pixel.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    ///
    /// # Panics
    /// If the tile is empty or larger than the picture.
    pub fn new(
        ctx: &Ctx,
        codes: &Codes,
        tile: (usize, usize),
        similarity: Similarity,
    ) -> Result<Self> {
        let (h, w) = (codes.height, codes.width);
        let (th, tw) = tile;
        assert!((1..=h).contains(&th) && (1..=w).contains(&tw), "a {tw}x{th} tile of {w}x{h}");
        let (rows, cols) = (h - th + 1, w - tw + 1);
        let boxed = |value: &(dyn Fn(usize, usize) -> u64 + Sync)| {
            box_sums(&integral(value, (h, w)), w, (rows, cols), tile)
        };
        let of_pixels = unlike::of_pixels(codes, tile, similarity);
        ctx.step(1)?;
        let unlike = boxed(&|y, x| of_pixels[y * w + x]);
        drop(of_pixels);
        ctx.step(1)?;
        let mut seams = seams(codes, (rows, cols), tile, similarity);
        if let Some(usable) = &codes.usable {
            let holes = boxed(&|y, x| u64::from(!usable[y * w + x]));
            seams.iter_mut().zip(holes).filter(|(_, holes)| *holes > 0).for_each(|(seam, _)| {
                *seam = NOWHERE;
            });
        }
        ctx.step(1)?;
        let count = (0..h * w).filter(|&i| codes.is_usable(i)).count();
        let unit = similarity.unit(codes.step);
        let per_seam = unit / (2 * (tw + th - 1)) as f64;
        let per_unlike = unit / count.max(1) as f64;
        Ok(Self { rows, cols, tile, seams, unlike, per_seam, per_unlike })
    }

    /// How many positions hold no unusable pixel.
    pub fn count(&self) -> usize {
        self.seams.iter().filter(|seam| **seam != NOWHERE).count()
    }

    /// The weight of continuity at which it counts as much as resemblance: what there is to gain in
    /// either, from the best tenth of the positions to the least, is then the same. (From the mean
    /// there is far more to gain in continuity than in resemblance, and a window cut in two would
    /// cost hardly anything.) 1 if there is nothing to gain in continuity.
    pub fn balanced_weight(&self) -> f64 {
        let gain = |values: &[u64]| {
            let usable = values.iter().zip(&self.seams).filter(|(_, seam)| **seam != NOWHERE);
            let mut usable: Vec<u64> = usable.map(|(value, _)| *value).collect();
            let tenth = usable.len() / TENTH;
            if usable.is_empty() {
                return 0.0;
            }
            let (below, &mut edge, _) = usable.select_nth_unstable(tenth);
            (edge - below.iter().copied().min().unwrap_or(edge)) as f64
        };
        let (seam, unlike) =
            (gain(&self.seams) * self.per_seam, gain(&self.unlike) * self.per_unlike);
        if seam > 0.0 { unlike / seam } else { 1.0 }
    }

    /// The best position by `alpha` h + `beta` SSDN, then the best of those left, and so on up to
    /// `count`: no two overlap by more than `overlap` of a tile's area. Of equals the first counts.
    /// Only the share `keep` of the positions is looked at, those with the least h (the paper's p).
    pub fn best(
        &self,
        (alpha, beta): (f64, f64),
        keep: f64,
        overlap: f64,
        count: usize,
    ) -> Vec<Place> {
        let most = self.seam_of_kept(keep);
        let score = |i: usize| {
            let (h, ssdn) = self.means(i);
            alpha * h + beta * ssdn
        };
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < count {
            let best_of_row = |y: usize| {
                let mut best: Option<(f64, usize)> = None;
                for i in y * self.cols..(y + 1) * self.cols {
                    if (self.seams[i], i) > most || self.seams[i] == NOWHERE {
                        continue;
                    }
                    let score = score(i);
                    if best.is_none_or(|(least, _)| score < least)
                        && chosen.iter().all(|&j| i != j && self.shared(i, j) <= overlap)
                    {
                        best = Some((score, i));
                    }
                }
                best
            };
            let best: Vec<_> = (0..self.rows).into_par_iter().map(best_of_row).collect();
            let best = best.into_iter().flatten().reduce(|a, b| if b.0 < a.0 { b } else { a });
            let Some((_, i)) = best else { break };
            chosen.push(i);
        }
        let place = |i: usize| {
            let (continuity, resemblance) = self.means(i);
            let (y, x) = (i / self.cols, i % self.cols);
            Place { y, x, continuity, resemblance, score: score(i) }
        };
        chosen.into_iter().map(place).collect()
    }

    /// h and SSDN of a position.
    fn means(&self, i: usize) -> (f64, f64) {
        (self.seams[i] as f64 * self.per_seam, self.unlike[i] as f64 * self.per_unlike)
    }

    /// The share of a tile's area that tiles at two positions have in common.
    fn shared(&self, i: usize, j: usize) -> f64 {
        let (th, tw) = self.tile;
        let dy = (i / self.cols).abs_diff(j / self.cols).min(th);
        let dx = (i % self.cols).abs_diff(j % self.cols).min(tw);
        ((th - dy) * (tw - dx)) as f64 / (th * tw) as f64
    }

    /// The worst seam, with its position, that the share `keep` of the positions still holds.
    fn seam_of_kept(&self, keep: f64) -> (u64, usize) {
        if keep >= 1.0 {
            return (NOWHERE, usize::MAX);
        }
        let mut all: Vec<(u64, usize)> =
            self.seams.iter().copied().zip(0..).filter(|(seam, _)| *seam != NOWHERE).collect();
        let kept = ((all.len() as f64 * keep).ceil() as usize).clamp(1, all.len().max(1));
        if all.is_empty() {
            return (0, 0);
        }
        *all.select_nth_unstable(kept - 1).1
    }
}

/// Sums over all pixels above and to the left, a row and a column more than the picture. They may run
/// over; differences of them do not, as long as what they stand for fits.
fn integral(value: &(dyn Fn(usize, usize) -> u64 + Sync), (h, w): (usize, usize)) -> Vec<u64> {
    let mut sums = vec![0u64; (h + 1) * (w + 1)];
    sums[w + 1..].par_chunks_mut(w + 1).enumerate().for_each(|(y, row)| {
        let mut sum = 0u64;
        for (x, out) in row[1..].iter_mut().enumerate() {
            sum = sum.wrapping_add(value(y, x));
            *out = sum;
        }
    });
    add_up(&mut sums, w + 1);
    sums
}

/// Adds to every row all those above it.
fn add_up(rows: &mut [u64], width: usize) {
    for y in 1..rows.len() / width {
        let (above, row) = rows.split_at_mut(y * width);
        let above = &above[(y - 1) * width..];
        row.iter_mut().zip(above).for_each(|(v, above)| *v = v.wrapping_add(*above));
    }
}

fn box_sums(
    integral: &[u64],
    w: usize,
    (rows, cols): (usize, usize),
    (th, tw): (usize, usize),
) -> Vec<u64> {
    let mut sums = vec![0u64; rows * cols];
    sums.par_chunks_mut(cols).enumerate().for_each(|(y, out)| {
        let top = &integral[y * (w + 1)..][..=w];
        let bottom = &integral[(y + th) * (w + 1)..][..=w];
        for (x, out) in out.iter_mut().enumerate() {
            let right = bottom[x + tw].wrapping_sub(top[x + tw]);
            *out = right.wrapping_sub(bottom[x].wrapping_sub(top[x]));
        }
    });
    sums
}

/// c(T) of eq. 5 at every position: the first column against the last, the first row against the last.
fn seams(
    codes: &Codes,
    (rows, cols): (usize, usize),
    (th, tw): (usize, usize),
    similarity: Similarity,
) -> Vec<u64> {
    let (h, w) = (codes.height, codes.width);
    let apart = |i: usize, j: usize| similarity.apart(codes.pixels[i], codes.pixels[j]);
    // Sums over the rows above, of the difference between a pixel and the one a tile to its right.
    let mut upright = vec![0u64; (h + 1) * cols];
    upright[cols..].par_chunks_mut(cols).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = apart(y * w + x, y * w + x + tw - 1);
        }
    });
    add_up(&mut upright, cols);
    let mut seams = vec![0u64; rows * cols];
    seams.par_chunks_mut(cols).enumerate().for_each_init(
        || vec![0u64; w + 1],
        |level, (y, out)| {
            for x in 0..w {
                level[x + 1] = level[x] + apart(y * w + x, (y + th - 1) * w + x);
            }
            for (x, out) in out.iter_mut().enumerate() {
                let across = upright[(y + th) * cols + x] - upright[y * cols + x];
                *out = across + (level[x + tw] - level[x]);
            }
        },
    );
    seams
}

#[cfg(test)]
mod tests;
