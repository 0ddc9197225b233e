//! Which patch agrees best with what surrounds it.

use crate::base::ctx::Simd;
use crate::image::interpolate::{PARTS, nearest as pixel};
use crate::method::rsgf::Matching;
use crate::method::rsgf::places::Offset;
use crate::search::patch::{Kernel, MatchImage, WithKernel, squares, with_kernel};

/// How many of the places are looked at more closely. More finds a little better ones.
pub(super) const CLOSER: usize = 8;

/// The overlaps around a block, row by row, with the codes that its neighbours have there.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    /// Row and column in the window where a run of overlapping pixels begins, and its codes.
    pub(super) runs: Vec<(usize, usize, std::ops::Range<usize>)>,
    pub(super) codes: Vec<u8>,
}

impl Frame {
    /// The frame of a window whose pixels a neighbour reaches over where there is a `code`.
    pub(super) fn new(
        (height, width): (usize, usize),
        mut code: impl FnMut((usize, usize)) -> Option<[u8; 4]>,
    ) -> Self {
        let mut frame = Self { runs: Vec::new(), codes: Vec::new() };
        for y in 0..height {
            let mut open = false;
            for x in 0..width {
                let Some(code) = code((y, x)) else {
                    open = false;
                    continue;
                };
                let at = frame.codes.len();
                frame.codes.extend(code);
                match frame.runs.last_mut() {
                    Some((_, _, run)) if open => run.end = at + 4,
                    _ => frame.runs.push((y, x, at..at + 4)),
                }
                open = true;
            }
        }
        frame
    }

    /// The mean of what the windows at these places show in the frame.
    pub(super) fn mean(&self, source: &MatchImage, places: &[Offset]) -> Self {
        let mut sums = vec![0u32; self.codes.len()];
        for place in places {
            let [top, left] = place.map(|v| pixel(v) as usize);
            for (y, x, run) in &self.runs {
                let there = source.codes_from(source.at(top + y, left + x), run.len());
                for (sum, &code) in sums[run.clone()].iter_mut().zip(there) {
                    *sum += u32::from(code);
                }
            }
        }
        let count = places.len().max(1) as u32;
        let codes = sums.into_iter().map(|sum| ((sum + count / 2) / count) as u8).collect();
        Self { runs: self.runs.clone(), codes }
    }
}

/// The place of the patch whose frame is most like the one wanted: of `places` the best few, each moved by at most `tolerance` rows and columns. Places are the window's top left corner in
/// `source`, compared at the nearest pixel (what is made between pixels is smoother, and noise would agree
/// with it better); moved ones that do not fit are skipped. Of equally good ones the first. `None` without any
/// place.
pub(super) fn nearest(
    how: (Simd, Matching),
    source: &MatchImage,
    frame: &Frame,
    places: &[Offset],
    tolerance: usize,
    fits: impl Fn(Offset) -> bool,
) -> Option<Offset> {
    let all = costs(how, source, frame, places, false);
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|&i| all[i]);
    let t = tolerance as i64;
    let closer = order.iter().take(CLOSER).flat_map(|&i| {
        let [y, x] = places[i];
        let moved =
            (-t..=t).flat_map(move |dy| (-t..=t).map(move |dx| [y + dy * PARTS, x + dx * PARTS]));
        // Itself before those around it: a good one early saves most of the others.
        std::iter::once([y, x]).chain(moved)
    });
    let closer: Vec<Offset> = closer.filter(|&place| fits(place)).collect();
    let costs = costs(how, source, frame, &closer, true);
    (0..closer.len()).min_by_key(|&i| costs[i]).map(|i| closer[i])
}

/// By how much the frames of the patches at `places` differ from the one wanted; with `cut_off`, those
/// that differ by more than one before them may be given too little, but more than that one.
pub(super) fn costs(
    (simd, matching): (Simd, Matching),
    source: &MatchImage,
    frame: &Frame,
    places: &[Offset],
    cut_off: bool,
) -> Vec<u64> {
    let places: &[Offset] = &places.iter().map(|place| place.map(pixel)).collect::<Vec<_>>();
    match matching {
        Matching::Color => with_kernel(simd, 1, Differences { source, frame, places, cut_off }),
        Matching::Correlation => with_kernel(simd, 1, Correlations { source, frame, places }),
    }
}

/// The sum of squared differences of colours at every place (paper eq. 10); with `cut_off`, only those
/// are summed to the end that are less than all before them.
struct Differences<'a> {
    source: &'a MatchImage,
    frame: &'a Frame,
    places: &'a [Offset],
    cut_off: bool,
}

impl WithKernel for Differences<'_> {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) -> Self::Output {
        let mut costs = Vec::with_capacity(self.places.len());
        let mut least = u64::MAX;
        for place in self.places {
            let mut cost = 0;
            for (y, x, run) in &self.frame.runs {
                let wanted = &self.frame.codes[run.clone()];
                let at = self.source.at(place[0] as usize + y, place[1] as usize + x);
                cost += squares(wanted, self.source.codes_from(at, wanted.len())) as u64;
                if self.cut_off && cost >= least {
                    break;
                }
            }
            least = least.min(cost);
            costs.push(cost);
        }
        costs
    }
}

/// One less the normalized cross-correlation at every place, the hole left out (paper eq. 4 and sec.
/// 4.2), in 2^-32; the channels combined as for the lattice, which is by the sum of their covariances.
struct Correlations<'a> {
    source: &'a MatchImage,
    frame: &'a Frame,
    places: &'a [Offset],
}

impl WithKernel for Correlations<'_> {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) -> Self::Output {
        let mut costs = Vec::with_capacity(self.places.len());
        let n = (self.frame.codes.len() / 4) as f64;
        for place in self.places {
            // Per channel: sums of f, g, f^2, g^2 and f g.
            let mut sums = [[0u64; 3]; 5];
            for (y, x, run) in &self.frame.runs {
                let wanted = &self.frame.codes[run.clone()];
                let at = self.source.at(place[0] as usize + y, place[1] as usize + x);
                let there = self.source.codes_from(at, wanted.len());
                let mut of_run = [[0u32; 3]; 5];
                for (f, g) in wanted.chunks_exact(4).zip(there.chunks_exact(4)) {
                    for k in 0..3 {
                        let (f, g) = (u32::from(f[k]), u32::from(g[k]));
                        of_run[0][k] += f;
                        of_run[1][k] += g;
                        of_run[2][k] += f * f;
                        of_run[3][k] += g * g;
                        of_run[4][k] += f * g;
                    }
                }
                for (sum, of_run) in sums.as_flattened_mut().iter_mut().zip(of_run.as_flattened()) {
                    *sum += u64::from(*of_run);
                }
            }
            let (mut covariance, mut deviations) = (0.0, 0.0);
            for k in 0..3 {
                let [f, g, ff, gg, fg] = sums.map(|of| of[k] as f64);
                covariance += n * fg - f * g;
                deviations += (n * ff - f * f).max(0.0).sqrt() * (n * gg - g * g).max(0.0).sqrt();
            }
            let gamma =
                if deviations > 0.0 { (covariance / deviations).clamp(-1.0, 1.0) } else { 0.0 };
            costs.push(((1.0 - gamma) * (1u64 << 32) as f64).round() as u64);
        }
        costs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::rsgf::grid::Lenses;
    use proptest::prelude::*;

    /// A source of noise, and a frame that was copied from it at some place and changed a little.
    fn example(seed: u64) -> (MatchImage, Lenses, Frame) {
        let mut rng = crate::base::rng::Rng::new(seed, 1, 0, 0);
        let mut source = MatchImage::new(48, 52);
        let codes: Vec<[u8; 4]> = (0..48 * 52)
            .map(|_| {
                let [a, b, c] = [rng.below(128), rng.below(128), rng.below(128)];
                [a as u8, b as u8, c as u8, 0]
            })
            .collect();
        source.fill_rows(|y, row| row.copy_from_slice(&codes[y * 52..][..52]));
        let lenses = Lenses { size: (9, 11), border: 3 };
        let frame = Frame::new(lenses.window(), |(y, x)| {
            let [a, b, c, _] = codes[(y + 13) * 52 + x + 17];
            lenses.at((y, x)).map(|_| [a.saturating_sub(3), b.saturating_add(2).min(127), c, 0])
        });
        (source, lenses, frame)
    }

    proptest! {
        #[test]
        fn costs_are_those_of_the_definition(seed in 0..1000u64, y in 0..30i64, x in 0..30i64) {
            let (source, lenses, frame) = example(seed);
            let places = [[y, x], [13, 17]];
            let found = with_kernel(Simd::default(), 1, Differences {
                source: &source, frame: &frame, places: &places, cut_off: false,
            });
            let correlated = with_kernel(Simd::default(), 1, Correlations {
                source: &source, frame: &frame, places: &places,
            });
            let (height, width) = lenses.window();
            for (i, place) in places.iter().enumerate() {
                let (mut sum, mut at) = (0, 0);
                let mut pairs = Vec::new();
                for y in 0..height {
                    for x in 0..width {
                        if lenses.at((y, x)).is_none() {
                            continue;
                        }
                        let there = source.pixel(place[0] as usize + y, place[1] as usize + x);
                        for (k, g) in there.into_iter().enumerate().take(3) {
                            let (f, g) = (f64::from(frame.codes[at + k]), f64::from(g));
                            sum += (f - g).powi(2) as u64;
                            pairs.push((k, f, g));
                        }
                        at += 4;
                    }
                }
                prop_assert_eq!(found[i], sum);
                // Mean and deviation by two passes.
                let (mut covariance, mut deviations) = (0.0, 0.0);
                for k in 0..3 {
                    let own: Vec<_> = pairs.iter().filter(|p| p.0 == k).map(|p| (p.1, p.2)).collect();
                    let n = own.len() as f64;
                    let (mf, mg) = own.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
                    covariance += own.iter().map(|p| (p.0 - mf) * (p.1 - mg)).sum::<f64>();
                    let sf = own.iter().map(|p| (p.0 - mf).powi(2)).sum::<f64>().sqrt();
                    let sg = own.iter().map(|p| (p.1 - mg).powi(2)).sum::<f64>().sqrt();
                    deviations += sf * sg;
                }
                let gamma = 1.0 - correlated[i] as f64 / (1u64 << 32) as f64;
                prop_assert!((gamma - covariance / deviations).abs() < 1e-6, "{}", gamma);
            }
        }
    }

    #[test]
    fn the_copied_place_is_found_within_the_tolerance() {
        let (source, _, frame) = example(7);
        let places = [[2, 3], [15, 15], [30, 30]].map(|place| place.map(|v: i64| v * PARTS));
        let fits = |place: Offset| {
            let [y, x] = place.map(pixel);
            y >= 0 && x >= 0 && y + 15 <= 48 && x + 17 <= 52
        };
        for matching in [Matching::Color, Matching::Correlation] {
            let find = |tolerance| {
                let how = (Simd::default(), matching);
                nearest(how, &source, &frame, &places, tolerance, fits)
                    .map(|place| place.map(pixel))
            };
            assert_eq!(find(2), Some([13, 17]), "{matching:?}");
            assert_ne!(find(1), Some([13, 17]), "{matching:?}: out of reach");
        }
    }
}
