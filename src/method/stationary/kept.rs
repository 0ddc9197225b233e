//! [`Kept`]: output pixels that are given, not synthesized.

use crate::base::error::Result;
use crate::image::rect::Rect;
use crate::image::sourcemap::SourceMap;
use crate::image::symmetry::Symmetry;
use crate::method::stationary::level::Level;
use crate::search::atlas::{Atlas, View};
use crate::search::field::{Field, Pos};
use crate::search::patchmatch::Wrap;
use crate::search::place_cost::{PlaceCost, RANDOM_MOST};
use crate::search::seams::From;
use crate::search::source::Source;
use crate::search::vote::Votes;
use crate::signal::histogram::SOFT_BITS;

/// Cost of a patch that was in a redone rectangle, as a share of a patch's variance. Patches of noise
/// differ by twice the variance: from less the rectangle's old content comes back, as it fits its
/// surroundings best. More changes nothing, any other place is cheaper already.
const FORMER_SHARE: f32 = 4.0;

/// What the places of a redone rectangle cost at random, at most, as a share of a patch's variance:
/// the minimum of a randomly perturbed energy is a sample (Papandreou and Yuille 2011,
/// Perturb-and-MAP). From less most seeds find the same best filling of a small rectangle; more
/// chooses places that fit badly.
const RANDOM_SHARE: f32 = 0.1;

/// Output pixels that are copies of given pixels of the photos.
#[derive(Debug, Clone)]
pub struct Kept {
    /// Where every output pixel comes from if it is kept.
    map: SourceMap,
    part: Part,
}

/// Which output pixels are kept.
#[derive(Debug, Clone)]
enum Part {
    /// Those whose flag is set.
    Flagged(Vec<bool>),
    /// All outside of this; what was inside shall not come back.
    Outside(Rect),
}

impl Kept {
    /// The middle of a photo of size `photo` (height, width), all but a border of `band` pixels on the
    /// axes that wrap; of that, what is `usable` (one flag a photo's pixel; `None`: all).
    ///
    /// # Errors
    /// [`Error::BadPicture`](crate::Error::BadPicture) if the output is empty.
    ///
    /// # Panics
    /// If the output is larger than the photo.
    pub fn middle(
        photo: (usize, usize),
        usable: Option<&[bool]>,
        size: (usize, usize),
        band: usize,
        wrap: Wrap,
    ) -> Result<Self> {
        let corner = ((photo.0 - size.0) / 2, (photo.1 - size.1) / 2);
        Self::cutout(photo, corner, usable, size, band, wrap)
    }

    /// The same of the piece of the photo whose upper left pixel is `corner` (row, column).
    ///
    /// # Errors
    /// As [`Kept::middle`].
    ///
    /// # Panics
    /// If the piece reaches out of the photo.
    pub fn cutout(
        photo: (usize, usize),
        (top, left): (usize, usize),
        usable: Option<&[bool]>,
        size: (usize, usize),
        band: usize,
        wrap: Wrap,
    ) -> Result<Self> {
        let (h, w) = size;
        assert!(top + h <= photo.0 && left + w <= photo.1, "a piece outside of the photo");
        let within = |i: usize, n: usize, wraps: bool| !wraps || (band..n - band).contains(&i);
        let from = |i: usize| [(top + i / w) as u32, (left + i % w) as u32];
        let kept = |i: usize| {
            let [y, x] = from(i).map(|v| v as usize);
            within(i / w, h, wrap.y)
                && within(i % w, w, wrap.x)
                && usable.is_none_or(|usable| usable[y * photo.1 + x])
        };
        let map = SourceMap::new(size, photo, (0..h * w).map(from).collect())?;
        Ok(Self { map, part: Part::Flagged((0..h * w).map(kept).collect()) })
    }

    /// All pixels of a tile but those of a rectangle, which shall differ from what they were. The map
    /// names no photo and no symmetry that the exemplar does not have.
    pub fn outside(map: SourceMap, rect: Rect) -> Self {
        Self { map, part: Part::Outside(rect) }
    }

    /// Whether it is a tile already, so that nothing needs to see to the shares of its photos.
    pub(super) fn is_tile(&self) -> bool {
        matches!(self.part, Part::Outside(_))
    }

    /// What is kept at a level of the pyramid; `coarser` is the one before it.
    pub(super) fn at_level(
        &self,
        level: &Level,
        coarser: Option<(&Level, &KeptLevel)>,
        seed: u64,
    ) -> KeptLevel {
        let (full, size @ (h, w)) = ((self.map.height(), self.map.width()), level.size);
        let source = &level.source;
        let half = source.patch / 2;
        // A rim of a redone rectangle may stay as it was, so that the seam has room. The patches that
        // show more of it than the rim are left to the search.
        let (free, inner) = match &self.part {
            Part::Flagged(_) => (None, None),
            Part::Outside(rect) => {
                (Some(rect.scaled(full, size)), Some(rect.shrunk(half).scaled(full, size)))
            }
        };
        let loose = inner.map(|inner| inner.grown(half, size));
        let mut of_level =
            KeptLevel { width: w, pixels: Vec::new(), held: Vec::new(), costs: None };
        let mut former = Vec::new();
        for i in 0..h * w {
            let (y, x) = (i / w, i % w);
            let at = ((2 * y + 1) * full.0 / (2 * h), (2 * x + 1) * full.1 / (2 * w));
            let fine = at.0 * full.1 + at.1;
            let origin = self.map.origin(fine);
            let photo = usize::from(origin.photo);
            let kept = match &self.part {
                Part::Flagged(flags) => flags[fine],
                Part::Outside(_) => !free.is_some_and(|free| free.contains((y, x), size)),
            };
            if kept {
                let view = view(&source.atlas, photo, origin.symmetry);
                let from = self.from(fine, at, (y, x), size, view);
                of_level.pixels.push((i as u32, from.map(|v| v as u32)));
                let pos = patch_around(from, view, source.patch);
                if source.is_usable(pos) && !loose.is_some_and(|l| l.contains((y, x), size)) {
                    of_level.held.push((i as u32, pos));
                }
            } else if inner.is_some_and(|inner| inner.contains((y, x), size)) {
                // Mirrored or turned it would be the same again.
                let views = source.atlas.views().iter().filter(|view| view.picture == photo);
                former.extend(views.map(|view| {
                    patch_around(self.from(fine, at, (y, x), size, view), view, source.patch)
                }));
            }
        }
        if free.is_some() {
            let field = Field { height: 1, width: former.len(), pos: former };
            let unit = level.patch_variance as f32;
            let former = PlaceCost::of_usage(&field, source, FORMER_SHARE * unit);
            let coarser = coarser.and_then(|(level, kept)| Some((level, kept.costs.as_ref()?)));
            let random = match coarser {
                Some((level, costs)) => costs.random.resized(&level.source, source),
                None => PlaceCost::random(source, seed),
            };
            let all = former.plus(RANDOM_SHARE * unit / RANDOM_MOST as f32, &random);
            of_level.costs = Some(Costs { all, random });
        }
        of_level
    }

    /// Row and column in the atlas, in `view`, of the pixel that output pixel (`y`, `x`) of a level
    /// of this size is, if at full size it is number `fine`, at `at`.
    fn from(
        &self,
        fine: usize,
        at: (usize, usize),
        (y, x): (usize, usize),
        (h, w): (usize, usize),
        view: &View,
    ) -> [usize; 2] {
        let [py, px] = self.map.positions()[fine].map(|v| v as usize);
        let (py, px) = view.symmetry.place((py, px), self.map.source_sizes()[view.picture]);
        // A piece keeps its offset, scaled, so that it stays whole.
        let scaled = |p: usize, at: usize, n: usize, full: usize| {
            let offset = (p as f64 - at as f64) * n as f64 / full as f64;
            offset.round() as isize
        };
        let inside = |i: usize, d: isize, n: usize| i.checked_add_signed(d).unwrap_or(0).min(n - 1);
        [
            view.corner.0 + inside(y, scaled(py, at.0, h, self.map.height()), view.size.0),
            view.corner.1 + inside(x, scaled(px, at.1, w, self.map.width()), view.size.1),
        ]
    }
}

/// What is kept at one level.
#[derive(Debug)]
pub(super) struct KeptLevel {
    width: usize,
    /// Output pixel, and the atlas' pixel that it is.
    pixels: Vec<(u32, From)>,
    /// Output pixel, and the patch that is matched to it.
    held: Vec<(u32, Pos)>,
    /// Of a redone rectangle.
    costs: Option<Costs>,
}

/// What places cost beside the usual.
#[derive(Debug)]
struct Costs {
    /// Those that the rectangle was made of before, and the random ones.
    all: PlaceCost,
    random: PlaceCost,
}

impl KeptLevel {
    /// What places cost beside the usual.
    pub(super) fn cost(&self) -> Option<&PlaceCost> {
        self.costs.as_ref().map(|costs| &costs.all)
    }

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

    /// Matches the patches around kept pixels to their own places, as far as those are usable.
    pub(super) fn hold(&self, field: &mut Field) {
        for &(i, pos) in &self.held {
            field.pos[i as usize] = pos;
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

/// The view of a photo in a symmetry.
fn view(atlas: &Atlas, photo: usize, symmetry: Symmetry) -> &View {
    let is = |view: &&View| view.picture == photo && view.symmetry == symmetry;
    atlas.views().iter().find(is).expect("the caller has looked")
}

/// The patch around a pixel of a view, or the one nearest to it that lies in the view.
fn patch_around([y, x]: [usize; 2], view: &View, patch: usize) -> Pos {
    let corner = |at: usize, from: usize, size: usize| {
        at.saturating_sub(patch / 2).clamp(from, from + size - patch)
    };
    Pos::new(corner(y, view.corner.0, view.size.0), corner(x, view.corner.1, view.size.1))
}
