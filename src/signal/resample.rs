//! Reduction of pictures by ratios a little above 1, as pyramids with a factor of 1.3 need it.

use rayon::prelude::*;

/// Weights of the source pixels under one target pixel.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

/// Tent filter of the width of one target pixel to either side, cut and renormalized at the ends.
fn tent_taps(from: usize, to: usize) -> Vec<Taps> {
    let ratio = from as f64 / to as f64;
    let reach = ratio.max(1.0);
    (0..to)
        .map(|i| {
            let center = (i as f64 + 0.5) * ratio - 0.5;
            let first = (center - reach).ceil().max(0.0) as usize;
            let last = ((center + reach).floor() as usize).min(from - 1);
            let mut weights: Vec<f64> = (first..=last)
                .map(|j| (1.0 - (j as f64 - center).abs() / reach).max(0.0))
                .collect();
            let sum: f64 = weights.iter().sum();
            for w in &mut weights {
                *w /= sum;
            }
            Taps { first, weights: weights.into_iter().map(|w| w as f32).collect() }
        })
        .collect()
}

/// The picture `(h, w)` reduced (or enlarged) to `(to_h, to_w)` with a tent filter as wide as two
/// target pixels.
///
/// # Determinism
/// Same bytes for any thread count.
pub fn resized(
    pixels: &[[f32; 3]],
    (h, w): (usize, usize),
    (to_h, to_w): (usize, usize),
) -> Vec<[f32; 3]> {
    assert_eq!(pixels.len(), h * w, "pixels do not fill the picture");
    let (rows, cols) = (tent_taps(h, to_h), tent_taps(w, to_w));
    let mut out = vec![[0.0f32; 3]; to_h * to_w];
    out.par_chunks_mut(to_w).zip(&rows).for_each_init(
        || vec![[0.0f32; 3]; w],
        |blended, (out, taps)| {
            blended.fill([0.0; 3]);
            for (j, &weight) in taps.weights.iter().enumerate() {
                let row = &pixels[(taps.first + j) * w..][..w];
                for (sum, px) in blended.as_flattened_mut().iter_mut().zip(row.as_flattened()) {
                    *sum += weight * px;
                }
            }
            for (out, taps) in out.iter_mut().zip(&cols) {
                let mut sum = [0.0; 3];
                for (px, &weight) in blended[taps.first..].iter().zip(&taps.weights) {
                    (0..3).for_each(|k| sum[k] += weight * px[k]);
                }
                *out = sum;
            }
        },
    );
    out
}

/// The mask reduced so that a target pixel is usable only if every pixel under its filter is.
pub fn resized_mask(
    usable: &[bool],
    (h, w): (usize, usize),
    (to_h, to_w): (usize, usize),
) -> Vec<bool> {
    assert_eq!(usable.len(), h * w, "flags do not fill the mask");
    let (rows, cols) = (tent_taps(h, to_h), tent_taps(w, to_w));
    let covered = |y: &Taps, x: &Taps| {
        (y.first..y.first + y.weights.len())
            .all(|y| usable[y * w + x.first..][..x.weights.len()].iter().all(|&ok| ok))
    };
    rows.par_iter().flat_map_iter(|y| cols.iter().map(move |x| covered(y, x))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_stay_and_ramps_stay_ramps() {
        let (h, w) = (20, 39);
        let ramp: Vec<[f32; 3]> =
            (0..h * w).map(|i| [1.0, (i % w) as f32, (i / w) as f32]).collect();
        let (to_h, to_w) = (15, 30);
        let small = resized(&ramp, (h, w), (to_h, to_w));
        for y in 2..to_h - 2 {
            for x in 2..to_w - 2 {
                let [one, u, v] = small[y * to_w + x];
                let at =
                    |i: usize, n: usize, m: usize| (i as f32 + 0.5) * n as f32 / m as f32 - 0.5;
                assert!((one - 1.0).abs() < 1e-6, "constant at {y}, {x}");
                assert!((u - at(x, w, to_w)).abs() < 0.15, "column ramp at {y}, {x}: {u}");
                assert!((v - at(y, h, to_h)).abs() < 0.15, "row ramp at {y}, {x}: {v}");
            }
        }
    }

    #[test]
    fn one_masked_pixel_masks_all_that_it_touches() {
        let mut usable = vec![true; 400];
        usable[10 * 20 + 10] = false;
        let small = resized_mask(&usable, (20, 20), (15, 15));
        // Its pixel is under the filters of 2 rows and 2 columns (support 2.67 source pixels).
        let masked: Vec<_> = (0..225).filter(|&i| !small[i]).map(|i| (i / 15, i % 15)).collect();
        assert!(masked.contains(&(7, 7)), "the target pixel over it: {masked:?}");
        assert!(masked.iter().all(|&(y, x)| y.abs_diff(7) <= 1 && x.abs_diff(7) <= 1));
    }
}
