//! sRGB, linear light and CIE L*a*b* (D65), and the space in which patches are compared.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::image::picture::{Encoding, Picture, Sample, Samples};
use crate::with_samples;

/// Linear light from a display-referred sRGB value in `0..=1` (IEC 61966-2-1).
pub fn linear_from_srgb(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

/// Display-referred sRGB from linear light in `0..=1`.
pub fn srgb_from_linear(v: f64) -> f64 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 }
}

/// sRGB to linear light and back, tabulated over `0..=1`: a power for every sample would take longer than
/// what is done with it. The error is far below a step of 16 bits.
#[derive(Debug)]
pub struct SrgbTables {
    linear: Vec<f64>,
    /// Over the root: the curve is steep at black.
    display: Vec<f64>,
}

impl SrgbTables {
    const STEPS: usize = 1 << 14;

    /// The tables, made once in a process.
    pub fn get() -> &'static Self {
        static TABLES: LazyLock<SrgbTables> = LazyLock::new(|| {
            let table = |f: &dyn Fn(f64) -> f64| {
                (0..SrgbTables::STEPS + 2).map(|i| f(i as f64 / SrgbTables::STEPS as f64)).collect()
            };
            SrgbTables {
                linear: table(&linear_from_srgb),
                display: table(&|root| srgb_from_linear(root * root)),
            }
        });
        &TABLES
    }

    /// As [`linear_from_srgb`].
    pub fn linear(&self, v: f64) -> f64 {
        Self::between(&self.linear, v).unwrap_or_else(|| linear_from_srgb(v))
    }

    /// As [`srgb_from_linear`].
    pub fn display(&self, v: f64) -> f64 {
        Self::between(&self.display, v.sqrt()).unwrap_or_else(|| srgb_from_linear(v))
    }

    /// `None` outside `0..=1`.
    fn between(table: &[f64], v: f64) -> Option<f64> {
        let at = (0.0..=1.0).contains(&v).then_some(v * Self::STEPS as f64)?;
        let i = at as usize;
        Some(table[i] + (table[i + 1] - table[i]) * (at - i as f64))
    }
}

/// Steps of the table of cube roots; linear interpolation then errs by less than 1e-5.
const ROOT_STEPS: usize = 8192;

/// The function f of CIE L*a*b*, tabulated over `0..=1`.
static LAB_CURVE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..=ROOT_STEPS + 1).map(|i| lab_curve_exact(i as f32 / ROOT_STEPS as f32)).collect()
});

/// Values of all integer samples, as they are and from sRGB to linear light.
static LINEAR_OF_U8: LazyLock<[Vec<f32>; 2]> = LazyLock::new(|| linear_of(255));
static LINEAR_OF_U16: LazyLock<[Vec<f32>; 2]> = LazyLock::new(|| linear_of(65535));

fn linear_of(largest: usize) -> [Vec<f32>; 2] {
    let table = |linear: fn(f64) -> f64| {
        (0..=largest).map(|i| linear(i as f64 / largest as f64) as f32).collect()
    };
    [table(|v| v), table(linear_from_srgb)]
}

fn lab_curve_exact(t: f32) -> f32 {
    if t > 216.0 / 24389.0 { libm::cbrtf(t) } else { (t * (24389.0 / 27.0) + 16.0) / 116.0 }
}

#[inline]
fn lab_curve(table: &[f32], t: f32) -> f32 {
    if (0.0..=1.0).contains(&t) {
        let at = t * ROOT_STEPS as f32;
        let i = at as usize;
        table[i] + (table[i + 1] - table[i]) * (at - i as f32)
    } else {
        lab_curve_exact(t)
    }
}

/// CIE L*a*b* (D65, two-degree observer) from linear RGB with sRGB primaries. Values above 1 go
/// on above L* = 100.
#[inline]
fn lab_from_linear(table: &[f32], [r, g, b]: [f32; 3]) -> [f32; 3] {
    // The matrix of IEC 61966-2-1 with each row divided by the white point.
    let x = 0.433_953 * r + 0.376_219 * g + 0.189_828 * b;
    let y = 0.212_671 * r + 0.715_160 * g + 0.072_169 * b;
    let z = 0.017_758 * r + 0.109_477 * g + 0.872_765 * b;
    let (fx, fy, fz) = (lab_curve(table, x), lab_curve(table, y), lab_curve(table, z));
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// How the three averaging channels become the three matching channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatchSpace {
    /// Linear RGB becomes L*a*b*.
    Lab,
    /// Data: full scale becomes 100, the range of L*.
    Data,
}

impl MatchSpace {
    /// Converts a row of averaging pixels in place.
    pub fn convert_row(self, row: &mut [[f32; 3]]) {
        match self {
            Self::Lab => {
                let table = &LAB_CURVE[..];
                for px in row {
                    *px = lab_from_linear(table, *px);
                }
            }
            Self::Data => {
                for v in row.as_flattened_mut() {
                    *v *= 100.0;
                }
            }
        }
    }
}

/// How a picture's samples become three channels, fixed by one picture (the photo) and applied to
/// others (its tiles), so that their colours can be compared.
#[derive(Debug, Clone)]
pub struct ColorModel {
    space: MatchSpace,
    encoding: Encoding,
    components: Option<Components>,
    /// Linear value of every integer sample; empty for floats.
    table: &'static [f32],
}

impl ColorModel {
    /// The model for pictures like this one.
    pub fn new(photo: &Picture) -> Self {
        let encoding = photo.encoding;
        let is_color = encoding != Encoding::Data && photo.channels() <= 4;
        let many = !is_color && photo.channels() > 3;
        let srgb = encoding == Encoding::Srgb;
        let table: &[f32] = match photo.samples() {
            Samples::U8(_) => &LINEAR_OF_U8[usize::from(srgb)],
            Samples::U16(_) => &LINEAR_OF_U16[usize::from(srgb)],
            _ => &[],
        };
        Self {
            space: if is_color { MatchSpace::Lab } else { MatchSpace::Data },
            encoding,
            components: many.then(|| Components::of(photo)),
            table,
        }
    }

    /// How averages become colours to match.
    pub fn space(&self) -> MatchSpace {
        self.space
    }

    /// Three channels a pixel in the space where averages are right: linear light for colours, the
    /// numbers themselves for data (their principal components if there are more than three).
    pub fn averaging_pixels(&self, picture: &Picture) -> Vec<[f32; 3]> {
        self.pixels(picture, |_| {})
    }

    /// The colours to match.
    pub fn matching_pixels(&self, picture: &Picture) -> Vec<[f32; 3]> {
        self.pixels(picture, |row| self.space.convert_row(row))
    }

    /// The averaging pixels, with `then` done to every row of them.
    fn pixels(&self, picture: &Picture, then: impl Fn(&mut [[f32; 3]]) + Sync) -> Vec<[f32; 3]> {
        match picture.samples() {
            Samples::U8(v) => pixels(picture, v, |px| self.by_table(px), then),
            Samples::U16(v) => pixels(picture, v, |px| self.by_table(px), then),
            samples => with_samples!(samples, v => {
                pixels(picture, v, |px| self.averaging(px.len(), |k| px[k].to_unit()), then)
            }),
        }
    }

    /// The colour to match of pixel `i`.
    pub fn matching_pixel(&self, picture: &Picture, i: usize) -> [f32; 3] {
        let c = picture.channels();
        let mut px = [match picture.samples() {
            Samples::U8(v) => self.by_table(&v[i * c..(i + 1) * c]),
            Samples::U16(v) => self.by_table(&v[i * c..(i + 1) * c]),
            samples => self.averaging(c, |k| samples.unit(i * c + k)),
        }];
        self.space.convert_row(&mut px);
        px[0]
    }

    fn linear(&self, v: f64) -> f64 {
        if self.encoding == Encoding::Srgb { linear_from_srgb(v) } else { v }
    }

    /// Which sample each of the three channels shows, if there are no components.
    fn channel(&self, c: usize, k: usize) -> Option<usize> {
        match self.space {
            MatchSpace::Lab => Some(if c <= 2 { 0 } else { k }),
            MatchSpace::Data => (k < c).then_some(k),
        }
    }

    fn averaging(&self, c: usize, unit: impl Fn(usize) -> f64) -> [f32; 3] {
        if let Some(components) = &self.components {
            return components.of_pixel(unit);
        }
        std::array::from_fn(|k| {
            let value = self.channel(c, k).map_or(0.0, |k| self.linear(unit(k))) as f32;
            // Only hidden pixels may be NaN here, and those are never used.
            if value.is_finite() { value } else { 0.0 }
        })
    }

    #[inline]
    fn by_table<T: Sample + Into<usize>>(&self, px: &[T]) -> [f32; 3] {
        if self.components.is_some() {
            return self.averaging(px.len(), |k| px[k].to_unit());
        }
        std::array::from_fn(|k| self.channel(px.len(), k).map_or(0.0, |k| self.table[px[k].into()]))
    }
}

/// What `of` makes of every pixel's samples, and `then` of their rows.
fn pixels<T: Sample>(
    picture: &Picture,
    samples: &[T],
    of: impl Fn(&[T]) -> [f32; 3] + Sync,
    then: impl Fn(&mut [[f32; 3]]) + Sync,
) -> Vec<[f32; 3]> {
    let (width, c) = (picture.width(), picture.channels());
    let mut out = vec![[0.0; 3]; picture.height() * width];
    let rows = out.par_chunks_exact_mut(width).zip(samples.par_chunks_exact(width * c));
    rows.for_each(|(out, row)| {
        out.iter_mut().zip(row.chunks_exact(c)).for_each(|(out, px)| *out = of(px));
        then(out);
    });
    out
}

/// The three strongest principal components of a picture with many channels.
#[derive(Debug, Clone)]
struct Components {
    mean: Vec<f64>,
    axes: Vec<Vec<f64>>,
}

impl Components {
    /// By power iteration on the covariance of at most 65536 evenly spaced pixels.
    fn of(picture: &Picture) -> Self {
        let c = picture.channels();
        let n = picture.height() * picture.width();
        let value = |i: usize, k: usize| {
            let value = picture.samples().unit(i * c + k);
            if value.is_finite() { value } else { 0.0 }
        };
        let sample: Vec<usize> = (0..n).step_by(n.div_ceil(65_536)).collect();
        let mut mean = vec![0.0; c];
        for &i in &sample {
            (0..c).for_each(|k| mean[k] += value(i, k) / sample.len() as f64);
        }
        let mut covariance = vec![0.0; c * c];
        for &i in &sample {
            for a in 0..c {
                for b in 0..c {
                    covariance[a * c + b] += (value(i, a) - mean[a]) * (value(i, b) - mean[b]);
                }
            }
        }
        let total: f64 = (0..c).map(|k| covariance[k * c + k]).sum();
        let mut axes: Vec<Vec<f64>> = Vec::new();
        for _ in 0..3 {
            let mut axis: Vec<f64> = (0..c).map(|k| 1.0 + k as f64 / c as f64).collect();
            for _ in 0..64 {
                let mut next: Vec<f64> =
                    (0..c).map(|a| (0..c).map(|b| covariance[a * c + b] * axis[b]).sum()).collect();
                for done in &axes {
                    let along: f64 = next.iter().zip(done).map(|(u, v)| u * v).sum();
                    next.iter_mut().zip(done).for_each(|(u, v)| *u -= along * v);
                }
                let norm = next.iter().map(|v| v * v).sum::<f64>().sqrt();
                // What is left of no variance is rounding; it has no direction.
                let scale = if norm > 1e-9 * total { 1.0 / norm } else { 0.0 };
                for v in &mut next {
                    *v *= scale;
                }
                axis = next;
            }
            axes.push(axis);
        }
        Self { mean, axes }
    }

    fn of_pixel(&self, unit: impl Fn(usize) -> f64) -> [f32; 3] {
        std::array::from_fn(|a| {
            let along = self.axes[a].iter().zip(&self.mean).enumerate();
            let value = along.map(|(k, (axis, mean))| (unit(k) - mean) * axis).sum::<f64>() as f32;
            if value.is_finite() { value } else { 0.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lab(rgb: [u8; 3]) -> [f32; 3] {
        let px = rgb.map(|v| linear_from_srgb(f64::from(v) / 255.0) as f32);
        lab_from_linear(&LAB_CURVE, px)
    }

    #[test]
    fn the_tables_agree_with_the_curves() {
        const STEP: f64 = 0.05 / 65_535.0;
        let tables = SrgbTables::get();
        for i in 0..=100_000 {
            let v = f64::from(i) / 100_000.0;
            assert!((tables.linear(v) - linear_from_srgb(v)).abs() < STEP, "linear({v})");
            assert!((tables.display(v) - srgb_from_linear(v)).abs() < STEP, "display({v})");
        }
        assert!((tables.display(tables.linear(4.0)) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn known_colors() {
        // Values from the CIE formulas with the sRGB matrix (Lindbloom's calculator, D65).
        for (rgb, expected) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 255, 0], [87.73, -86.18, 83.18]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
            ([119, 119, 119], [50.03, 0.0, 0.0]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
        ] {
            let got = lab(rgb);
            for k in 0..3 {
                assert!((got[k] - expected[k]).abs() < 0.05, "{rgb:?}: {got:?} != {expected:?}");
            }
        }
    }

    #[test]
    fn the_table_agrees_with_the_formula() {
        for i in 0..=100_000 {
            let t = i as f32 / 100_000.0;
            let error = (lab_curve(&LAB_CURVE, t) - lab_curve_exact(t)).abs();
            assert!(error < 1e-5, "f({t}) errs by {error}");
        }
    }

    #[test]
    fn srgb_round_trip() {
        for i in 0..=255u8 {
            let v = f64::from(i) / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(v)) - v).abs() < 1e-7, "at {i}");
        }
    }

    #[test]
    fn many_channels_keep_their_main_variation() {
        // Five channels that are multiples of one pattern: the first component carries it all.
        let pattern = |i: usize| ((i * 37) % 101) as f32 / 101.0;
        let samples = (0..400).flat_map(|i| (1..=5).map(move |k| pattern(i) * k as f32)).collect();
        let picture =
            Picture::new(20, 20, 5, Samples::F32(samples), Encoding::Data).expect("valid");
        let px = ColorModel::new(&picture).averaging_pixels(&picture);
        let scale = (1..=5).map(|k| (k * k) as f32).sum::<f32>().sqrt();
        for i in 1..400 {
            let step = (px[i][0] - px[i - 1][0]).abs();
            assert!((step - (pattern(i) - pattern(i - 1)).abs() * scale).abs() < 1e-3, "at {i}");
            assert!(px[i][1].abs() < 1e-3 && px[i][2].abs() < 1e-3, "at {i}");
        }
    }
}
