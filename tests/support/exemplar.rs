//! Photographs made by code: grain, stains, pebbles, stripes. No period, no files.

use texforge::base::rng::Rng;
use texforge::{Encoding, Picture, Samples};

/// A picture in floats, full scale 1, three channels.
#[derive(Debug, Clone)]
pub(crate) struct Exemplar {
    pub(crate) height: usize,
    pub(crate) width: usize,
    pub(crate) rgb: Vec<[f64; 3]>,
}

impl Exemplar {
    /// An exemplar from its pixels, clamped to 0..=1.
    pub(crate) fn from_fn(
        height: usize,
        width: usize,
        pixel: impl Fn(usize, usize) -> [f64; 3],
    ) -> Self {
        let at = |i: usize| pixel(i / width, i % width).map(|v| v.clamp(0.0, 1.0));
        Self { height, width, rgb: (0..height * width).map(at).collect() }
    }

    /// As 8-bit sRGB.
    pub(crate) fn picture(&self) -> Picture {
        let samples = self.rgb.iter().flatten().map(|v| (v * 255.0 + 0.5) as u8).collect();
        self.with(3, Samples::U8(samples), Encoding::Srgb)
    }

    /// A picture of this size from samples.
    pub(crate) fn with(&self, channels: usize, samples: Samples, encoding: Encoding) -> Picture {
        Picture::new(self.height, self.width, channels, samples, encoding).expect("exemplar")
    }
}

/// A number in 0..1 for a place.
pub(crate) fn hash(seed: u64, y: i64, x: i64) -> f64 {
    let item = (y as u64).wrapping_mul(0x1_0000_0001).wrapping_add(x as u64);
    f64::from(Rng::new(seed, 77, 0, item).next_u32()) / f64::from(u32::MAX)
}

/// Smooth noise in 0..1 whose blotches are `size` pixels wide.
pub(crate) fn value_noise(seed: u64, y: f64, x: f64, size: f64) -> f64 {
    let (v, u) = (y / size, x / size);
    let (y0, x0) = (v.floor(), u.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (fy, fx) = (smooth(v - y0), smooth(u - x0));
    let at = |dy: i64, dx: i64| hash(seed, y0 as i64 + dy, x0 as i64 + dx);
    let top = at(0, 0) * (1.0 - fx) + at(0, 1) * fx;
    let bottom = at(1, 0) * (1.0 - fx) + at(1, 1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Stationary grain: blotches of 7 and 3 pixels and noise.
pub(crate) fn grain(height: usize, width: usize, seed: u64) -> Exemplar {
    Exemplar::from_fn(height, width, |y, x| {
        let (v, u) = (y as f64, x as f64);
        let large = value_noise(seed, v, u, 7.0) - 0.5;
        let small = value_noise(seed + 1, v, u, 3.0) - 0.5;
        let fine = hash(seed + 2, y as i64, x as i64) - 0.5;
        let warm = value_noise(seed + 3, v, u, 6.0) - 0.5;
        let light = 0.5 + 0.35 * large + 0.2 * small + 0.1 * fine;
        [light + 0.1 * warm, light, light - 0.1 * warm]
    })
}

/// [`grain`] with a dark brown stain over a fifth of it and a slope of light.
pub(crate) fn stained(height: usize, width: usize, seed: u64) -> Exemplar {
    let clean = grain(height, width, seed);
    Exemplar::from_fn(height, width, |y, x| {
        let (v, u) = (y as f64 / height as f64, x as f64 / width as f64);
        let far = ((v - 0.35) / 0.28).hypot((u - 0.6) / 0.24);
        let stain = 1.0 - 0.45 * (1.3 - far).clamp(0.0, 0.3) / 0.3;
        let light = 0.95 + 0.15 * v;
        let [r, g, b] = clean.rgb[y * width + x];
        [r * stain * light, g * stain * stain.sqrt() * light, b * stain * stain * light]
    })
}

/// Pebbles: cells of a jittered grid of 14 pixels, each with its own colour, dark between them.
pub(crate) fn pebbles(height: usize, width: usize, seed: u64) -> Exemplar {
    const CELL: f64 = 14.0;
    Exemplar::from_fn(height, width, |y, x| {
        let (v, u) = (y as f64 / CELL, x as f64 / CELL);
        let (cy, cx) = (v.floor() as i64, u.floor() as i64);
        let mut near = [(f64::MAX, (0, 0)); 2];
        for gy in cy - 2..=cy + 2 {
            for gx in cx - 2..=cx + 2 {
                let (jy, jx) = (hash(seed, gy, gx), hash(seed + 1, gy, gx));
                let far = (gy as f64 + jy - v).hypot(gx as f64 + jx - u);
                if far < near[0].0 {
                    near = [(far, (gy, gx)), near[0]];
                } else if far < near[1].0 {
                    near[1] = (far, (gy, gx));
                }
            }
        }
        let [(first, (gy, gx)), (second, _)] = near;
        let edge = ((second - first) * 5.0).min(1.0);
        let light = 0.25 + 0.6 * hash(seed + 2, gy, gx);
        let tint = 0.12 * (hash(seed + 3, gy, gx) - 0.5);
        let fine = 0.06 * (hash(seed + 4, y as i64, x as i64) - 0.5);
        let light = edge * light * (1.1 - 0.4 * first) + fine;
        [light + tint * edge, light, light - tint * edge]
    })
}

/// Vertical stripes of about 9 pixels that waver, with grain.
pub(crate) fn stripes(height: usize, width: usize, seed: u64) -> Exemplar {
    Exemplar::from_fn(height, width, |y, x| {
        let (v, u) = (y as f64, x as f64);
        let phase = (u + 3.0 * value_noise(seed, v, u, 17.0)) * std::f64::consts::TAU / 9.0;
        let fine = hash(seed + 1, y as i64, x as i64) - 0.5;
        let light = 0.5 + 0.3 * phase.sin() + 0.08 * fine;
        [light, light * 0.9, 0.8 * light + 0.1]
    })
}
