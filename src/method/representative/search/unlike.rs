//! What a pixel of a tile adds to the difference between the picture and the tiling.

use rayon::prelude::*;

use super::{Codes, Similarity};

/// Of every pixel: the differences of all its class, the usable pixels that lie whole tiles apart, from
/// it. 0 for those that are not usable.
pub(super) fn of_pixels(codes: &Codes, tile: (usize, usize), similarity: Similarity) -> Vec<u64> {
    match similarity {
        Similarity::Squared => squared(codes, tile),
        Similarity::Absolute => absolute(codes, tile),
    }
}

/// The sum of (I(p) - I(q))^2 over a class is S2 - 2 I(q) S1 + n I(q)^2.
fn squared(codes: &Codes, tile @ (th, tw): (usize, usize)) -> Vec<u64> {
    let w = codes.width;
    let classes = classes(codes, tile);
    let cost = |i: usize| {
        let class = &classes[i / w % th * tw + i % w % tw];
        if codes.is_usable(i) { class.cost(codes.pixels[i]) } else { 0 }
    };
    (0..codes.pixels.len()).into_par_iter().map(cost).collect()
}

/// The usable pixels that lie whole tiles apart.
#[derive(Debug, Clone, Copy, Default)]
struct Class {
    n: i64,
    sum: [i64; 3],
    /// Of all channels.
    squares: i64,
}

impl Class {
    /// The squared differences of all its pixels from a colour.
    #[inline]
    fn cost(&self, px: [i16; 3]) -> u64 {
        let px = px.map(i64::from);
        let product: i64 = (0..3).map(|k| px[k] * self.sum[k]).sum();
        let square: i64 = (0..3).map(|k| px[k] * px[k]).sum();
        (self.squares - 2 * product + self.n * square) as u64
    }
}

fn classes(codes: &Codes, (th, tw): (usize, usize)) -> Vec<Class> {
    let (h, w) = (codes.height, codes.width);
    let mut classes = vec![Class::default(); th * tw];
    classes.par_chunks_mut(tw).enumerate().for_each(|(r, classes)| {
        for y in (r..h).step_by(th) {
            for left in (0..w).step_by(tw) {
                let at = y * w + left;
                let pixels = &codes.pixels[at..at + tw.min(w - left)];
                for (k, (class, px)) in classes.iter_mut().zip(pixels).enumerate() {
                    if codes.is_usable(at + k) {
                        class.n += 1;
                        for (sum, &v) in class.sum.iter_mut().zip(px) {
                            let v = i64::from(v);
                            *sum += v;
                            class.squares += v * v;
                        }
                    }
                }
            }
        }
    });
    classes
}

/// The sum of |I(p) - I(q)| over a class, a channel at a time: if in the order of values `below` pixels
/// with the sum S come before q, and q and the `rest` have the sum T, it is
/// (below I(q) - S) + (T - rest I(q)).
fn absolute(codes: &Codes, (th, tw): (usize, usize)) -> Vec<u64> {
    let w = codes.width;
    let mut costs = vec![0u64; codes.pixels.len()];
    // The rows that lie whole tiles apart.
    let mut groups: Vec<Vec<(usize, &mut [u64])>> = (0..th).map(|_| Vec::new()).collect();
    for (y, row) in costs.chunks_mut(w).enumerate() {
        groups[y % th].push((y, row));
    }
    groups.into_par_iter().for_each(|mut rows| {
        let mut class: Vec<(i16, usize, usize)> = Vec::new();
        for left in 0..tw {
            for k in 0..3 {
                class.clear();
                for (row, (y, _)) in rows.iter().enumerate() {
                    let pixels = (left..w).step_by(tw).map(|x| (y * w + x, x));
                    let usable = pixels.filter(|(i, _)| codes.is_usable(*i));
                    class.extend(usable.map(|(i, x)| (codes.pixels[i][k], row, x)));
                }
                class.sort_unstable();
                let mut above: i64 = class.iter().map(|(v, ..)| i64::from(*v)).sum();
                let mut sum = 0;
                for (below, &(v, row, x)) in class.iter().enumerate() {
                    let (v, rest) = (i64::from(v), class.len() - below);
                    let cost = below as i64 * v - sum + above - rest as i64 * v;
                    rows[row].1[x] += cost as u64;
                    (sum, above) = (sum + v, above - v);
                }
            }
        }
    });
    costs
}
