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
    /// Which noise is fitted.
    pub enum Directions {
        /// What the score recommends.
        Auto = "auto",
        /// Noise that is alike in all directions.
        Isotropic = "isotropic",
        /// Noise with bands that differ along two directions.
        Oriented = "oriented",
    }
}

params! {
    /// Parameters of [`fit_noise`](crate::fit_noise).
    pub struct NoiseParams for "noise fit" {
        /// Which noise is fitted: isotropic is alike in all directions (the paper's kind); oriented has bands that differ along two directions, for wood and the like; auto takes what suits the photo.
        directions: Directions = Directions::Auto;
        /// The shape of isotropic noise's bands in the spectrum: round is alike in all directions; square is the paper's, Cook and DeRose's wavelet noise, and looks a little woven.
        bands: Bands = Bands::Round;
        /// How the bands' weights follow from the photo's spectrum: corrected takes into account what each band leaks into others; direct is the paper's formula, which does not.
        weights: Weights = Weights::Corrected;
        /// Whether the photo's histograms are kept, or become normal distributions.
        histogram: Histogram = Histogram::Kept;
    }
}
