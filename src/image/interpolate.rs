//! Pictures between their pixels: Lanczos with three lobes, at places in 64ths of a pixel.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::image::color::{SrgbTables, linear_from_srgb, srgb_from_linear};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Sample};

/// Parts of a pixel. Places that are rounded to them are off by 0.005 pixels (root mean square).
pub const PARTS: i64 = 64;

/// Pixels to either side of which a place between two is made. Fewer lobes blur, more ring farther.
pub const REACH: usize = 3;

/// How far a place lies beside the middle of its nearest pixel: rows, columns, in [`PARTS`], from half
/// a pixel less to half a pixel more.
pub type Fraction = [i8; 2];

/// The shares of the pixels around a place, by its parts beyond the third of them.
static WEIGHTS: LazyLock<Vec<[f64; 2 * REACH]>> = LazyLock::new(|| {
    let sinc = |t: f64| {
        let a = std::f64::consts::PI * t;
        libm::sin(a) / a
    };
    let of = |part: i64| {
        if part == 0 {
            // Not by the formula: what lies beside a pixel may not even be read.
            return std::array::from_fn(|i| f64::from(i + 1 == REACH));
        }
        let t = |i: usize| (i + 1) as f64 - REACH as f64 - part as f64 / PARTS as f64;
        let all: [f64; 2 * REACH] = std::array::from_fn(|i| sinc(t(i)) * sinc(t(i) / REACH as f64));
        let sum: f64 = all.iter().sum();
        all.map(|weight| weight / sum)
    };
    (0..PARTS).map(of).collect()
});

/// The pixel nearest to a place in [`PARTS`].
pub fn nearest(place: i64) -> i64 {
    (place + PARTS / 2).div_euclid(PARTS)
}

/// What a place lies beside its nearest pixel.
pub fn fraction(place: i64) -> i8 {
    (place - nearest(place) * PARTS) as i8
}

/// The first of the pixels that a place is made of, and their shares.
pub fn taps(place: i64) -> (i64, &'static [f64; 2 * REACH]) {
    let (before, part) = (place.div_euclid(PARTS), place.rem_euclid(PARTS));
    (before + 1 - REACH as i64, &WEIGHTS[part as usize])
}

/// A picture that is read between its pixels.
#[derive(Debug)]
pub(super) struct Reader<'a, T> {
    samples: &'a [T],
    /// Height, width and channels.
    size: (usize, usize, usize),
    alpha: Option<usize>,
    /// The samples in linear light, if they are display-referred colours.
    light: Option<Vec<f32>>,
}

impl<'a, T: Sample> Reader<'a, T> {
    /// `picture`, whose samples are these, and which `kind` says the numbers of.
    pub(super) fn new(picture: &Picture, samples: &'a [T], kind: MapKind) -> Self {
        let (c, alpha) = (picture.channels(), picture.alpha_channel());
        // Rounding hides the tables' errors; floats would show them.
        let tables = (T::SCALE > 1.0).then(SrgbTables::get);
        let linear = |(i, v): (usize, &T)| match tables {
            _ if Some(i % c) == alpha => v.to_unit() as f32,
            Some(tables) => tables.linear(v.to_unit()) as f32,
            None => linear_from_srgb(v.to_unit()) as f32,
        };
        let curved = picture.encoding == Encoding::Srgb && kind == MapKind::Color;
        let light = curved.then(|| samples.par_iter().enumerate().map(linear).collect());
        Self { samples, size: (picture.height(), picture.width(), c), alpha, light }
    }

    /// What is at a place, within the range of the pixels that it is made of. Colours are mixed in linear
    /// light; beyond the edge the edge goes on.
    pub(super) fn read(&self, out: &mut [T], at: [u32; 2], fraction: Fraction) {
        let Some(light) = &self.light else {
            let put = |_, value| T::from_unit(value);
            return self.mixed(out, at, fraction, |i| self.samples[i].to_unit(), put);
        };
        let tables = (T::SCALE > 1.0).then(SrgbTables::get);
        let display = |k, value| {
            T::from_unit(match tables {
                _ if Some(k) == self.alpha => value,
                Some(tables) => tables.display(value),
                None => srgb_from_linear(value),
            })
        };
        self.mixed(out, at, fraction, |i| f64::from(light[i]), display);
    }

    /// The same from `value(sample)` to `put(channel, mixture)`.
    fn mixed(
        &self,
        out: &mut [T],
        at: [u32; 2],
        fraction: Fraction,
        value: impl Fn(usize) -> f64,
        put: impl Fn(usize, f64) -> T,
    ) {
        let (h, w, c) = self.size;
        let along = |k: usize, n: usize| {
            let (first, weights) = taps(i64::from(at[k]) * PARTS + i64::from(fraction[k]));
            // At a whole pixel what lies beside it is not even read: it may be hidden.
            let own = if fraction[k] == 0 { REACH - 1..REACH } else { 0..2 * REACH };
            let inside = move |i: usize| (first + i as i64).clamp(0, n as i64 - 1) as usize;
            own.map(move |i| (inside(i), weights[i]))
        };
        for (k, out) in out.iter_mut().enumerate() {
            let (mut sum, mut least, mut most) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
            for (y, down) in along(0, h) {
                let mut of_row = 0.0;
                for (x, across) in along(1, w) {
                    let value = value((y * w + x) * c + k);
                    (least, most) = (least.min(value), most.max(value));
                    of_row += across * value;
                }
                sum += down * of_row;
            }
            // Or hard edges would get halos, and values leave the range that they mean something in.
            let sum = sum.max(least).min(most);
            *out = put(k, sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::image::picture::Samples;
    use crate::image::sourcemap::SourceMap;

    fn sinc(t: f64) -> f64 {
        if t == 0.0 {
            1.0
        } else {
            libm::sin(std::f64::consts::PI * t) / (std::f64::consts::PI * t)
        }
    }

    #[test]
    fn places_are_a_pixel_and_a_fraction() {
        for place in -200..200 {
            let (pixel, beside) = (nearest(place), fraction(place));
            assert!((-32..32).contains(&beside), "{place}");
            assert_eq!(pixel * PARTS + i64::from(beside), place);
        }
    }

    #[test]
    fn shares_are_those_of_the_kernel() {
        for place in [0, 1, 17, 32, 63, 64, 100] {
            let (first, weights) = taps(place);
            let t = |i: usize| (first + i as i64) as f64 - place as f64 / 64.0;
            let all: Vec<f64> = (0..6).map(|i| sinc(t(i)) * sinc(t(i) / 3.0)).collect();
            let sum: f64 = all.iter().sum();
            for (got, want) in weights.iter().zip(all) {
                assert!((got - want / sum).abs() < 1e-12, "{place}: {got} {want}");
            }
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    /// A picture of noise, colours with their alpha.
    fn noise(encoding: Encoding) -> Picture {
        let mut rng = Rng::new(4, 0, 0, 0);
        let samples = (0..12 * 14 * 4).map(|i| if i % 4 == 3 { 255 } else { rng.below(256) as u8 });
        Picture::new(12, 14, 4, Samples::U8(samples.collect()), encoding).expect("a picture")
    }

    #[test]
    fn colors_are_mixed_in_linear_light_and_data_as_they_are() {
        let places = [[0, 0], [5, 6], [4, 9], [11, 13]];
        let beside = [[0, 0], [20, -31], [0, 7], [-8, 0]];
        for encoding in [Encoding::Srgb, Encoding::Linear, Encoding::Data] {
            let picture = noise(encoding);
            let map = SourceMap::new((1, 4), (12, 14), places.to_vec()).expect("inside");
            let map = map.between(beside.to_vec()).expect("one a pixel");
            let got = map.apply(&picture, MapKind::Color).expect("it fits");
            for (i, (at, beside)) in places.iter().zip(beside).enumerate() {
                let at: [f64; 2] =
                    std::array::from_fn(|k| f64::from(at[k]) + f64::from(beside[k]) / 64.0);
                for k in 0..4 {
                    let curved = encoding == Encoding::Srgb && k < 3;
                    let (mut sum, mut weights) = (0.0, 0.0);
                    let (mut least, mut most) = (f64::MAX, f64::MIN);
                    for (y, x) in (-6..18).flat_map(|y| (-6..20).map(move |x| (y, x))) {
                        let kernel =
                            |t: f64| if t.abs() < 3.0 { sinc(t) * sinc(t / 3.0) } else { 0.0 };
                        let weight = kernel(f64::from(y) - at[0]) * kernel(f64::from(x) - at[1]);
                        let (y, x) = (y.clamp(0, 11) as usize, x.clamp(0, 13) as usize);
                        let v = picture.samples().unit((y * 14 + x) * 4 + k);
                        let v = if curved { linear_from_srgb(v) } else { v };
                        if weight.abs() > 1e-12 {
                            (least, most) = (least.min(v), most.max(v));
                        }
                        sum += weight * v;
                        weights += weight;
                    }
                    let want = (sum / weights).clamp(least, most);
                    let want = if curved { srgb_from_linear(want) } else { want };
                    let got = got.samples().unit(i * 4 + k);
                    // Half a step of 8 bits.
                    assert!(
                        (got - want).abs() < 0.501 / 255.0,
                        "{encoding:?} {i} {k}: {got} {want}"
                    );
                }
            }
        }
    }

    #[test]
    fn beside_hidden_places_whole_ones_stay_copies() {
        let v = [0.25, f32::NAN, 0.75, -0.5, 1.5, f32::INFINITY, 7.0];
        let picture =
            Picture::new(1, 7, 1, Samples::F32(v.to_vec()), Encoding::Linear).expect("valid");
        let map = SourceMap::new((1, 2), (1, 7), vec![[0, 3], [0, 6]]).expect("inside");
        let map = map.between(vec![[9, 0], [0, 0]]).expect("one a pixel");
        let got = map.apply(&picture, MapKind::Color).expect("it fits");
        assert_eq!(got.samples(), &Samples::F32(vec![-0.5, 7.0]), "one row is the same all over");
    }

    #[test]
    fn normals_keep_their_length_and_nothing_overshoots() {
        let v: Vec<f32> =
            (0..9).flat_map(|i| if i < 5 { [1.0, 0.5, 0.5] } else { [0.5, 0.0, 0.5] }).collect();
        let picture = Picture::new(1, 9, 3, Samples::F32(v), Encoding::Data).expect("valid");
        let map = SourceMap::new((1, 9), (1, 9), (0..9).map(|x| [0, x]).collect()).expect("inside");
        let map = map.between(vec![[0, 31]; 9]).expect("one a pixel");
        let data = map.apply(&picture, MapKind::Data).expect("it fits");
        assert!((0..27).all(|i| (0.0..=1.0).contains(&data.samples().unit(i))));
        let normals = map.apply(&picture, MapKind::Normal).expect("it fits");
        for i in 0..9 {
            let length: f64 =
                (0..3).map(|k| (2.0 * normals.samples().unit(3 * i + k) - 1.0).powi(2)).sum();
            assert!((length - 1.0).abs() < 1e-5, "{i}: {length}");
        }
    }
}
