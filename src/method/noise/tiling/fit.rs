//! [`fit`]: the part of a photo that a texture is tiled with.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::image::rect::Rect;
use crate::method::noise::document::Channel;
use crate::method::noise::fit::{Analysis, Exemplar, Fit};
use crate::method::noise::shape::{KNOTS, Shape};
use crate::method::noise::tiling::input::Input;
use crate::method::noise::tiling::table::{Places, Table};
use crate::method::noise::tiling::{Layout, SIDE, halvings};

/// How a photo is tiled and blended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Distance of tiles in pixels; 0 is a fifth of the input's shorter side.
    pub cell: u32,
    /// Power of the blend's weights.
    pub sharpness: u32,
    /// Most pixels of the photo along each side that are kept.
    pub longest: u32,
}

/// Shortest side of an input.
const SHORTEST: usize = 32;

/// The tiles and the histograms of a photo whose channels `analysis` tells.
///
/// # Errors
/// [`Error::TooSmall`] if no part of the photo is large enough; [`Error::Parameter`] for cells that are
/// too large for it; [`Error::Cancelled`].
pub fn fit(
    ctx: &Ctx,
    analysis: &Analysis,
    exemplar: &Exemplar,
    options: Options,
) -> Result<(Fit, Layout)> {
    let mut window = largest(exemplar);
    let (height, width) = (window.height, window.width);
    if height.min(width) < SHORTEST {
        let what = "the largest part of the photo without holes".into();
        let remedy = "mask less of it out, take a larger photo, or fit noise (`wavelet`)".into();
        return Err(Error::TooSmall { what, width, height, need: SHORTEST, remedy });
    }
    let longest = options.longest as usize;
    window = middle(&window, (height.min(longest), width.min(longest)));
    let shorter = window.height.min(window.width) as u32;
    let across = if options.cell == 0 { (shorter / 5).max(8) } else { options.cell };
    let Some((cell, window)) = cells(across, &window) else {
        let most = (0..shorter / 2).rev().find(|across| cells(*across, &window).is_some());
        let expected = format!("at most {} for this photo", most.unwrap_or(0));
        return Err(Error::parameter("cell", expected, options.cell));
    };
    let size = [window.width as u32, window.height as u32];
    let planes = analysis.planes(exemplar);
    let channels: Vec<Channel> = analysis
        .channels()
        .map(|(deviation, histogram)| Channel {
            weights: vec![deviation],
            histogram: histogram.cloned(),
        })
        .collect();
    let normals: Vec<Vec<f32>> = planes
        .iter()
        .zip(&channels)
        .map(|(plane, channel)| normal(plane, channel, exemplar.shape.1, &window))
        .collect();
    let mut layout = Layout {
        cell,
        sharpness: options.sharpness,
        table: Table { choices: vec![[0; 2]; SIDE * SIDE], alike: vec![[0; 3]; SIDE * SIDE] },
        input: Input::new(size, &normals),
    };
    let deviations: Vec<f64> = channels.iter().map(|channel| channel.weights[0]).collect();
    layout.choose(ctx, &deviations, ctx.seed as u32)?;
    Ok((analysis.with_channels(channels), layout))
}

/// Cells about `across` pixels wide, and a window whose sides can be halved as often as they ask for;
/// `None` if that is too small for them.
fn cells(across: u32, window: &Rect) -> Option<([u32; 2], Rect)> {
    let across = across.max(2).next_multiple_of(2);
    let cell = [across, (f64::from(across) * 0.75f64.sqrt()).round() as u32];
    let whole = 1 << halvings(cell);
    let window = middle(window, (window.height / whole * whole, window.width / whole * whole));
    Places::new([window.width as u32, window.height as u32], cell).map(|_| (cell, window))
}

/// The middle of a rectangle.
fn middle(window: &Rect, (height, width): (usize, usize)) -> Rect {
    let y = window.y + (window.height - height) / 2;
    let x = window.x + (window.width - width) / 2;
    Rect { y, x, height, width }
}

/// The largest rectangle of usable pixels; of equal ones the first.
fn largest(exemplar: &Exemplar) -> Rect {
    let (rows, cols) = exemplar.shape;
    let mut best = Rect { y: 0, x: 0, height: 0, width: 0 };
    // Usable pixels above each column's, and it.
    let mut heights = vec![0usize; cols];
    for y in 0..rows {
        for (x, height) in heights.iter_mut().enumerate() {
            *height = if exemplar.counts(y * cols + x) { *height + 1 } else { 0 };
        }
        // Columns where a rectangle begins, by rising heights.
        let mut open: Vec<(usize, usize)> = Vec::new();
        for x in 0..=cols {
            let height = heights.get(x).copied().unwrap_or(0);
            let mut first = x;
            while let Some((from, tall)) = open.pop_if(|(_, tall)| *tall >= height) {
                if tall * (x - from) > best.height * best.width {
                    best = Rect { y: y + 1 - tall, x: from, height: tall, width: x - from };
                }
                first = from;
            }
            if height > 0 {
                open.push((first, height));
            }
        }
    }
    best
}

/// A channel's part in the window as standard normal numbers: what its histogram makes its values of.
fn normal(plane: &[f32], channel: &Channel, cols: usize, window: &Rect) -> Vec<f32> {
    const STEPS: usize = 8192;
    let deviation = channel.weights[0] as f32;
    let table: Option<Vec<f32>> = channel.histogram.as_ref().map(|values| {
        let shape = Shape::new(&std::array::from_fn(|i| values[i]));
        (0..=STEPS).map(|i| shape.at(place(i as f32, STEPS))).collect()
    });
    let of = |value: f32| match &table {
        None => value / deviation,
        Some(table) => {
            let above = table.partition_point(|&t| t < value).clamp(1, STEPS);
            let (low, high) = (table[above - 1], table[above]);
            let part =
                if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
            place((above - 1) as f32 + part, STEPS)
        }
    };
    let rows: Vec<usize> = (window.y..window.y + window.height).collect();
    let row = |&y: &usize| {
        plane[y * cols + window.x..][..window.width].iter().map(|&v| of(v)).collect::<Vec<f32>>()
    };
    rows.par_iter().map(row).flatten_iter().collect()
}

/// Standard deviations at a step between the first and the last knot.
fn place(step: f32, steps: usize) -> f32 {
    let [first, last] = [KNOTS[0], KNOTS[KNOTS.len() - 1]].map(|u| u as f32);
    first + (last - first) * (step / steps as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_largest_rectangle_is_as_large_as_any(
            (cols, usable) in (1usize..9).prop_flat_map(|cols| {
                let rows = 1usize..8;
                let pixels = rows.prop_flat_map(move |rows| prop::collection::vec(prop::bool::weighted(0.7), rows * cols));
                (Just(cols), pixels)
            })
        ) {
            let rows = usable.len() / cols;
            let exemplar = Exemplar { planes: &[], shape: (rows, cols), usable: Some(&usable) };
            let found = largest(&exemplar);
            let whole = |y: usize, x: usize, h: usize, w: usize| {
                (y..y + h).all(|y| (x..x + w).all(|x| usable[y * cols + x]))
            };
            prop_assert!(whole(found.y, found.x, found.height, found.width));
            let mut most = 0;
            for y in 0..rows {
                for x in 0..cols {
                    for h in 1..=rows - y {
                        for w in 1..=cols - x {
                            if whole(y, x, h, w) {
                                most = most.max(h * w);
                            }
                        }
                    }
                }
            }
            prop_assert_eq!(found.height * found.width, most);
        }
    }
}
