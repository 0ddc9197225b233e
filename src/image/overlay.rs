//! Lines over a picture.

use crate::base::error::Result;
use crate::image::color::srgb_from_linear;
use crate::image::picture::{Encoding, Picture, Samples};

/// Of the rim and of the line.
const DARK: f64 = 16.0;
const BRIGHT: [f64; 3] = [255.0, 224.0, 32.0];

/// Half the width of a line as a share of the longer side, so that it is seen when the picture is
/// made small; at least half a pixel.
const HALF: f64 = 0.0012;

/// The lines of a lattice through the picture's middle, bright with dark rims, on the picture as
/// 8-bit sRGB without alpha. Of data, and of more than four channels, the first channels are shown.
///
/// # Errors
/// None that a valid picture and independent vectors can cause.
pub fn lattice(picture: &Picture, [v1, v2]: [[f64; 2]; 2]) -> Result<Picture> {
    let (height, width, channels) = (picture.height(), picture.width(), picture.channels());
    let det = v1[0] * v2[1] - v1[1] * v2[0];
    // Coefficients of a displacement; a line of the lattice is where one of them is whole. The
    // distance to it is the coefficient's, divided by the length of its gradient.
    let rows = [[v2[1] / det, -v2[0] / det], [-v1[1] / det, v1[0] / det]];
    let lengths = rows.map(|g| libm::hypot(g[0], g[1]));
    let half = (HALF * width.max(height) as f64).max(0.5);
    let unit = |i: usize| {
        let v = picture.samples().unit(i);
        let v = if picture.encoding == Encoding::Linear {
            srgb_from_linear(v.clamp(0.0, 1.0))
        } else {
            v
        };
        if v.is_finite() { v.clamp(0.0, 1.0) * 255.0 } else { 0.0 }
    };
    let colored = channels >= 3;
    let mut out = Vec::with_capacity(height * width * 3);
    for y in 0..height {
        for x in 0..width {
            let (dx, dy) = (x as f64 - width as f64 / 2.0, y as f64 - height as f64 / 2.0);
            let to_line = |k: usize| {
                let c = rows[k][0] * dx + rows[k][1] * dy;
                (c - c.round()).abs() / lengths[k]
            };
            let distance = to_line(0).min(to_line(1));
            // One pixel of transition between line, rim and picture.
            let line = (half + 0.5 - distance).clamp(0.0, 1.0);
            let rim = (2.0 * half + 1.0 - distance).clamp(0.0, 1.0);
            let at = (y * width + x) * channels;
            for (k, bright) in BRIGHT.into_iter().enumerate() {
                let v = unit(at + if colored { k } else { 0 });
                let v = v + (DARK - v) * rim;
                out.push((v + (bright - v) * line).round() as u8);
            }
        }
    }
    Picture::new(height, width, 3, Samples::U8(out), Encoding::Srgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_where_the_lattice_is_and_the_rest_is_the_picture() {
        for shade in [0, 255] {
            let grey = Samples::U8(vec![shade; 40 * 60]);
            let picture = Picture::new(40, 60, 1, grey, Encoding::Srgb).expect("valid");
            let drawn = lattice(&picture, [[20.0, 0.0], [0.0, 16.0]]).expect("drawn");
            let Samples::U8(samples) = drawn.samples() else { unreachable!("8-bit") };
            let at = |y: usize, x: usize| &samples[(y * 60 + x) * 3..][..3];
            assert_eq!((drawn.height(), drawn.width(), drawn.channels()), (40, 60, 3));
            for x in [10, 30, 50] {
                assert_eq!(at(10, x), [255, 224, 32], "line in column {x}");
                assert!(at(10, x + 1).iter().all(|&v| v < 140), "rim beside {x}");
            }
            assert_eq!(at(4, 3), [255, 224, 32], "line in row 4");
            assert_eq!(at(10, 20), [shade; 3], "between lines");
        }
    }
}
