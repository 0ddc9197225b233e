//! [`ExtractParams`]: what can be asked of an extraction, and its defaults.

use crate::base::params::{Value, choice, params};
use crate::method::representative::Similarity;
use crate::method::wang::TileSet;

/// Where the period comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PeriodSource {
    /// The lattice's if that is sure enough, else that of the self-difference.
    Auto,
    /// The self-difference along the axes (the paper's).
    Ssd,
    /// The smallest upright rectangle of the lattice that [`detect_lattice`](crate::detect_lattice)
    /// finds.
    Lattice,
    /// Given, in pixels.
    Pixels {
        /// To the right.
        width: f64,
        /// Downwards.
        height: f64,
    },
}

impl Value for PeriodSource {
    const KIND: &'static str = "period";

    fn parse(text: &str) -> Option<Self> {
        match text {
            "auto" => Some(Self::Auto),
            "ssd" => Some(Self::Ssd),
            "lattice" => Some(Self::Lattice),
            text => {
                let (width, height) = text.split_once(['x', 'X'])?;
                Some(Self::Pixels { width: width.parse().ok()?, height: height.parse().ok()? })
            }
        }
    }

    fn show(&self) -> String {
        match self {
            Self::Auto => "auto".into(),
            Self::Ssd => "ssd".into(),
            Self::Lattice => "lattice".into(),
            Self::Pixels { width, height } => format!("{width}x{height}"),
        }
    }

    fn expected() -> String {
        "auto, ssd, lattice, or a period as WIDTHxHEIGHT in pixels, which may be fractions".into()
    }
}

choice! {
    /// Whether the photo is scaled so that its period is a whole number of pixels.
    pub enum Scaling {
        /// Down to the next whole number, and put upright if it leans.
        Down = "down",
        /// Not at all: the tile's sides are rounded, its pixels are the photo's own.
        Off = "off",
    }
}

params! {
    /// Parameters of [`extract`].
    pub struct ExtractParams for "extract" {
        /// The period: WIDTHxHEIGHT in pixels, which may be fractions; ssd looks for it along both axes, lattice takes the smallest upright rectangle of the lattice, auto tries that first, then ssd.
        period: PeriodSource = PeriodSource::Auto, unit "px";
        /// How many periods a tile spans in each direction.
        periods: usize = 1, in 1..=64;
        /// Whether the photo is scaled down a little (and put upright) so that the period is a whole number of pixels; off rounds the tile's sides and leaves all pixels as they are.
        scale: Scaling = Scaling::Down;
        /// How many tiles, the best first.
        count: usize = 4, in 1..=100;
        /// How differences count, of edges as of the tiling from the photo: squared (the paper's), or absolute, which a few stains or odd periods do not mislead.
        similarity: Similarity = Similarity::Squared;
        /// Weight of continuity, of how well a tile's edges fit each other; none chooses it such that it counts as much as resemblance.
        alpha: Option<f32> = None;
        /// Weight of resemblance, of how much the tiling is like the photo.
        beta: f32 = 1.0, in 0.0..=1_000_000.0;
        /// Share of the positions that is looked at, those with the best fitting edges: the paper's p. 1 looks at all, and takes no longer.
        keep: f32 = 1.0, in 0.0..=1.0;
        /// How much two tiles may overlap, as a share of their area.
        overlap: f32 = 0.25, in 0.0..=1.0;
        /// From which confidence on a period counts as found.
        min_confidence: f32 = 0.5, in 0.0..=1.0;
        /// Reach of the light flattening, 0.02 or more: differences of light that are wider are taken out of the photo first; 0 switches it off.
        flatten: f32 = 0.0, in 0.0..=1.0, unit "fraction of the photo's shorter side";
        /// Make a border of this width anew inside each tile, out of the photo's other periods, so that it fits seamlessly; 0 leaves the tile as it is.
        band: usize = 0, in 0..=8192, unit "px";
    }
}

params! {
    /// Parameters of [`wang`](crate::wang).
    pub struct WangParams for "wang" {
        /// Which tiles: complete is all 16 with two colours of edges in either direction, minimal the 8 that suffice.
        set: TileSet = TileSet::Complete;
        /// The period, as of extract: WIDTHxHEIGHT in pixels, which may be fractions; or ssd, lattice, auto.
        period: PeriodSource = PeriodSource::Auto, unit "px";
        /// How many periods a tile spans in each direction: the more, the less alike the plane's parts are. The photo must hold about twice as many.
        periods: usize = 2, in 1..=64;
        /// Whether the photo is scaled down a little (and put upright) so that the period is a whole number of pixels; off rounds the tile's sides and leaves all pixels as they are.
        scale: Scaling = Scaling::Down;
        /// How much the pieces of the photo that tiles are made of may overlap, as a share of their area.
        overlap: f32 = 0.25, in 0.0..=1.0;
        /// From which confidence on a period counts as found.
        min_confidence: f32 = 0.5, in 0.0..=1.0;
        /// Reach of the light flattening, 0.02 or more: differences of light that are wider are taken out of the photo first; 0 switches it off.
        flatten: f32 = 0.0, in 0.0..=1.0, unit "fraction of the photo's shorter side";
    }
}
