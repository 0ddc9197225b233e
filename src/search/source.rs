//! [`Source`]: a picture whose patches may be copied, with what the search needs to know of each.

use rayon::prelude::*;

use crate::search::atlas::Atlas;
use crate::search::field::Pos;
use crate::search::patch::MatchImage;

/// Picture to copy from, in the matching space, and which of its patches may be used.
#[derive(Debug)]
pub struct Source {
    /// The codes.
    pub image: MatchImage,
    /// Patch side.
    pub patch: usize,
    /// The pictures in it.
    pub atlas: Atlas,
    /// What is usable, if not all positions are.
    usable: Option<Usable>,
}

#[derive(Debug)]
struct Usable {
    /// For every patch position (top left corner), row by row, `rows() * cols()`.
    flags: Vec<bool>,
    list: Vec<Pos>,
}

impl Source {
    /// A source; `mask` has one flag a pixel, and a patch is usable if all its pixels are.
    /// Returns `None` if no patch is usable.
    pub fn new(image: MatchImage, patch: usize, mask: Option<&[bool]>) -> Option<Self> {
        let atlas = Atlas::plain(image.height(), image.width());
        Self::of_atlas(image, patch, mask, atlas)
    }

    /// As [`Source::new`], of the image of an atlas, whose `mask` keeps its views apart.
    pub fn of_atlas(
        image: MatchImage,
        patch: usize,
        mask: Option<&[bool]>,
        atlas: Atlas,
    ) -> Option<Self> {
        let (h, w) = (image.height(), image.width());
        if h < patch || w < patch {
            return None;
        }
        let Some(mask) = mask.filter(|m| m.iter().any(|&ok| !ok)) else {
            return Some(Self { image, patch, atlas, usable: None });
        };
        let bad = box_sums(h, w, patch, |y, row| {
            for (sum, &ok) in row.iter_mut().zip(&mask[y * w..(y + 1) * w]) {
                *sum = i32::from(!ok);
            }
        });
        let cols = w - patch + 1;
        let flags: Vec<bool> = bad.iter().map(|&bad| bad == 0).collect();
        let some = flags.iter().enumerate().filter(|(_, ok)| **ok);
        let list: Vec<Pos> = some.map(|(at, _)| Pos::new(at / cols, at % cols)).collect();
        let usable = Some(Usable { flags, list }).filter(|u| !u.list.is_empty())?;
        Some(Self { image, patch, atlas, usable: Some(usable) })
    }

    /// Number of patch positions vertically.
    pub fn rows(&self) -> usize {
        self.image.height() - self.patch + 1
    }

    /// Number of patch positions horizontally.
    pub fn cols(&self) -> usize {
        self.image.width() - self.patch + 1
    }

    /// Number of usable patch positions.
    pub fn n_usable(&self) -> usize {
        self.usable.as_ref().map_or(self.rows() * self.cols(), |u| u.list.len())
    }

    /// Whether the patch at `pos` may be used.
    #[inline]
    pub fn is_usable(&self, pos: Pos) -> bool {
        self.usable.as_ref().is_none_or(|u| u.flags[pos.y() * self.cols() + pos.x()])
    }

    /// Pixel index of the top left corner of the patch at `pos`.
    #[inline]
    pub fn at(&self, pos: Pos) -> usize {
        self.image.at(pos.y(), pos.x())
    }

    /// A usable position, uniform in the random number.
    pub fn random(&self, rng: &mut crate::base::rng::Rng) -> Pos {
        match &self.usable {
            Some(Usable { list, .. }) => list[rng.below(list.len() as u32) as usize],
            None => Pos::new(
                rng.below(self.rows() as u32) as usize,
                rng.below(self.cols() as u32) as usize,
            ),
        }
    }
}

/// Sum over the `n` x `n` box at each position of the values that `fill` writes row by row.
fn box_sums(h: usize, w: usize, n: usize, fill: impl Fn(usize, &mut [i32]) + Sync) -> Vec<i32> {
    // Rows that share running sums: long bands, so that the sums restart rarely.
    const BAND: usize = 64;
    let (rows, cols) = (h - n + 1, w - n + 1);
    let mut horizontal = vec![0i32; h * cols];
    horizontal.par_chunks_mut(cols).enumerate().for_each_init(
        || vec![0i32; w],
        |values, (y, out)| {
            fill(y, values);
            let mut sum: i32 = values[..n - 1].iter().sum();
            for x in 0..cols {
                sum += values[x + n - 1];
                out[x] = sum;
                sum -= values[x];
            }
        },
    );
    let mut out = vec![0i32; rows * cols];
    out.par_chunks_mut(BAND * cols).enumerate().for_each(|(band, out)| {
        let y0 = band * BAND;
        let mut sum = vec![0i32; cols];
        for row in horizontal[y0 * cols..(y0 + n - 1) * cols].chunks_exact(cols) {
            sum.iter_mut().zip(row).for_each(|(s, v)| *s += v);
        }
        for (i, out) in out.chunks_exact_mut(cols).enumerate() {
            let y = y0 + i;
            let enter = &horizontal[(y + n - 1) * cols..(y + n) * cols];
            let leave = &horizontal[y * cols..(y + 1) * cols];
            sum.iter_mut().zip(enter).for_each(|(s, v)| *s += v);
            out.copy_from_slice(&sum);
            sum.iter_mut().zip(leave).for_each(|(s, v)| *s -= v);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_sums_are_the_sums_of_boxes() {
        let (h, w, n) = (140, 9, 4);
        let value = |y: usize, x: usize| ((y * 31 + x * 17) % 23) as i32;
        let sums = box_sums(h, w, n, |y, row| {
            row.iter_mut().enumerate().for_each(|(x, v)| *v = value(y, x));
        });
        for y in 0..=h - n {
            for x in 0..=w - n {
                let direct: i32 = (0..n * n).map(|i| value(y + i / n, x + i % n)).sum();
                assert_eq!(sums[y * (w - n + 1) + x], direct, "at {y}, {x}");
            }
        }
    }

    #[test]
    fn a_patch_with_one_masked_pixel_is_unusable() {
        let mut mask = vec![true; 64];
        mask[3 * 8 + 3] = false;
        let source = Source::new(MatchImage::new(8, 8), 3, Some(&mask)).expect("some are usable");
        for y in 0..6 {
            for x in 0..6 {
                let covers = (y..y + 3).contains(&3) && (x..x + 3).contains(&3);
                assert_eq!(source.is_usable(Pos::new(y, x)), !covers, "at {y}, {x}");
            }
        }
        assert!(Source::new(MatchImage::new(8, 8), 3, Some(&[false; 64])).is_none());
    }
}
