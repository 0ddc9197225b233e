//! [`Detail`]: which frequencies the coefficients of a band hold.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde::{Deserialize, Serialize};

use super::filters::{DOWN, UP};

/// Which frequencies the coefficients of a band hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Detail {
    /// Those that are in the upper half along at least one axis: a square ring. The noise of Cook and
    /// DeRose; along the axes and the diagonals it looks woven.
    Square,
    /// A round ring of an octave from [`LOWER_END`] on, fading at both ends. Neighbouring bands add up to
    /// an even spectrum.
    Round,
    /// The same without an upper end, for the finest band: up to the corners of what pixels can hold.
    RoundFine,
    /// Along x and along y by themselves.
    Axes([Part; 2]),
}

/// Which frequencies along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// All up to the upper end.
    Low,
    /// An octave.
    Band,
    /// All from the lower end on.
    Fine,
}

/// Where a band ends below, in cycles a coefficient: half of its power is left there. Twice that is where
/// it ends above, as near to a half as fading out allows.
pub const LOWER_END: f64 = 0.210_224_103_813_428_64;

/// Over how many octaves bands fade.
const FADE: f64 = 0.5;

/// Half of that, as a factor, and a little more.
const EDGE: f64 = 1.19;

/// Amplitude that fades in around the lower end.
fn rise(f: f64) -> f64 {
    if f > LOWER_END * EDGE {
        return 1.0;
    }
    let octaves = libm::log2((f / LOWER_END).max(1e-9));
    libm::sin(FRAC_PI_2 * (octaves / FADE + 0.5).clamp(0.0, 1.0))
}

/// Amplitude that fades out around the upper end: with what rises at half the distance of coefficients it
/// has even power.
fn fall(f: f64) -> f64 {
    if f < 2.0 * LOWER_END / EDGE {
        return 1.0;
    }
    let octaves = libm::log2((0.5 * f / LOWER_END).max(1e-9));
    libm::cos(FRAC_PI_2 * (octaves / FADE + 0.5).clamp(0.0, 1.0))
}

/// What the quadratic B-spline leaves of a frequency.
pub(super) fn spline_transfer(f: f64) -> f64 {
    if f == 0.0 { 1.0 } else { (libm::sin(PI * f) / (PI * f)).powi(3) }
}

/// What it leaves of it at the coefficients themselves.
pub(super) fn knot_transfer(f: f64) -> f64 {
    0.75 + 0.25 * libm::cos(TAU * f)
}

impl Part {
    /// Amplitude at frequency `f` (cycles a coefficient), so that the spline surface is even.
    pub(super) fn amplitude(self, f: f64) -> f64 {
        match self {
            Self::Low => fall(f) / spline_transfer(f),
            Self::Band => rise(f) * fall(f) / spline_transfer(f),
            Self::Fine => rise(f) / knot_transfer(f),
        }
    }
}

impl Detail {
    /// Amplitude that the coefficients have at a frequency; before they are brought to unit variance.
    /// `None` for [`Detail::Square`], which is no function of frequency alone.
    pub(super) fn amplitude<const N: usize>(self, along: [&Frequency; N]) -> Option<f64> {
        let radius = || along.iter().map(|a| a.f * a.f).sum::<f64>().sqrt();
        let factors = || along.iter().map(|a| a.factor).product::<f64>();
        match self {
            Self::Square => None,
            Self::Round => {
                let r = radius();
                Some(rise(r) * fall(r) / factors())
            }
            Self::RoundFine => Some(rise(radius()) / factors()),
            Self::Axes(_) => Some(factors()),
        }
    }

    /// Power to expect of the coefficients at frequencies of x and y, before they are brought to unit
    /// variance.
    pub(super) fn power(self, [x, y]: [&Frequency; 2]) -> f64 {
        match self.amplitude([x, y]) {
            Some(amplitude) => amplitude * amplitude,
            // White noise less what half the resolution holds of it, averaged over both parities.
            None => 1.0 - 2.0 * x.shared * y.shared + x.held * y.held,
        }
    }

    /// A frequency along one axis (0: x), within -0.5..=0.5 cycles a coefficient.
    pub(super) fn frequency(self, axis: usize, f: f64) -> Frequency {
        let f = f.abs();
        let factor = match self {
            Self::Square => 1.0,
            Self::Round => spline_transfer(f),
            Self::RoundFine => knot_transfer(f),
            Self::Axes(parts) => parts[axis].amplitude(f),
        };
        let (shared, held) = if self == Self::Square { halves(f) } else { (0.0, 0.0) };
        Frequency { f, factor, shared, held }
    }

    /// The frequencies 0, 1, ... waves on `n` coefficients along an axis, up to the highest.
    pub(super) fn frequencies(self, axis: usize, n: usize) -> Vec<Frequency> {
        (0..=n / 2).map(|k| self.frequency(axis, k as f64 / n as f64)).collect()
    }

    /// A number below [`Detail::COUNT`] for each.
    pub(super) fn index(self) -> usize {
        match self {
            Self::Square => 0,
            Self::Round => 1,
            Self::RoundFine => 2,
            Self::Axes([x, y]) => 3 + 3 * x as usize + y as usize,
        }
    }

    /// How many there are.
    pub(super) const COUNT: usize = 12;
}

/// A frequency along one axis, and what a detail makes of it whatever it is along the others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frequency {
    /// In cycles a coefficient, without sign.
    f: f64,
    /// The axis' share of the amplitude: of round details, what that is divided by.
    factor: f64,
    /// The spectrum of white noise with what half the resolution holds of it.
    shared: f64,
    /// The power of that.
    held: f64,
}

/// At frequency `f` of coefficients: the spectrum of white noise with what half the resolution holds of
/// it, and the power of that; averaged over both parities.
fn halves(f: f64) -> (f64, f64) {
    let down = |f: f64| -> f64 {
        DOWN.iter().enumerate().map(|(m, a)| 2.0 * a * libm::cos(TAU * f * (m as f64 + 0.5))).sum()
    };
    let up: f64 = 2.0 * (UP[1] * libm::cos(TAU * f * 0.5) + UP[0] * libm::cos(TAU * f * 1.5));
    let (here, there) = (down(f), down(f + 0.5));
    (0.5 * up * here, 0.25 * up * up * (here * here + there * there))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_add_up_to_an_even_spectrum() {
        for f in [0.02, 0.03, 0.0625, 0.1, 0.2, 0.31, 0.49] {
            // What the spline surface has of band j, whose coefficients are 2^j apart.
            let of = |j: i32| {
                let here = f * f64::from(1 << j);
                let part = if j == 0 { Part::Fine } else { Part::Band };
                let transfer = if j == 0 { knot_transfer(here) } else { spline_transfer(here) };
                if here > 0.5 { 0.0 } else { (part.amplitude(here) * transfer).powi(2) }
            };
            let sum: f64 = (0..8).map(of).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{f}: {sum}");
        }
    }
}
