//! The edges of a picture, as a picture.

use rayon::prelude::*;

use crate::base::error::Result;
use crate::image::mask::Mask;
use crate::signal::resample::{resized, resized_mask};

/// What the edges' direction counts beside their strength.
const DIRECTION: f32 = 0.5;

/// Edges of a picture reduced to an area.
pub(super) struct Edges {
    /// What [`edge`] makes of each pixel's surroundings.
    pub(super) pixels: Vec<[f32; 3]>,
    /// Where all pixels that a gradient is of count.
    pub(super) usable: Option<Mask>,
}

impl Edges {
    /// Those of a picture of `from` pixels, `usable` of which count, reduced to `size`.
    ///
    /// Bricks and setts of many colors repeat by their joints: the colors on both sides differ from stone
    /// to stone; that there is an edge does not.
    pub(super) fn new(
        pixels: &[[f32; 3]],
        from: (usize, usize),
        usable: Option<&Mask>,
        size @ (h, w): (usize, usize),
    ) -> Result<Self> {
        let small = blurred(&resized(pixels, from, size), size);
        let mut edges = vec![[0.0; 3]; h * w];
        edges.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            let rows = near(y, h).map(|y| &small[y * w..][..w]);
            for (x, to) in row.iter_mut().enumerate() {
                *to = edge(near(x, w), rows);
            }
        });
        let usable = usable.map(|mask| {
            let unusable = resized_mask(mask.usable(), from, size).iter().map(|ok| !ok).collect();
            // An edge is of a pixel's neighbors too, and of theirs.
            Ok(Mask::new(h, w, unusable)?.clear_of(3))
        });
        Ok(Self { pixels: edges, usable: usable.transpose()? })
    }
}

/// The positions before, at and after, the last one at an end twice.
fn near(i: usize, n: usize) -> [usize; 3] {
    [i.saturating_sub(1), i, (i + 1).min(n - 1)]
}

/// Half a pixel out of focus: steps of whole pixels in a drawing are no edges of their own.
fn blurred(picture: &[[f32; 3]], (h, w): (usize, usize)) -> Vec<[f32; 3]> {
    let mean = |of: [[f32; 3]; 3]| {
        std::array::from_fn(|k| 0.75 * of[1][k] + 0.125 * (of[0][k] + of[2][k]))
    };
    let blur = |picture: &[[f32; 3]], at: &(dyn Fn(usize, usize) -> [usize; 3] + Sync)| {
        let mut to = vec![[0.0; 3]; h * w];
        to.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            for (x, to) in row.iter_mut().enumerate() {
                *to = mean(at(y, x).map(|i| picture[i]));
            }
        });
        to
    };
    let across = blur(picture, &|y, x| near(x, w).map(|x| y * w + x));
    blur(&across, &|y, x| near(y, h).map(|y| y * w + x))
}

/// The strength of the edge, and its direction as that of twice the angle: one from dark to light is as
/// one from light to dark.
fn edge(columns: [usize; 3], rows: [&[[f32; 3]]; 3]) -> [f32; 3] {
    // Scharr's differences: as long in all directions.
    const ACROSS: [f32; 3] = [3.0 / 16.0, 10.0 / 16.0, 3.0 / 16.0];
    let (mut squares, mut diagonal, mut slanted) = (0.0f32, 0.0f32, 0.0f32);
    let window = rows.map(|row| columns.map(|x| row[x]));
    for channel in [0, 1, 2] {
        let at = |y: usize, x: usize| window[y][x][channel];
        let (mut dx, mut dy) = (0.0, 0.0);
        for (i, weight) in ACROSS.into_iter().enumerate() {
            dx += weight * (at(i, 2) - at(i, 0));
            dy += weight * (at(2, i) - at(0, i));
        }
        squares += dx * dx + dy * dy;
        diagonal += dx * dx - dy * dy;
        slanted += 2.0 * dx * dy;
    }
    if squares <= f32::MIN_POSITIVE {
        return [0.0; 3];
    }
    // The root of the contrast: edges of pale bricks count nearly as those of dark ones.
    let strength = squares.sqrt().sqrt();
    let share = DIRECTION * strength / squares;
    [strength, share * diagonal, share * slanted]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dark left of a line through the middle, light right of it.
    fn step(degrees: f64, dark: f32, light: f32) -> Vec<[f32; 3]> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let side = |i: usize| {
            let (y, x) = ((i / 41) as f64 - 20.0, (i % 41) as f64 - 20.0);
            // A ramp as wide as what the middle's edge is of.
            (0.5 + 0.15 * (x * cos + y * sin)).clamp(0.0, 1.0) as f32
        };
        (0..41 * 41).map(|i| [dark + (light - dark) * side(i); 3]).collect()
    }

    fn middle(picture: &[[f32; 3]]) -> [f32; 3] {
        let edges = Edges::new(picture, (41, 41), None, (41, 41)).expect("edges");
        edges.pixels[20 * 41 + 20]
    }

    #[test]
    fn an_edge_has_a_strength_and_the_direction_of_twice_its_angle() {
        let upright = middle(&step(0.0, 0.2, 0.6));
        for degrees in [0.0, 30.0, 45.0, 90.0, 120.0] {
            let [strength, across, slanted] = middle(&step(degrees, 0.2, 0.6));
            assert!(
                (strength / upright[0] - 1.0).abs() < 0.05,
                "{degrees}: {strength} {upright:?}"
            );
            let (sin, cos) = (2.0 * degrees).to_radians().sin_cos();
            let want = [cos, sin].map(|v| DIRECTION * strength * v as f32);
            let off = (across - want[0]).abs().max((slanted - want[1]).abs());
            assert!(off < 0.04 * strength, "{degrees}: {across} {slanted} {want:?}");
        }
    }

    #[test]
    fn an_edge_is_the_same_from_either_side_and_counts_by_the_root_of_its_contrast() {
        let (edge, back) = (middle(&step(60.0, 0.2, 0.6)), middle(&step(60.0, 0.6, 0.2)));
        let fourth = middle(&step(60.0, 0.2, 0.3));
        for k in 0..3 {
            assert!((edge[k] - back[k]).abs() < 1e-5, "{edge:?} {back:?}");
            assert!((edge[k] - 2.0 * fourth[k]).abs() < 1e-3, "{edge:?} {fourth:?}");
        }
    }

    #[test]
    fn what_does_not_count_makes_no_edges() {
        let mut picture = vec![[0.5; 3]; 41 * 41];
        let mut usable = vec![true; 41 * 41];
        (0..3).for_each(|i| picture[(20 + i) * 41 + 20] = [9.0; 3]);
        (0..3).for_each(|i| usable[(20 + i) * 41 + 20] = false);
        let mask = Mask::new(41, 41, usable).expect("mask");
        let edges = Edges::new(&picture, (41, 41), Some(&mask), (41, 41)).expect("edges");
        let usable = edges.usable.expect("a mask");
        // The filter that reduces a picture ends at the neighbors, so they do not count either.
        let away = |i: usize| {
            let (y, x) = ((i / 41) as i32, (i % 41) as i32);
            let off = |v: i32, from: i32, to: i32| (from - v).max(v - to).max(0).pow(2);
            off(y, 19, 23) + off(x, 19, 21) > 9
        };
        for (i, &ok) in usable.usable().iter().enumerate() {
            assert_eq!(ok, away(i), "row {}, column {}", i / 41, i % 41);
        }
        assert!(edges.pixels.iter().zip(usable.usable()).all(|(px, ok)| !ok || *px == [0.0; 3]));
    }
}
