//! A tile repeated 3x3 and made small enough to look at: where a seam or a blob shows first.

use crate::base::error::Result;
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::image::picture::{Encoding, Picture, Samples};

/// Repetitions in each direction.
const REPEAT: usize = 3;
/// Longest side of the preview in pixels; what a screen shows at once.
const LONGEST: usize = 2048;

/// The 3x3 tiling of `tile` as an 8-bit picture, averaged down by a whole number (in linear light,
/// if the samples are colours) until its longer side is at most 2048 pixels.
///
/// Alpha is kept; of data with more than four channels the first is shown. Linear colours become
/// sRGB, values outside 0..=1 are clipped.
///
/// # Errors
/// None that a valid tile can cause.
pub(super) fn tiling(tile: &Picture) -> Result<Picture> {
    let (h, w, c) = (tile.height(), tile.width(), tile.channels());
    let by = (REPEAT * h.max(w)).div_ceil(LONGEST);
    // A whole number of blocks per repetition would need a tile side divisible by `by`; instead
    // blocks run on over the border, which is what the tile does as well.
    let (out_h, out_w) = ((REPEAT * h / by).max(1), (REPEAT * w / by).max(1));
    let shown = if c <= 4 { c } else { 1 };
    let alpha = tile.alpha_channel();
    let light: Box<dyn Fn(usize) -> f64> = match tile.samples() {
        Samples::U8(v) if tile.encoding == Encoding::Srgb => {
            let table: Vec<f64> =
                (0..=255).map(|i| linear_from_srgb(f64::from(i) / 255.0)).collect();
            Box::new(move |i| table[v[i] as usize])
        }
        samples if tile.encoding == Encoding::Srgb => {
            Box::new(move |i| linear_from_srgb(samples.unit(i)))
        }
        samples => Box::new(move |i| samples.unit(i)),
    };
    let mut out = Vec::with_capacity(out_h * out_w * shown);
    let mut sum = vec![0.0; shown];
    for y in 0..out_h {
        for x in 0..out_w {
            sum.fill(0.0);
            for yy in y * by..(y + 1) * by {
                for xx in x * by..(x + 1) * by {
                    let at = ((yy % h) * w + xx % w) * c;
                    for (k, sum) in sum.iter_mut().enumerate() {
                        let plain = alpha == Some(k);
                        *sum += if plain { tile.samples().unit(at + k) } else { light(at + k) };
                    }
                }
            }
            for (k, sum) in sum.iter().enumerate() {
                let mean = sum / (by * by) as f64;
                let encoded = if alpha == Some(k) || tile.encoding == Encoding::Data {
                    mean
                } else {
                    srgb_from_linear(mean)
                };
                out.push((encoded.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
            }
        }
    }
    let encoding = if tile.encoding == Encoding::Data { Encoding::Data } else { Encoding::Srgb };
    Picture::new(out_h, out_w, shown, Samples::U8(out), encoding)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_tile_is_repeated_as_it_is() {
        let tile = Picture::new(1, 2, 1, Samples::U8(vec![10, 200]), Encoding::Srgb).expect("tile");
        let tiling = tiling(&tile).expect("tiling");
        assert_eq!((tiling.height(), tiling.width()), (3, 6));
        assert_eq!(tiling.samples(), &Samples::U8([10, 200].repeat(9)));
    }

    #[test]
    fn a_large_tile_is_averaged_in_linear_light() {
        let board = (0..1366 * 1366).map(|i| if (i % 1366 + i / 1366) % 2 == 0 { 0 } else { 255 });
        let tile = Picture::new(1366, 1366, 1, Samples::U8(board.collect()), Encoding::Srgb);
        let tiling = tiling(&tile.expect("tile")).expect("tiling");
        assert!(tiling.height().max(tiling.width()) <= LONGEST, "{}", tiling.height());
        // 1366 * 3 / 2048 > 2, so blocks are 3x3: 4 or 5 of 9 pixels are white.
        let Samples::U8(v) = tiling.samples() else { panic!("8 bits") };
        assert!(v.iter().all(|v| (177..=197).contains(v)), "linear 4/9 and 5/9");
    }
}
