//! Tiles repeated and made small enough to look at: where a seam or a blob shows first.

use crate::base::error::{Error, Result};
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::image::picture::{Encoding, Picture, Samples};

/// Space between cells and the height of their bars, in pixels.
const GAP: usize = 16;

/// `tile` repeated `repeat` times in each direction as an 8-bit picture, averaged down by a whole
/// number (in linear light, if the samples are colours) until its longer side is at most `longest`
/// pixels.
///
/// Alpha is kept; of data with more than four channels the first is shown. Linear colours become
/// sRGB, values outside 0..=1 are clipped.
///
/// # Errors
/// None that a valid tile can cause.
pub fn repeated(tile: &Picture, repeat: usize, longest: usize) -> Result<Picture> {
    let (h, w, c) = (tile.height(), tile.width(), tile.channels());
    let by = (repeat * h.max(w)).div_ceil(longest);
    // A whole number of blocks per repetition would need a tile side divisible by `by`; instead
    // blocks run on over the border, which is what the tile does as well.
    let (out_h, out_w) = ((repeat * h / by).max(1), (repeat * w / by).max(1));
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

/// A picture of a [`row`].
#[derive(Debug, Clone)]
pub struct Cell {
    /// The picture, 8 bits a sample.
    pub picture: Picture,
    /// Length of the bar under it, as a share of its width.
    pub share: f32,
}

/// Pictures side by side on white, each over a bar.
///
/// # Errors
/// [`Error::BadPicture`](crate::Error::BadPicture) unless all are 8-bit pictures of one size and
/// number of channels.
pub fn row(cells: &[Cell]) -> Result<Picture> {
    let first = &cells[0].picture;
    let (h, w, c) = (first.height(), first.width(), first.channels());
    let (height, width) = (h + 4 * GAP, cells.len() * (w + GAP) + GAP);
    let mut out = vec![u8::MAX; height * width * c];
    let alpha = first.alpha_channel();
    for (i, Cell { picture, share }) in cells.iter().enumerate() {
        picture.ensure_like(first, "a cell")?;
        let Samples::U8(samples) = picture.samples() else {
            let reason = "a sheet is made of 8-bit pictures".to_owned();
            return Err(Error::BadPicture { what: "cell".into(), reason });
        };
        let left = GAP + i * (w + GAP);
        for (y, line) in samples.chunks_exact(w * c).enumerate() {
            out[((GAP + y) * width + left) * c..][..w * c].copy_from_slice(line);
        }
        let filled = (f64::from(*share) * w as f64).round() as usize;
        for y in 2 * GAP + h..3 * GAP + h {
            for x in 0..w {
                // Black as far as the share goes, a light grey beyond.
                let shade = if x < filled { 0 } else { 224 };
                let px = &mut out[(y * width + left + x) * c..][..c];
                (0..c).filter(|&k| alpha != Some(k)).for_each(|k| px[k] = shade);
            }
        }
    }
    Picture::new(height, width, c, Samples::U8(out), first.encoding)
}

/// Pictures in rows and columns on white, each column as wide as its widest picture, each row as high
/// as its highest.
///
/// # Errors
/// [`Error::BadPicture`](crate::Error::BadPicture) unless there is a picture and all are 8-bit ones
/// of one number of channels.
pub fn grid(rows: &[Vec<Picture>]) -> Result<Picture> {
    let bad = |reason: &str| Error::BadPicture { what: "cell".into(), reason: reason.into() };
    let all = || rows.iter().flatten();
    let first = all().next().ok_or_else(|| bad("a sheet needs one"))?;
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widest = |i: usize| rows.iter().filter_map(|r| r.get(i)).map(Picture::width).max();
    let widths: Vec<usize> = (0..columns).map(|i| widest(i).unwrap_or(0)).collect();
    let heights: Vec<usize> =
        rows.iter().map(|r| r.iter().map(Picture::height).max().unwrap_or(0)).collect();
    let length = |sides: &[usize]| sides.iter().map(|side| side + GAP).sum::<usize>() + GAP;
    let (height, width, c) = (length(&heights), length(&widths), first.channels());
    let mut out = vec![u8::MAX; height * width * c];
    for (i, row) in rows.iter().enumerate() {
        for (j, picture) in row.iter().enumerate() {
            picture.ensure_like(first, "a cell")?;
            let Samples::U8(samples) = picture.samples() else {
                return Err(bad("a sheet is made of 8-bit pictures"));
            };
            let (top, left) = (length(&heights[..i]), length(&widths[..j]));
            let line = picture.width() * c;
            for (y, from) in samples.chunks_exact(line).enumerate() {
                out[((top + y) * width + left) * c..][..line].copy_from_slice(from);
            }
        }
    }
    Picture::new(height, width, c, Samples::U8(out), first.encoding)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_tile_is_repeated_as_it_is() {
        let tile = Picture::new(1, 2, 1, Samples::U8(vec![10, 200]), Encoding::Srgb).expect("tile");
        let tiling = repeated(&tile, 3, 2048).expect("tiling");
        assert_eq!((tiling.height(), tiling.width()), (3, 6));
        assert_eq!(tiling.samples(), &Samples::U8([10, 200].repeat(9)));
    }

    #[test]
    fn a_large_tile_is_averaged_in_linear_light() {
        let board = (0..1366 * 1366).map(|i| if (i % 1366 + i / 1366) % 2 == 0 { 0 } else { 255 });
        let tile = Picture::new(1366, 1366, 1, Samples::U8(board.collect()), Encoding::Srgb);
        let tiling = repeated(&tile.expect("tile"), 3, 2048).expect("tiling");
        assert!(tiling.height().max(tiling.width()) <= 2048, "{}", tiling.height());
        // 1366 * 3 / 2048 > 2, so blocks are 3x3: 4 or 5 of 9 pixels are white.
        let Samples::U8(v) = tiling.samples() else { panic!("8 bits") };
        assert!(v.iter().all(|v| (177..=197).contains(v)), "linear 4/9 and 5/9");
    }

    #[test]
    fn a_row_shows_all_cells_and_their_shares() {
        let cell = |v: u8, share| {
            let picture = Picture::new(2, 4, 1, Samples::U8(vec![v; 8]), Encoding::Srgb);
            Cell { picture: picture.expect("cell"), share }
        };
        let sheet = row(&[cell(10, 0.0), cell(20, 0.5)]).expect("sheet");
        assert_eq!((sheet.height(), sheet.width()), (2 + 4 * GAP, 2 * 4 + 3 * GAP));
        let Samples::U8(v) = sheet.samples() else { panic!("8 bits") };
        let at = |y: usize, x: usize| v[y * sheet.width() + x];
        assert_eq!([at(0, 0), at(GAP, GAP), at(GAP, 2 * GAP + 4)], [255, 10, 20]);
        let bar = |x: usize| at(2 + 2 * GAP, x);
        let second = 2 * GAP + 4;
        assert_eq!([bar(GAP), bar(second), bar(second + 1), bar(second + 2)], [224, 0, 0, 224]);
    }

    #[test]
    fn a_grid_has_room_for_the_largest_of_each_row_and_column() {
        let cell = |h: usize, w: usize, v: u8| {
            Picture::new(h, w, 1, Samples::U8(vec![v; h * w]), Encoding::Srgb).expect("cell")
        };
        let rows = [vec![cell(2, 3, 1), cell(4, 1, 2)], vec![cell(1, 5, 3)]];
        let sheet = grid(&rows).expect("sheet");
        assert_eq!((sheet.height(), sheet.width()), (4 + 1 + 3 * GAP, 5 + 1 + 3 * GAP));
        let Samples::U8(v) = sheet.samples() else { panic!("8 bits") };
        let at = |y: usize, x: usize| v[y * sheet.width() + x];
        assert_eq!([at(GAP, GAP), at(GAP + 2, GAP), at(GAP, GAP + 3)], [1, 255, 255]);
        assert_eq!([at(GAP + 3, 2 * GAP + 5), at(2 * GAP + 4, GAP + 4)], [2, 3]);
        assert!(grid(&[]).is_err());
    }
}
