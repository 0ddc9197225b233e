//! The lattice of a near-regular picture.

mod decide;
pub mod drift;
mod edges;
mod field;
mod finer;
mod pairs;
mod refine;
pub mod snap;
mod turns;

use std::borrow::Cow;

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::image::mask::Mask;
use crate::signal::autocorrelation::Autocorrelation;
use crate::signal::basis::Basis;
use crate::signal::lowpass::LowPass;
use crate::signal::resample::{resized, resized_mask};
use decide::{Look, decided, is_part};
use edges::Edges;
use field::Field;
use turns::Cells;

/// Square roots of the areas, in pixels, to which the picture is reduced. Large patterns are found
/// where they are small: there grain is averaged away, and a pattern that bends still overlaps with
/// itself. Patterns finer than about 6 pixels of the largest are not seen.
const SIDES: [f64; 3] = [256.0, 512.0, 1024.0];

/// Window of the local normalization, as a share of the shorter side. Larger leaves more of a light
/// gradient, smaller takes away the large patterns themselves.
const WINDOW: f64 = 0.1;

/// Contrast below this share of the picture's is not raised further: it is noise.
const FAINT: f64 = 0.25;

/// A lattice at a finer scale must be this much stronger than one at a coarser to be preferred: the
/// weave of a cloth to its pattern. Unless the coarser is but a part of it, whose vectors were too short there.
const FINER: f64 = 1.35;

/// Strength at which the confidence is a half. Measured: stochastic photographs reach 0.05 (0.07 in
/// one that contains copies of itself), a picture of four lattices 0.10, near-regular photographs
/// begin at 0.15.
const EVEN: f64 = 0.11;

/// Strength at the coarsest scale from which a finer look is worth its time. Measured: those of the
/// finer scales are higher by a quarter at most.
const GLANCE: f64 = 0.08;

/// Least share of the signal in a picture's variance that noise is made up for: below, what repeats could be
/// the file format's blocks.
const FAINTEST: f64 = 0.2;

/// The root of the area to which the picture is reduced for its edges.
const EDGES: f64 = SIDES[1];

/// [`FAINTEST`] of edges: those of noise are everywhere. Measured: drawn wood grain, made up for by more,
/// has a confidence of 0.6.
const EDGES_FAINTEST: f64 = 0.5;

/// Shortest vector of the lattice of the edges, in their pixels: nearer, an edge correlates with itself.
const EDGES_SHORTEST: f64 = 8.0;

/// A candidate lattice and how well the picture repeats by it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Candidate {
    /// The vectors.
    basis: Basis,
    /// What candidates are compared by.
    goodness: f64,
    /// What confidence is made of: the goodness without the preference for small cells.
    strength: f64,
    /// The mean correlation at the lattice's displacements.
    correlation: f64,
}

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The vectors, reduced (see [`reduced`]).
    pub basis: Basis,
    /// How sure it is that the picture has a lattice and this is it, in 0..=1.
    pub confidence: f64,
    /// What candidates were compared by; never negative.
    pub goodness: f64,
    /// The mean autocorrelation at the lattice's displacements, of the colors or of the edges: where it was
    /// found; in -1..=1.
    pub correlation: f64,
}

/// Steps of progress that [`find`] counts.
pub const STEPS: u64 = SIDES.len() as u64 + 2;

/// The best lattice of a picture (`pixels`, `height` x `width`, of which `usable` count), by its colors and
/// by its edges; `None` if there is no candidate at all. Periods shorter than `min_period` pixels do not count. `hurried`, it
/// gives up after the coarsest scale if hardly anything repeats there.
///
/// # Paper
/// See `pairs::goodness` for what is compared. The edges are past the paper: see `decide`.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn find(
    ctx: &Ctx,
    pixels: &[[f32; 3]],
    (height, width): (usize, usize),
    usable: Option<&Mask>,
    min_period: f64,
    hurried: bool,
) -> Result<Option<Found>> {
    let size = (height, width);
    let colors = strongest(
        ctx,
        &Scan { pixels, size, usable, min_period, sides: &SIDES, faintest: FAINTEST, hurried },
    )?;
    let reduced = reduced_size(size, EDGES);
    let scale = [reduced.1 as f64 / width as f64, reduced.0 as f64 / height as f64];
    let least = min_period * (scale[0] * scale[1]).sqrt();
    let weak = colors.as_ref().is_none_or(|look| look.candidate.strength < GLANCE);
    // A fine pattern that is to be left out would be there in the edges all the same.
    if hurried && weak || least > EDGES_SHORTEST {
        return Ok(colors.map(|look| look.found()));
    }
    let edges = Edges::new(pixels, size, usable, reduced)?;
    let looked = strongest(
        ctx,
        &Scan {
            pixels: &edges.pixels,
            size: reduced,
            usable: edges.usable.as_ref(),
            min_period: EDGES_SHORTEST,
            sides: &SIDES[..2],
            faintest: EDGES_FAINTEST,
            hurried: false,
        },
    )?;
    let looked = looked.map(|look| look.within(scale));
    let (Some(colors), Some(looked)) = (&colors, &looked) else {
        return Ok(colors.or(looked).map(|look| look.found()));
    };
    let planes = normalized(pixels, size, usable, reduced);
    let small = usable.map(|mask| resized_mask(mask.usable(), size, reduced));
    Ok(Some(decided(colors, looked, |basis| {
        Cells::new(&planes, reduced, small.as_deref(), scaled(basis, scale))
    })))
}

/// A picture, and how a lattice is looked for in it.
struct Scan<'a> {
    pixels: &'a [[f32; 3]],
    /// Height and width.
    size: (usize, usize),
    usable: Option<&'a Mask>,
    /// Shortest vector, in pixels.
    min_period: f64,
    /// Square roots of the areas to which it is reduced.
    sides: &'static [f64],
    /// See [`FAINTEST`].
    faintest: f64,
    /// Whether to give up after the coarsest scale if hardly anything repeats there.
    hurried: bool,
}

/// The strongest lattice of all scales.
fn strongest(ctx: &Ctx, scan: &Scan) -> Result<Option<Look>> {
    let Scan { pixels, size: (height, width), usable, min_period, sides, faintest, hurried } =
        *scan;
    let mut chosen: Option<Candidate> = None;
    let mut finest = None;
    let mut last = (0, 0);
    for &side in sides {
        let size = reduced_size((height, width), side);
        if size != last {
            last = size;
            let scale = [size.1 as f64 / width as f64, size.0 as f64 / height as f64];
            let planes = normalized(pixels, (height, width), usable, size);
            if planes.is_empty() {
                return Ok(None);
            }
            let gamma = Autocorrelation::new(&planes, size);
            let field = Field::new(&gamma);
            let shortest = min_period * (scale[0] * scale[1]).sqrt();
            let found = pairs::best(&field, shortest)
                .into_iter()
                .map(|candidate| refine::improved(&field, candidate))
                .reduce(|a, b| if b.goodness > a.goodness { b } else { a });
            if let Some(found) = found {
                let mut found = finer::finest(&field, found, shortest);
                found.strength /= signal_share(&gamma).max(faintest);
                found.basis = scaled(found.basis, scale.map(f64::recip));
                if chosen.is_none_or(|coarser| is_preferred(found, coarser)) {
                    chosen = Some(found);
                }
            }
            finest = Some((field, scale));
        }
        ctx.step(1)?;
        if hurried && chosen.is_none_or(|c| c.strength < GLANCE) {
            break;
        }
    }
    Ok(chosen.zip(finest).map(|(candidate, (field, scale))| Look { candidate, field, scale }))
}

/// Whether a lattice that was found at a finer scale is taken instead of one at a coarser.
fn is_preferred(finer: Candidate, coarser: Candidate) -> bool {
    let any = coarser.strength < EVEN || is_part(coarser.basis, finer.basis);
    finer.strength > coarser.strength * if any { 1.0 } else { FINER }
}

/// The share of a picture's variance that is not white noise, in 0..=1: the correlation at no displacement, were it
/// in line with those one and two pixels off. All other correlations of a picture are that much lower than
/// those of what is in it. A line is above the parabola of a smooth picture, so blurred noise, which is not
/// seen, is not made up for either. 1 for less than three pixels a side.
fn signal_share(gamma: &Autocorrelation) -> f64 {
    if gamma.height().min(gamma.width()) < 3 {
        return 1.0;
    }
    let mean = |d: isize| 0.5 * (f64::from(gamma.at(0, d)) + f64::from(gamma.at(d, 0)));
    (2.0 * mean(1) - mean(2)).clamp(0.0, 1.0)
}

/// The picture reduced to `size`, with its local mean taken away and its local contrast made equal:
/// light gradients, stains and shadows would otherwise outweigh what repeats. Pixels that are not
/// usable are 0, the mean. Planes that hold nothing are left out; all, if the picture is constant.
pub fn normalized(
    pixels: &[[f32; 3]],
    from: (usize, usize),
    usable: Option<&Mask>,
    size: (usize, usize),
) -> Vec<Vec<f32>> {
    let small = if from == size { Cow::from(pixels) } else { resized(pixels, from, size).into() };
    let usable = usable.map(|mask| resized_mask(mask.usable(), from, size));
    let ok = |i: usize| usable.as_ref().is_none_or(|u| u[i]);
    let sigma = WINDOW * size.0.min(size.1) as f64;
    let mean = LowPass::new(|i| small[i], size, usable.as_deref(), sigma);
    let mut centered = vec![[0.0f32; 3]; small.len()];
    centered.par_chunks_mut(size.1).enumerate().for_each(|(y, row)| {
        mean.row(y, |x, mean| {
            let i = y * size.1 + x;
            if let Some(mean) = mean
                && ok(i)
            {
                row[x] = std::array::from_fn(|k| (f64::from(small[i][k]) - mean[k]) as f32);
            }
        });
    });
    let power = |px: &[f32; 3]| px.iter().map(|v| v * v).sum::<f32>();
    let count = (0..small.len()).filter(|&i| ok(i)).count().max(1);
    // Row by row: the same sum on any number of threads.
    let row = |row: &[[f32; 3]]| row.iter().map(|px| f64::from(power(px))).sum();
    let rows: Vec<f64> = centered.par_chunks(size.1).map(row).collect();
    let whole = rows.iter().sum::<f64>() / count as f64;
    let floor = FAINT * FAINT * whole;
    let local = LowPass::new(|i| [power(&centered[i]), 0.0, 0.0], size, usable.as_deref(), sigma);
    let mut even = centered;
    let squares = |(y, row): (usize, &mut [[f32; 3]])| {
        let mut squares = [0.0; 3];
        local.row(y, |x, local| {
            let power = local.map_or(0.0, |p| p[0]).max(floor);
            let factor = if power > 0.0 { power.sqrt().recip() } else { 0.0 };
            for (v, sum) in row[x].iter_mut().zip(&mut squares) {
                *v = (f64::from(*v) * factor) as f32;
                *sum += f64::from(*v).powi(2);
            }
        });
        squares
    };
    let rows: Vec<[f64; 3]> = even.par_chunks_mut(size.1).enumerate().map(squares).collect();
    let energies = [0, 1, 2].map(|k| rows.iter().map(|row| row[k]).sum::<f64>());
    let least = 1e-6 * energies.iter().sum::<f64>();
    // Grey pictures have one plane, not two more of rounding.
    let planes: Vec<usize> = (0..3).filter(|&k| energies[k] > least).collect();
    planes.into_par_iter().map(|k| even.iter().map(|px| px[k]).collect()).collect()
}

/// Height and width of the picture reduced to an area of `side` squared; itself if it is smaller.
pub fn reduced_size((height, width): (usize, usize), side: f64) -> (usize, usize) {
    let scale = side / ((height * width) as f64).sqrt();
    if scale >= 1.0 {
        return (height, width);
    }
    let to = |n: usize| ((n as f64 * scale).round() as usize).clamp(1, n);
    (to(height), to(width))
}

fn scaled(basis: Basis, scale: [f64; 2]) -> Basis {
    basis.map(|v| [v[0] * scale[0], v[1] * scale[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;

    const SIZE: (usize, usize) = (180, 200);

    /// Discs on a lattice, of a variance of about 1, with white noise of this variance.
    fn discs(noise: f64) -> Vec<f32> {
        let mut rng = Rng::new(4, 0, 0, 0);
        let mut white = || {
            let sum: f64 = (0..12).map(|_| f64::from(rng.below(1 << 16)) / 65536.0 - 0.5).sum();
            noise.sqrt() * sum
        };
        let disc = |i: usize| {
            let (y, x) = ((i / SIZE.1 % 20) as f64 - 10.0, (i % SIZE.1 % 25) as f64 - 12.0);
            if y.hypot(x) < 8.0 { 1.2 } else { -0.8 }
        };
        (0..SIZE.0 * SIZE.1).map(|i| (disc(i) + white()) as f32).collect()
    }

    #[test]
    fn a_finer_scale_counts_if_it_is_much_stronger_or_has_the_rest_of_the_lattice() {
        let candidate =
            |basis, strength| Candidate { basis, strength, goodness: 0.0, correlation: 0.0 };
        let coarser = candidate([[24.0, 0.0], [0.0, 14.0]], 0.30);
        let weave = [[5.0, 2.0], [-2.0, 4.0]];
        assert!(!is_preferred(candidate(weave, 0.39), coarser));
        assert!(is_preferred(candidate(weave, 0.42), coarser));
        assert!(!is_preferred(candidate(coarser.basis, 0.39), coarser));
        for rest in [[[12.1, 0.0], [0.0, 14.0]], [[12.0, 7.1], [-12.0, 6.9]]] {
            assert!(is_preferred(candidate(rest, 0.31), coarser), "{rest:?}");
            assert!(!is_preferred(candidate(rest, 0.29), coarser), "{rest:?}");
        }
        // Some multiple of a much finer lattice is near any.
        assert!(!is_preferred(candidate([[4.0, 0.0], [0.0, 7.0]], 0.31), coarser));
        assert!(is_preferred(candidate(weave, 0.11), Candidate { strength: 0.10, ..coarser }));
    }

    #[test]
    fn the_share_of_the_signal_is_what_was_put_in() {
        let clean = discs(0.0);
        let n = clean.len() as f64;
        let mean = clean.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
        let variance = clean.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n;
        for noise in [0.0, 0.3, 1.0, 4.0] {
            let share = signal_share(&Autocorrelation::new(&[discs(noise)], SIZE));
            let want = variance / (variance + noise);
            assert!((share - want).abs() < 0.03, "noise {noise}: {share}, not {want}");
        }
        assert_eq!(signal_share(&Autocorrelation::new(&[vec![1.0, 2.0, 5.0, 1.0]], (2, 2))), 1.0);
    }

    #[test]
    fn noise_does_not_hide_a_lattice() {
        let found = |noise: f64| {
            let pixels: Vec<[f32; 3]> = discs(noise).into_iter().map(|v| [v; 3]).collect();
            let ctx = Ctx::new(0, 1).expect("pool");
            find(&ctx, &pixels, SIZE, None, 0.0, false).expect("not cancelled").expect("a guess")
        };
        for noise in [0.0, 2.0, 5.0] {
            let Found { basis: [v1, v2], confidence, .. } = found(noise);
            assert!(confidence > 0.5, "noise {noise}: {confidence}");
            let off = [v1[0], v1[1].abs() - 20.0, v2[0] - 25.0, v2[1]];
            assert!(off.iter().all(|v| v.abs() < 0.5), "noise {noise}: {v1:?} {v2:?}");
        }
    }
}
