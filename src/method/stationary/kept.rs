//! [`Kept`]: output pixels that are given, not synthesized.

use crate::image::symmetry::Symmetry;
use crate::search::atlas::{Atlas, View};
use crate::search::field::{Field, Pos};
use crate::search::patchmatch::Wrap;
use crate::search::seams::From;
use crate::search::source::Source;
use crate::search::vote::Votes;
use crate::signal::histogram::SOFT_BITS;

/// Output pixels that are copies of given pixels of the first photo.
#[derive(Debug, Clone)]
pub struct Kept {
    /// Height and width of the output.
    size: (usize, usize),
    /// For each output pixel the photo's pixel (row, column) that it is, or `None`.
    from: Vec<Option<[u32; 2]>>,
}

impl Kept {
    /// The middle of a photo of size `photo` (height, width), all but a border of `band` pixels on the
    /// axes that wrap; of that, what is `usable` (one flag a photo's pixel; `None`: all).
    ///
    /// # Panics
    /// If the output is larger than the photo.
    pub fn middle(
        photo: (usize, usize),
        usable: Option<&[bool]>,
        size: (usize, usize),
        band: usize,
        wrap: Wrap,
    ) -> Self {
        let (h, w) = size;
        let (top, left) = ((photo.0 - h) / 2, (photo.1 - w) / 2);
        let within = |i: usize, n: usize, wraps: bool| !wraps || (band..n - band).contains(&i);
        let at = |i: usize| {
            let (y, x) = (i / w, i % w);
            let (py, px) = (top + y, left + x);
            let kept = within(y, h, wrap.y)
                && within(x, w, wrap.x)
                && usable.is_none_or(|usable| usable[py * photo.1 + px]);
            kept.then_some([py as u32, px as u32])
        };
        Self { size, from: (0..h * w).map(at).collect() }
    }

    /// What is kept at a level of the pyramid with an output of `size`.
    pub(super) fn at_level(&self, size: (usize, usize), source: &Source) -> KeptLevel {
        let (full, (h, w)) = (self.size, size);
        let view = photo_as_it_lies(&source.atlas);
        let scale = |p: u32, at: usize, full: usize, n: usize| {
            let offset = (f64::from(p) - at as f64) * n as f64 / full as f64;
            offset.round() as isize
        };
        let pixels = (0..h * w)
            .filter_map(|i| {
                let (y, x) = (i / w, i % w);
                let (fy, fx) = ((2 * y + 1) * full.0 / (2 * h), (2 * x + 1) * full.1 / (2 * w));
                let [py, px] = self.from[fy * full.1 + fx]?;
                let inside =
                    |i: usize, d: isize, n: usize| i.checked_add_signed(d).unwrap_or(0).min(n - 1);
                let y = inside(y, scale(py, fy, full.0, h), view.size.0);
                let x = inside(x, scale(px, fx, full.1, w), view.size.1);
                Some((i as u32, [(view.corner.0 + y) as u32, (view.corner.1 + x) as u32]))
            })
            .collect();
        KeptLevel { width: w, view: *view, pixels }
    }
}

/// What is kept at one level.
#[derive(Debug)]
pub(super) struct KeptLevel {
    width: usize,
    view: View,
    /// Output pixel, and the atlas' pixel that it is.
    pixels: Vec<(u32, From)>,
}

impl KeptLevel {
    /// Puts the kept pixels' own codes in the place of what was voted.
    pub(super) fn restore(&self, votes: &mut Votes, source: &Source, wrap: Wrap) {
        let apron = |wraps: bool| if wraps { 0 } else { source.patch / 2 };
        let (dy, dx) = (apron(wrap.y), apron(wrap.x));
        for &(i, [y, x]) in &self.pixels {
            let (oy, ox) = (i as usize / self.width + dy, i as usize % self.width + dx);
            let codes = source.image.pixel(y as usize, x as usize);
            votes.soft[oy * votes.width + ox] = codes.map(|c| u16::from(c) << SOFT_BITS);
        }
    }

    /// Matches the patches around kept pixels to their own places, as far as those are patches.
    pub(super) fn hold(&self, field: &mut Field, source: &Source) {
        let n = source.patch;
        let corner = |at: u32, from: usize, size: usize| {
            (at as usize).saturating_sub(n / 2).clamp(from, from + size - n)
        };
        let (view, (from_y, from_x)) = (&self.view, self.view.corner);
        for &(i, [y, x]) in &self.pixels {
            let pos = Pos::new(corner(y, from_y, view.size.0), corner(x, from_x, view.size.1));
            if source.is_usable(pos) {
                field.pos[i as usize] = pos;
            }
        }
    }

    /// Sets the kept pixels themselves; returns for every output pixel whether it is one.
    pub(super) fn place(&self, from: &mut [From]) -> Vec<bool> {
        let mut kept = vec![false; from.len()];
        for &(i, place) in &self.pixels {
            from[i as usize] = place;
            kept[i as usize] = true;
        }
        kept
    }
}

/// The view of the first photo that is not mirrored or turned.
fn photo_as_it_lies(atlas: &Atlas) -> &View {
    let lies = |view: &&View| view.picture == 0 && view.symmetry == Symmetry::default();
    atlas.views().iter().find(lies).expect("every atlas has it")
}
