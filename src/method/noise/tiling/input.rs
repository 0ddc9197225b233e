//! [`Input`]: the part of the photo that tiling and blending is made of.

use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::image::io::{Format, WriteOptions, encode, read_bytes};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};

/// Channels that are stored in one picture.
pub const TOGETHER: usize = 3;

/// Samples are 16 bits: this many to a standard deviation, with 0 in the middle.
pub const PER_DEVIATION: f64 = 8192.0;

/// A standard normal number of 0.
const ZERO: u16 = 1 << 15;

/// Longest side.
pub const LONGEST: u32 = 8192;

/// Pictures whose samples are the independent channels as standard normal numbers.
///
/// In JSON each picture of up to three channels is a PNG file in base 64.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Input {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Row by row, pixels interleaved: of one channel if there is no other, else of [`TOGETHER`], of which
    /// some in the last picture may be unused.
    pub pictures: Arc<Vec<Vec<u16>>>,
}

/// As it is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    size: [u32; 2],
    png: Vec<String>,
}

impl Input {
    /// Of planes of standard normal numbers.
    pub(super) fn new(size: [u32; 2], planes: &[Vec<f32>]) -> Self {
        let stored = |v: f32| {
            let steps = (f64::from(v) * PER_DEVIATION).round() + f64::from(ZERO);
            steps.clamp(0.0, f64::from(u16::MAX)) as u16
        };
        let pixels = (size[0] * size[1]) as usize;
        let picture = |planes: &[Vec<f32>], together: usize| {
            let sample =
                |i: usize| planes.get(i % together).map_or(ZERO, |p| stored(p[i / together]));
            (0..pixels * together).map(sample).collect()
        };
        let pictures = match planes {
            [_] => vec![picture(planes, 1)],
            _ => planes.chunks(TOGETHER).map(|planes| picture(planes, TOGETHER)).collect(),
        };
        Self { size, pictures: Arc::new(pictures) }
    }

    /// Channels in each picture.
    pub fn together(&self) -> usize {
        let pixels = (self.size[0] as usize * self.size[1] as usize).max(1);
        self.pictures.first().map_or(0, |picture| picture.len() / pixels)
    }

    /// Whether it is of so many channels.
    pub fn is_of(&self, channels: usize) -> bool {
        match channels {
            1 => self.pictures.len() == 1 && self.together() == 1,
            n => self.pictures.len() == n.div_ceil(TOGETHER) && self.together() == TOGETHER,
        }
    }

    /// The pictures as PNG files of 16 bits, whose numbers are data, not colours.
    ///
    /// # Errors
    /// None that a picture in memory can have.
    pub fn files(&self) -> Result<Vec<Vec<u8>>> {
        let [width, height] = self.size.map(|n| n as usize);
        let file = |samples: &Vec<u16>| {
            let samples = Samples::U16(samples.clone());
            let picture = Picture::new(height, width, self.together(), samples, Encoding::Data)?;
            encode(&picture, Format::Png, &WriteOptions::new(MapKind::Data))
        };
        self.pictures.iter().map(file).collect()
    }

    /// All channels as standard normal numbers, pixels interleaved.
    pub(super) fn interleaved(&self, channels: usize) -> Vec<f32> {
        let [width, height] = self.size.map(|n| n as usize);
        let together = self.together();
        let sample = |i: usize| {
            let (pixel, c) = (i / channels, i % channels);
            let stored = self.pictures[c / together][pixel * together + c % together];
            ((f64::from(stored) - f64::from(ZERO)) / PER_DEVIATION) as f32
        };
        (0..width * height * channels).map(sample).collect()
    }
}

impl From<Input> for Stored {
    fn from(input: Input) -> Self {
        // Pictures of these sizes and samples can always be written.
        let files = input.files().unwrap_or_default();
        Self { size: input.size, png: files.iter().map(|f| STANDARD.encode(f)).collect() }
    }
}

impl TryFrom<Stored> for Input {
    type Error = String;

    fn try_from(stored: Stored) -> std::result::Result<Self, String> {
        let [width, height] = stored.size;
        if stored.size.iter().any(|&n| n == 0 || n > LONGEST) {
            return Err(format!("its input is {width}x{height}, not 1 to {LONGEST} pixels a side"));
        }
        let picture = |(i, text): (usize, &String)| {
            let bad = |reason: String| format!("picture {i} of its input is damaged ({reason})");
            let bytes = STANDARD.decode(text).map_err(|e| bad(e.to_string()))?;
            let picture =
                read_bytes(&bytes, "the picture", MapKind::Data).map_err(|e| bad(e.to_string()))?;
            if (picture.width(), picture.height()) != (width as usize, height as usize) {
                let (w, h) = (picture.width(), picture.height());
                return Err(format!("picture {i} of its input is {w}x{h}, not {width}x{height}"));
            }
            match picture.samples() {
                Samples::U16(samples) if [1, TOGETHER].contains(&picture.channels()) => {
                    Ok(samples.clone())
                }
                _ => Err(bad("not 16 bits of one or three channels".into())),
            }
        };
        let pictures: Vec<_> =
            stored.png.iter().enumerate().map(picture).collect::<std::result::Result<_, _>>()?;
        if pictures.windows(2).any(|p| p[0].len() != p[1].len()) {
            return Err("the pictures of its input have different numbers of channels".into());
        }
        Ok(Self { size: stored.size, pictures: Arc::new(pictures) })
    }
}

/// The input at full size and at halves of it.
#[derive(Debug)]
pub(super) struct Pyramid {
    /// Width, height and samples, pixels interleaved.
    levels: Vec<(usize, usize, Vec<f32>)>,
    channels: usize,
    /// Standard deviation of every channel in each level, in that of the first.
    deviations: Vec<Vec<f64>>,
}

impl Pyramid {
    /// With `halvings` levels above the input, whose sides those divide.
    pub(super) fn new(input: &Input, channels: usize, halvings: u32) -> Self {
        let [width, height] = input.size.map(|n| n as usize);
        let mut levels = vec![(width, height, input.interleaved(channels))];
        for _ in 0..halvings {
            let halved = levels.last().map(|(w, h, fine)| halved((*w, *h), fine, channels));
            levels.extend(halved);
        }
        let squares: Vec<Vec<f64>> = levels.iter().map(|(_, _, s)| squares(s, channels)).collect();
        let deviation = |of: &Vec<f64>| {
            let share =
                |(s, all): (&f64, &f64)| if *all > 0.0 { (s / all).sqrt().min(1.0) } else { 0.0 };
            of.iter().zip(&squares[0]).map(share).collect()
        };
        let deviations = squares.iter().map(deviation).collect();
        Self { levels, channels, deviations }
    }

    /// The coarsest level.
    pub(super) fn coarsest(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// Standard deviation of every channel in every level, in that of the first.
    pub(super) fn deviations(&self) -> &[Vec<f64>] {
        &self.deviations
    }

    /// The coarsest level that holds at least half of the variance of channels with these deviations.
    pub(super) fn telling(&self, deviations: &[f64]) -> u32 {
        let held = |kept: &Vec<f64>| -> f64 {
            kept.iter().zip(deviations).map(|(k, d)| (k * d).powi(2)).sum()
        };
        let level =
            self.deviations.iter().rposition(|kept| held(kept) >= 0.5 * held(&self.deviations[0]));
        level.unwrap_or(0) as u32
    }

    /// Rows and columns of a level, and every channel's plane times its gain.
    pub(super) fn planes(&self, level: u32, gains: &[f64]) -> ((usize, usize), Vec<Vec<f32>>) {
        let (width, height, samples) = &self.levels[level as usize];
        let plane = |(c, gain): (usize, &f64)| {
            let samples = samples.iter().skip(c).step_by(self.channels);
            samples.map(|v| *gain as f32 * v).collect()
        };
        ((*height, *width), gains.iter().enumerate().map(plane).collect())
    }

    /// Adds `weight` times the channels at a position in pixels of the photo: linear between pixels, and
    /// between levels; the border goes on outside.
    #[inline]
    pub(super) fn add(&self, at: [f64; 2], level: f32, weight: f32, out: &mut [f32]) {
        let below = (level as usize).min(self.levels.len() - 1);
        let part = level - below as f32;
        self.add_of(below, at, weight * (1.0 - part), out);
        if part > 0.0 && below + 1 < self.levels.len() {
            self.add_of(below + 1, at, weight * part, out);
        }
    }

    #[inline]
    fn add_of(&self, level: usize, at: [f64; 2], weight: f32, out: &mut [f32]) {
        let (width, height, samples) = &self.levels[level];
        let per = f64::from(1u32 << level).recip();
        let place = |v: f64, n: usize| {
            let v = v * per - 0.5;
            let first = v.floor();
            let clamped = |i: f64| i.clamp(0.0, n as f64 - 1.0) as usize;
            (clamped(first), clamped(first + 1.0), (v - first) as f32)
        };
        let ((x0, x1, tx), (y0, y1, ty)) = (place(at[0], *width), place(at[1], *height));
        let pixel =
            |x: usize, y: usize| &samples[(y * width + x) * self.channels..][..self.channels];
        if tx == 0.0 && ty == 0.0 {
            // Pixels of the photo at its own scale: the same, faster.
            out.iter_mut().zip(pixel(x0, y0)).for_each(|(out, v)| *out += weight * v);
            return;
        }
        let corners = [pixel(x0, y0), pixel(x1, y0), pixel(x0, y1), pixel(x1, y1)];
        for (c, out) in out.iter_mut().enumerate() {
            let [a, b, d, e] = corners.map(|corner| corner[c]);
            let (top, bottom) = (a + tx * (b - a), d + tx * (e - d));
            *out += weight * (top + ty * (bottom - top));
        }
    }
}

/// Means of two by two pixels.
pub(crate) fn halved(
    (width, height): (usize, usize),
    fine: &[f32],
    channels: usize,
) -> (usize, usize, Vec<f32>) {
    let (w, h) = (width / 2, height / 2);
    let sample = |i: usize| {
        let (pixel, c) = (i / channels, i % channels);
        let (x, y) = (2 * (pixel % w), 2 * (pixel / w));
        let at = |x: usize, y: usize| fine[(y * width + x) * channels + c];
        0.25 * ((at(x, y) + at(x + 1, y)) + (at(x, y + 1) + at(x + 1, y + 1)))
    };
    (w, h, (0..w * h * channels).map(sample).collect())
}

/// Mean square of every channel.
fn squares(samples: &[f32], channels: usize) -> Vec<f64> {
    let pixels = (samples.len() / channels) as f64;
    let sum = |c: usize| {
        samples.iter().skip(c).step_by(channels).map(|&v| f64::from(v).powi(2)).sum::<f64>()
    };
    (0..channels).map(|c| sum(c) / pixels).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(channels: usize) -> (Input, Vec<Vec<f32>>) {
        let plane =
            |c: usize| (0..8 * 12).map(|i| ((i * (7 + c)) % 29) as f32 * 0.1 - 1.4).collect();
        let planes: Vec<Vec<f32>> = (0..channels).map(plane).collect();
        (Input::new([12, 8], &planes), planes)
    }

    #[test]
    fn it_keeps_numbers_to_sixteen_bits() {
        for channels in [1, 2, 3, 4, 7] {
            let (input, planes) = input(channels);
            assert!(input.is_of(channels));
            assert_eq!(input.pictures.len(), channels.div_ceil(TOGETHER));
            let stored = input.interleaved(channels);
            for (i, value) in stored.iter().enumerate() {
                let exact = planes[i % channels][i / channels];
                assert!((value - exact).abs() < 0.51 / PER_DEVIATION as f32, "{value} {exact}");
            }
            let text = serde_json::to_string(&input).expect("text");
            assert!(serde_json::from_str::<Input>(&text).expect("its own text") == input);
        }
    }

    #[test]
    fn middles_of_pixels_are_pixels_on_every_level() {
        let (input, _) = input(2);
        let pyramid = Pyramid::new(&input, 2, 2);
        for (level, n) in [(0u8, 1usize), (1, 2), (2, 4)] {
            for (y, x) in [(0, 0), (1, 2), (8 / n - 1, 12 / n - 1)] {
                let mut out = [0.0; 2];
                let at = [x, y].map(|i| (i as f64 + 0.5) * n as f64);
                pyramid.add(at, f32::from(level), 1.0, &mut out);
                for (c, out) in out.into_iter().enumerate() {
                    let all = input.interleaved(2);
                    let inside =
                        (0..n * n).map(|i| all[((y * n + i / n) * 12 + x * n + i % n) * 2 + c]);
                    let mean = inside.sum::<f32>() / (n * n) as f32;
                    assert!((out - mean).abs() < 1e-5, "{level} {y} {x} {c}: {out} {mean}");
                }
            }
        }
        // Between pixels, and beyond the border.
        let mut out = [0.0; 2];
        pyramid.add([3.0, 0.5], 0.0, 1.0, &mut out);
        let all = input.interleaved(2);
        assert!((out[0] - 0.5 * (all[4] + all[6])).abs() < 1e-6);
        let mut out = [0.0; 2];
        pyramid.add([-50.0, -50.0], 0.0, 2.0, &mut out);
        assert!((out[1] - 2.0 * all[1]).abs() < 1e-6);
    }
}
