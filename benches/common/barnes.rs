//! PatchMatch as published, to compare with: Barnes, Shechtman, Finkelstein, Goldman (2009), Sec. 3.
//!
//! Written for this benchmark after the paper, as its authors' own program is not at hand: scan order
//! that alternates, propagation from the two neighbours just visited, random search around the best
//! so far with radii halved from the whole picture to one pixel, distances that stop as soon as
//! they are beaten. Plain Rust, compiled like everything else here.

use texforge::base::rng::Rng;
use texforge::search::patch::MatchImage;

struct Planes {
    width: usize,
    pixels: Vec<[u8; 4]>,
}

impl Planes {
    fn of(image: &MatchImage) -> Self {
        let (height, width) = (image.height(), image.width());
        let pixels = (0..height * width).map(|i| image.pixel(i / width, i % width)).collect();
        Self { width, pixels }
    }

    fn row(&self, y: usize, x: usize, n: usize) -> &[u8] {
        self.pixels[y * self.width + x..][..n].as_flattened()
    }
}

/// Row and column of the patch of `source` matched to each patch of `target`, row by row, after
/// `iterations`.
pub(crate) fn field(
    target: &MatchImage,
    source: &MatchImage,
    n: usize,
    iterations: u32,
    seed: u64,
) -> Vec<(usize, usize)> {
    let (h, w) = (target.height() - n + 1, target.width() - n + 1);
    let (rows, cols) = (source.height() - n + 1, source.width() - n + 1);
    let (target, source) = (Planes::of(target), Planes::of(source));
    let distance = |(y, x): (usize, usize), (sy, sx): (usize, usize), limit: i32| {
        let mut sum = 0;
        for i in 0..n {
            let pairs = target.row(y + i, x, n).iter().zip(source.row(sy + i, sx, n));
            sum += pairs.map(|(&a, &b)| (i32::from(a) - i32::from(b)).pow(2)).sum::<i32>();
            if sum >= limit {
                break;
            }
        }
        sum
    };
    let mut rng = Rng::new(seed, 20, 0, 0);
    let mut below = |n: usize| rng.below(n as u32) as usize;
    let mut best: Vec<((usize, usize), i32)> = (0..h * w)
        .map(|i| {
            let from = (below(rows), below(cols));
            (from, distance((i / w, i % w), from, i32::MAX))
        })
        .collect();
    for iteration in 0..iterations {
        let backward = iteration % 2 == 1;
        for step in 0..h * w {
            let at = if backward { h * w - 1 - step } else { step };
            let (y, x) = (at / w, at % w);
            let (mut from, mut least) = best[at];
            let mut offer = |candidate: (usize, usize), from: &mut (usize, usize)| {
                let d = distance((y, x), candidate, least);
                if d < least {
                    (*from, least) = (candidate, d);
                }
            };
            // The neighbours' matches, moved along.
            if backward {
                if x + 1 < w && best[at + 1].0.1 > 0 {
                    offer((best[at + 1].0.0, best[at + 1].0.1 - 1), &mut from);
                }
                if y + 1 < h && best[at + w].0.0 > 0 {
                    offer((best[at + w].0.0 - 1, best[at + w].0.1), &mut from);
                }
            } else {
                if x > 0 && best[at - 1].0.1 + 1 < cols {
                    offer((best[at - 1].0.0, best[at - 1].0.1 + 1), &mut from);
                }
                if y > 0 && best[at - w].0.0 + 1 < rows {
                    offer((best[at - w].0.0 + 1, best[at - w].0.1), &mut from);
                }
            }
            let mut radius = rows.max(cols);
            while radius >= 1 {
                let (y_low, x_low) = (from.0.saturating_sub(radius), from.1.saturating_sub(radius));
                let y_high = (from.0 + radius).min(rows - 1);
                let x_high = (from.1 + radius).min(cols - 1);
                let candidate =
                    (y_low + below(y_high - y_low + 1), x_low + below(x_high - x_low + 1));
                offer(candidate, &mut from);
                radius /= 2;
            }
            best[at] = (from, least);
        }
    }
    best.into_iter().map(|(from, _)| from).collect()
}
