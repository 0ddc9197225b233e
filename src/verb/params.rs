//! [`TileParams`]: what can be asked of a tile, and its defaults.

use crate::base::params::{Value, choice, params};
use crate::image::sigma_map::SigmaMap;
use crate::image::symmetry::Symmetry;
use crate::method::stationary;
use crate::signal::measure::{ORDERS, Statistic};

/// Size of the tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// The largest power of two that is at most a tenth larger than the photo's shorter side, at
    /// most 2048; not square if the photo is at least twice as long as it is wide. If the photo
    /// repeats (see [`Follow`]), whole periods near that. With [`Method::MakeSeamless`] or a band, the
    /// photo's own size.
    Auto,
    /// This many pixels.
    Pixels {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
}

impl Value for Size {
    const KIND: &'static str = "size";

    fn parse(text: &str) -> Option<Self> {
        if text == "auto" {
            return Some(Self::Auto);
        }
        let (width, height) = text.split_once(['x', 'X']).unwrap_or((text, text));
        Some(Self::Pixels { width: width.parse().ok()?, height: height.parse().ok()? })
    }

    fn show(&self) -> String {
        match self {
            Self::Auto => "auto".into(),
            Self::Pixels { width, height } => format!("{width}x{height}"),
        }
    }

    fn expected() -> String {
        "a size as WIDTHxHEIGHT (one number for a square), or auto".into()
    }
}

choice! {
    /// In which directions the tile repeats.
    pub enum Axis {
        /// In both.
        Both = "both",
        /// Horizontally only (a trim sheet).
        X = "x",
        /// Vertically only.
        Y = "y",
    }
}

choice! {
    /// How the tile is made.
    pub enum Method {
        /// Toroidal PatchMatch with stationarity projection (Moritz et al. 2017).
        Stationary = "stationary",
        /// Baseline: toroidal PatchMatch without the projection.
        WrapOnly = "wrap-only",
        /// Baseline: PatchMatch that does not wrap at all.
        NoWrap = "no-wrap",
        /// Baseline: shift by half and blend over the seam, as image editors do.
        MakeSeamless = "make-seamless",
    }
}

choice! {
    /// The statistic that is made equal everywhere.
    pub enum Measure {
        /// Local histograms of each colour channel: the whole distribution.
        Histogram = "histogram",
        /// Local moments of each colour channel: mean, variance and so on, up to `order`.
        Moments = "moments",
        /// Local histograms of oriented filters' responses: only fine structure, no shades.
        Steerable = "steerable",
        /// None: the same as the method `wrap-only`.
        None = "none",
    }
}

choice! {
    /// How much time to spend.
    pub enum Quality {
        /// A quick look.
        Draft = "draft",
        /// The default.
        Normal = "normal",
        /// More iterations; about three times the time of normal.
        Best = "best",
    }
}

choice! {
    /// In which symmetries the photo's patches are used.
    pub enum Symmetries {
        /// As they lie.
        None = "none",
        /// Mirrored left to right as well.
        Mirror = "mirror",
        /// In all four quarter turns.
        Rotate = "rotate",
        /// Mirrored and turned: all eight.
        All = "all",
    }
}

choice! {
    /// Whether the tile follows the photo's lattice.
    pub enum Follow {
        /// No lattice is looked for.
        Off = "off",
        /// One is looked for, and followed if it is found.
        Auto = "auto",
    }
}

impl Symmetries {
    /// All that are in it; the first is the photo as it lies.
    pub fn list(self) -> &'static [Symmetry] {
        const MIRROR: [Symmetry; 2] = [Symmetry::ALL[0], Symmetry::ALL[4]];
        match self {
            Self::None => &Symmetry::ALL[..1],
            Self::Mirror => &MIRROR,
            Self::Rotate => &Symmetry::ALL[..4],
            Self::All => &Symmetry::ALL,
        }
    }
}

params! {
    /// Parameters of [`tile`].
    pub struct TileParams for "tile" {
        /// Size of the tile: WIDTHxHEIGHT, or auto for the largest power of two that about fits into the photo, or whole periods near it if the photo repeats.
        size: Size = Size::Auto, unit "px";
        /// In which directions the tile repeats.
        axis: Axis = Axis::Both;
        /// How the tile is made; all but stationary are baselines to compare with.
        method: Method = Method::Stationary;
        /// The statistic that is made equal everywhere in the tile.
        measure: Measure = Measure::Histogram;
        /// With the measure moments, how many of them: 1 the mean, 2 and the variance, 3 and the skewness, 4 and the kurtosis.
        order: usize = 2, in 1..=4;
        /// Reach of the stationarity measure: smaller evens out smaller stains, larger keeps more variety.
        sigma: f32 = 0.1, in 0.01..=1.0, unit "fraction of the tile's shorter side";
        /// How even the tile becomes, in place of sigma, 0 to 1: equal steps look like equal steps, whatever the photo. 0 evens out least, 1 until little but one material is left; what sigma that is, is found by trying and takes about a second.
        stationarity: Option<f32> = None;
        /// Side of the patches that are compared; odd. Larger keeps larger features whole, smaller mixes more.
        patch: usize = 11, in 3..=21, unit "px";
        /// How strongly every part of the photo is made to contribute equally; 0 switches it off.
        uniformity: f32 = 1.0, in 0.0..=100.0;
        /// How strongly single things that catch the eye (a leaf, a nail, a dark spot) are held back; 0 treats them like the rest. For the method stationary.
        rarity: f32 = 0.5, in 0.0..=4.0;
        /// How much time to spend.
        quality: Quality = Quality::Normal;
        /// How far the marks of the avoid mask are grown: nothing this near to a mark is copied.
        avoid_grow: usize = 0, in 0..=10000, unit "px";
        /// Reach of the light flattening, 0.02 or more: differences of light that are wider are taken out of the photo first; 0 switches it off.
        flatten: f32 = 0.0, in 0.0..=1.0, unit "fraction of the photo's shorter side";
        /// Whether patches are also used mirrored left to right, turned by quarters, or both: more to choose from, but light then falls from several sides.
        symmetry: Symmetries = Symmetries::None;
        /// Whether a photo that repeats (bricks, tiles, weave) stays in step: the size auto becomes a whole number of periods; a size given holds the nearest number of them, a little narrower or wider, if that is one within 45 %; where only the courses fit (3 %), they are kept. For the method stationary, of one photo as it lies, without a band.
        lattice: Follow = Follow::Auto;
        /// Keep the photo's middle as it is, pixel for pixel, and make only a border of this width anew, so that it repeats; 0 makes all anew.
        band: usize = 0, in 0..=8192, unit "px";
    }
}

impl TileParams {
    /// Width and height of the tile for a photo of this size: `size`, or the default if it is
    /// [`Size::Auto`].
    pub fn resolved_size(&self, photo_width: usize, photo_height: usize) -> (usize, usize) {
        if let Size::Pixels { width, height } = self.size {
            return (width, height);
        }
        if self.method == Method::MakeSeamless || self.band > 0 {
            return (photo_width, photo_height);
        }
        let pow2 = |n: usize| (1 << (n.max(1) * 11 / 10).max(1).ilog2()).min(2048);
        let (w, h) = (photo_width.max(1), photo_height.max(1));
        if w >= 2 * h || h >= 2 * w {
            return (pow2(w), pow2(h));
        }
        (pow2(w.min(h)), pow2(w.min(h)))
    }

    /// What `measure`, `order` and `sigma`, or the map in its place, say.
    pub(super) fn evenness(&self, sigma_map: Option<&SigmaMap>) -> Option<stationary::Evenness> {
        let statistic = match self.measure {
            Measure::Histogram => Statistic::Histogram,
            Measure::Moments => Statistic::Moments(ORDERS[self.order - 1]),
            Measure::Steerable => Statistic::Steerable,
            Measure::None => return None,
        };
        let sigma_map = sigma_map.cloned();
        Some(stationary::Evenness { statistic, sigma: self.sigma, sigma_map })
    }
}
