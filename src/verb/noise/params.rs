//! [`NoiseParams`]: what can be asked of a fit, and its defaults.

use crate::base::params::{choice, params};

choice! {
    /// How the bands' weights follow from the photo's spectrum.
    pub enum Weights {
        /// By non-negative least squares that know what each band leaks into others.
        Corrected = "corrected",
        /// By the paper's formula, as if there were no leakage.
        Direct = "direct",
    }
}

choice! {
    /// What becomes of the photo's histograms.
    pub enum Histogram {
        /// The texture has them.
        Kept = "kept",
        /// The texture has normal distributions, as noise does.
        Normal = "normal",
    }
}

choice! {
    /// The shape of the bands in the spectrum.
    pub enum Bands {
        /// Round: alike in all directions.
        Round = "round",
        /// Square: the paper's.
        Square = "square",
    }
}

choice! {
    /// Which kind of texture is fitted.
    pub enum Kind {
        /// The kind of noise that suits the photo.
        Auto = "auto",
        /// Noise that is alike in all directions: the paper's.
        Wavelet = "wavelet",
        /// Noise with bands that differ along two directions.
        Oriented = "oriented",
        /// Parts of the photo, blended.
        Tiling = "tiling",
    }
}

params! {
    /// Parameters of [`fit_noise`](crate::fit_noise).
    pub struct NoiseParams for "noise fit" {
        /// Which kind of texture is fitted: wavelet is noise that is alike in all directions (the paper's kind); oriented is noise with bands that differ along two directions, for wood and the like; auto takes the better of these; tiling lays parts of the photo beside each other and blends them, for photos with shapes, and keeps a picture in the document.
        model: Kind = Kind::Auto;
        /// The shape of isotropic noise's bands in the spectrum: round is alike in all directions; square is the paper's, Cook and DeRose's wavelet noise, and looks a little woven.
        bands: Bands = Bands::Round;
        /// How the bands' weights follow from the photo's spectrum: corrected takes into account what each band leaks into others; direct is the paper's formula, which does not.
        weights: Weights = Weights::Corrected;
        /// Whether the photo's histograms are kept, or become normal distributions.
        histogram: Histogram = Histogram::Kept;
        /// Distance of the tiles of tiling in pixels: large shapes need large tiles, small tiles repeat less. 0 is a fifth of the part that is kept.
        cell: usize = 0, in 0..=4096;
        /// How narrow the borders are where the tiles of tiling blend: 1 blends all over as the paper does, 16 is nearly a cut.
        sharpness: usize = 4, in 1..=16;
        /// Most pixels along each side of the photo's part that tiling keeps; a document of colours has about 8 bytes for each pixel of that part.
        keep: usize = 1024, in 64..=8192;
    }
}
