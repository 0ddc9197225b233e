//! Texture cost: how much a texture looks like its exemplar.

use rayon::prelude::*;

use crate::image::color::ColorModel;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::search::patchmatch::Wrap;

/// Mean squared distance per patch pixel (L*a*b* units squared) between the patches of a texture
/// and the patches of `photos` that `map` names for their centres: an upper bound of the texture
/// cost, which takes the best patch of the whole photo. `colors` are the texture's, to match (see
/// [`ColorModel::matching_pixels`]), one a pixel of `map`.
///
/// The mean is over an even grid of at most 16384 patches. Patches at the photo's border are moved
/// inside; on an axis that does not wrap, only whole patches of the texture count.
///
/// # Paper
/// Moritz et al. 2017, eq. 5.
///
/// # Determinism
/// Same bytes for any thread count.
pub fn cost_bound(
    colors: &[[f32; 3]],
    photos: &[&Picture],
    map: &SourceMap,
    patch: usize,
    wrap: Wrap,
) -> f64 {
    let model = ColorModel::new(photos[0]);
    let (h, w) = (map.height(), map.width());
    assert_eq!(colors.len(), h * w, "colors do not fill the texture");
    let half = (patch / 2) as isize;
    let step = ((h * w) as f64 / 16384.0).sqrt().ceil().max(1.0) as usize;
    let inside = |i: usize, n: usize, wrap: bool| {
        wrap || (i as isize >= half && i as isize + half < n as isize)
    };
    let rows: Vec<usize> = (0..h).step_by(step).filter(|&y| inside(y, h, wrap.y)).collect();
    let cols: Vec<usize> = (0..w).step_by(step).filter(|&x| inside(x, w, wrap.x)).collect();
    let fit = |i: usize, n: usize| (i as isize).clamp(half, n as isize - 1 - half);
    let per_row: Vec<f64> = rows
        .par_iter()
        .map(|&y| {
            let mut sum = 0.0;
            for &x in &cols {
                let origin = map.origin(y * w + x);
                let photo = photos[usize::from(origin.photo)];
                let size = (photo.height(), photo.width());
                // In the photo as it was laid.
                let [sy, sx] = map.positions()[y * w + x].map(|i| i as usize);
                let (sy, sx) = origin.symmetry.place((sy, sx), size);
                let (eh, ew) = origin.symmetry.size(size);
                let (sy, sx) = (fit(sy, eh), fit(sx, ew));
                for dy in -half..=half {
                    for dx in -half..=half {
                        let ty = (y as isize + dy).rem_euclid(h as isize) as usize;
                        let tx = (x as isize + dx).rem_euclid(w as isize) as usize;
                        let laid = ((sy + dy) as usize, (sx + dx) as usize);
                        let (py, px) = origin.symmetry.source(laid, size);
                        // The same source pixel: no need to look at its colour.
                        let same_photo = map.origin(ty * w + tx).photo == origin.photo;
                        if same_photo && map.positions()[ty * w + tx] == [py as u32, px as u32] {
                            continue;
                        }
                        let f = colors[ty * w + tx];
                        let e = model.matching_pixel(photo, py * size.1 + px);
                        sum += (0..3).map(|k| ((f[k] - e[k]) as f64).powi(2)).sum::<f64>();
                    }
                }
            }
            sum
        })
        .collect();
    let n = rows.len() * cols.len() * patch * patch;
    if n == 0 { 0.0 } else { per_row.iter().sum::<f64>() / n as f64 }
}
