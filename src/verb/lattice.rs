//! [`detect_lattice`]: by which displacements a near-regular photo repeats.

use crate::analyze::lattice::snap::{self, MOST_SCALING, Rows, Snap};
use crate::analyze::lattice::{self, reduced_size};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::params;
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::overlay;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::signal::autocorrelation::Autocorrelation;
use crate::signal::basis::{Basis, area};

/// Shortest side of a photo that can be looked at: two periods of a few pixels.
const SMALLEST: usize = 16;

/// Root of the area, in pixels, to which a photo is reduced for the map that is handed out.
const MAP_SIDE: f64 = 512.0;

params! {
    /// Parameters of [`detect_lattice`].
    pub struct LatticeParams for "lattice" {
        /// From which confidence on a lattice counts as found.
        min_confidence: f32 = 0.5, in 0.0..=1.0;
        /// Shortest period that counts: set it above the weave of a cloth to find the pattern printed on it.
        min_period: f32 = 0.0, in 0.0..=65536.0, unit "px";
    }
}

/// The lattice of a photo: the photo is nearly the same when it is moved by a `v1` + b `v2` for any
/// whole a and b.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// The shortest displacement, in pixels of the photo: to the right, downwards.
    pub v1: [f64; 2],
    /// The shortest that is no multiple of `v1`. Both point from 70 degrees above the right to 110
    /// degrees below it; so they are the reduced basis, unique but for equally short vectors.
    pub v2: [f64; 2],
    /// How sure it is that the photo has a lattice and this is it, in 0..=1. Low for photos without
    /// one, with several, with few or strongly bent repeats.
    pub confidence: f64,
    /// Whether `confidence` reaches what was asked for. Else the vectors are but the best guess.
    pub found: bool,
    /// The goodness by which candidates were compared, never negative.
    pub goodness: f64,
    /// The mean autocorrelation at the lattice's displacements, of the colors or of the edges: where the lattice
    /// was found; in -1..=1.
    pub correlation: f64,
}

impl Lattice {
    fn basis(&self) -> Basis {
        [self.v1, self.v2]
    }

    /// Area of a cell, in square pixels.
    pub fn cell_area(&self) -> f64 {
        area(self.basis())
    }

    /// The size nearest to `width` x `height` after which the lattice repeats on both axes, and how
    /// little the photo must be scaled for it; `None` if there is none within half and twice that
    /// size. See [`Snap`].
    pub fn snap(&self, width: usize, height: usize) -> Option<Snap> {
        snap::snap(self.basis(), (width, height), MOST_SCALING, 0.0)
    }

    /// The same for what can be laid a little askew: pieces that are fitted to each other, which share
    /// out a lean of the lattice as they do the scaling, of at most `most`. A lean is seen sooner.
    pub(super) fn snap_pieces(&self, width: usize, height: usize, most: f64) -> Option<Snap> {
        snap::snap(self.basis(), (width, height), most, MOST_SCALING)
    }

    /// Rows of the lattice that a tile of this size leads over whole numbers of, where it repeats.
    pub(super) fn rows(&self, width: usize, height: usize, repeats: [bool; 2]) -> Vec<Rows> {
        snap::rows(self.basis(), (width, height), repeats)
    }

    /// The lattice drawn over a picture as large as the photo: bright lines with dark rims, through
    /// its middle. The result is 8-bit sRGB without alpha (data is shown as if it were sRGB).
    ///
    /// # Errors
    /// None that a valid picture can cause.
    pub fn overlay(&self, picture: &Picture) -> Result<Picture> {
        overlay::lattice(picture, self.basis())
    }
}

/// Finds the lattice of a near-regular photo.
///
/// Any sample type and number of channels; pixels that are not wholly opaque do not count. Light
/// gradients, stains and scratches are evened out before. Without a lattice (stochastic pictures,
/// several lattices, strong distortion) the confidence is low and `found` false: that is no error.
/// Patterns of fewer than about 2 x 2 repeats, or finer than about 6 pixels once the photo is reduced
/// to a megapixel, are not found.
///
/// # Paper
/// Near-Regular Texture Synthesis by Random Sampling and Gap Filling (2011), sec. 3. Past it: see
/// ARCHITECTURE.md.
///
/// # Determinism
/// Same bytes for any thread count; no random choices.
///
/// # Errors
/// [`Error::Parameter`], [`Error::TooSmall`] below 16 pixels, [`Error::BadPicture`] if all usable
/// pixels are alike, [`Error::NotFinite`], [`Error::Memory`], [`Error::Cancelled`].
pub fn detect_lattice(ctx: &Ctx, photo: &Picture, params: &LatticeParams) -> Result<Lattice> {
    params.validate()?;
    ctx.begin(lattice::STEPS);
    detect(ctx, photo, None, params, false)
}

/// The same with default parameters, quick where hardly anything repeats: there the guess is that of
/// the coarsest scale.
pub(super) fn glanced(ctx: &Ctx, photo: &Picture) -> Result<Lattice> {
    detect(ctx, photo, None, &LatticeParams::default(), true)
}

/// The same for a verb that counts its own progress; `usable` says where the photo may be looked at.
/// `hurried`, it is quick where hardly anything repeats.
pub(super) fn detect(
    ctx: &Ctx,
    photo: &Picture,
    usable: Option<&Mask>,
    params: &LatticeParams,
    hurried: bool,
) -> Result<Lattice> {
    let (pixels, mask) = ctx.install(|| prepared(photo, usable))?;
    let size = (photo.height(), photo.width());
    let least = f64::from(params.min_period);
    let found = ctx.install(|| lattice::find(ctx, &pixels, size, mask.as_ref(), least, hurried))?;
    let confidence = found.map_or(0.0, |f| f.confidence);
    // Without any candidate the guess is that nothing repeats.
    let nothing = [[size.1 as f64, 0.0], [0.0, size.0 as f64]];
    let [v1, v2] = found.map_or(nothing, |f| f.basis);
    Ok(Lattice {
        v1,
        v2,
        confidence,
        found: found.is_some() && confidence >= f64::from(params.min_confidence),
        goodness: found.map_or(0.0, |f| f.goodness),
        correlation: found.map_or(0.0, |f| f.correlation),
    })
}

/// What [`detect_lattice`] looks at, to be seen: the generalized normalized autocorrelation of the
/// photo with its light evened out, reduced to at most 512 x 512 pixels' area.
///
/// 2 h - 1 rows of 2 w - 1 single floats in -1..=1 (data, one channel), that of no displacement in the
/// middle, where h x w is the size of the reduced photo. Also how many of its pixels are one of
/// the photo, to the right and downwards.
///
/// # Determinism
/// As [`detect_lattice`].
///
/// # Errors
/// As [`detect_lattice`].
pub fn lattice_autocorrelation(ctx: &Ctx, photo: &Picture) -> Result<(Picture, [f64; 2])> {
    let (pixels, mask) = ctx.install(|| prepared(photo, None))?;
    let size = (photo.height(), photo.width());
    let small = reduced_size(size, MAP_SIDE);
    let gamma = ctx.install(|| {
        let planes = lattice::normalized(&pixels, size, mask.as_ref(), small);
        if planes.is_empty() {
            return Err(constant());
        }
        Ok(Autocorrelation::new(&planes, small))
    })?;
    let (rows, cols) = (2 * small.0 - 1, 2 * small.1 - 1);
    let samples = Samples::F32(gamma.values());
    let picture = Picture::new(rows, cols, 1, samples, Encoding::Data)?;
    Ok((picture, [small.1 as f64 / size.1 as f64, small.0 as f64 / size.0 as f64]))
}

fn constant() -> Error {
    Error::BadPicture {
        what: "the photo".into(),
        reason: "all its usable pixels are alike, so there is nothing that could repeat".into(),
    }
}

/// The photo's colours and what of it counts, checked.
fn prepared(photo: &Picture, usable: Option<&Mask>) -> Result<(Vec<[f32; 3]>, Option<Mask>)> {
    let (width, height) = (photo.width(), photo.height());
    if width.min(height) < SMALLEST {
        let (what, remedy) = ("the photo".into(), "take a larger piece of it".into());
        return Err(Error::TooSmall { what, width, height, need: SMALLEST, remedy });
    }
    photo.ensure_finite("the photo")?;
    // Colours and their mask; planes, spectra and maps of the reduced photo.
    let pixels = (width * height) as u64;
    ensure_available("the lattice", Some(16 * pixels + 600 * pixels.min(1 << 20)))?;
    let colors = ColorModel::new(photo).matching_pixels(photo);
    let mask = usable.cloned().or_else(|| Mask::from_alpha(photo));
    let mut usable = (0..colors.len()).filter(|&i| mask.as_ref().is_none_or(|m| m.usable()[i]));
    let first = usable.next();
    if first.is_none_or(|first| usable.all(|i| colors[i] == colors[first])) {
        return Err(constant());
    }
    Ok((colors, mask))
}
