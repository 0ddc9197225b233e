//! Gap deformation: a patch is bent by a few pixels so that lines meet those of its neighbours.

use crate::image::interpolate::{PARTS, nearest};
use crate::method::rsgf::grid::{Lenses, Side};
use crate::method::rsgf::{Place, pixels};
use crate::search::patch::MatchImage;

/// Distance of the points along a side at which displacements are chosen, in pixels. Nearer ones tear
/// grain apart, farther ones miss a mortar line.
const SPACING: usize = 8;

/// What a displacement by a pixel costs, and one that differs by a pixel from the next point's: squared
/// codes a pixel compared. Less follows noise.
const COST: f64 = 6.0;
const BEND: f64 = 32.0;

/// A pixel, in what places are counted in.
const PIXEL: i32 = PARTS as i32;

/// A displacement in pixels: rows, columns.
type Shift = [i32; 2];

/// The places of the gap's patch at all pixels of its window, moved by at most `most` rows and columns
/// from those that begin at `corner`: along every side such that the patch agrees best with what is
/// there (`old`), fading to none in the middle and at the corners.
///
/// The displacements along a side are the best of all sequences, by dynamic programming.
pub(super) fn bent(
    image: &MatchImage,
    lenses: &Lenses,
    corner: Place,
    old: &[Place],
    most: usize,
) -> Vec<Place> {
    let straight =
        |(y, x): (usize, usize)| [corner[0] + y as i32 * PIXEL, corner[1] + x as i32 * PIXEL];
    if most == 0 {
        return pixels(lenses.window()).map(straight).collect();
    }
    let shifts: Vec<Vec<Shift>> = Side::ALL
        .iter()
        .map(|&side| along_side(image, lenses, side, corner, old, most as i32))
        .collect();
    let (height, width) = lenses.size;
    let b = lenses.border as f64;
    let middle = 0.5 * height.min(width) as f64;
    let bend = |(y, x): (usize, usize)| {
        let (fy, fx) = (y as f64 + 0.5 - b, x as f64 + 0.5 - b);
        let mut sum = [0.0; 2];
        for (&side, shifts) in Side::ALL.iter().zip(&shifts) {
            let (depth, along) = match side {
                Side::Top => (fy, fx),
                Side::Left => (fx, fy),
                Side::Right => (width as f64 - fx, fy),
                Side::Bottom => (height as f64 - fy, fx),
            };
            let weight = (1.0 - depth.max(0.0) / middle).max(0.0);
            let at = (along / SPACING as f64 - 0.5).clamp(-1.0, shifts.len() as f64);
            let low = at.floor();
            // At the corners, before the first point and after the last, it is none.
            let point = |i: f64| match usize::try_from(i as i64) {
                Ok(i) if i < shifts.len() => shifts[i].map(f64::from),
                _ => [0.0; 2],
            };
            let (here, next) = (point(low), point(low + 1.0));
            for k in 0..2 {
                sum[k] += weight * (here[k] + (next[k] - here[k]) * (at - low));
            }
        }
        let [y, x] = straight((y, x));
        let limit = |v: f64| (v.round() as i32).clamp(-(most as i32), most as i32);
        [y + limit(sum[0]) * PIXEL, x + limit(sum[1]) * PIXEL]
    };
    pixels(lenses.window()).map(bend).collect()
}

/// The best displacement at every point along a side.
fn along_side(
    image: &MatchImage,
    lenses: &Lenses,
    side: Side,
    corner: Place,
    old: &[Place],
    most: i32,
) -> Vec<Shift> {
    let stride = lenses.window().1;
    let (height, width) = lenses.size;
    let length = if matches!(side, Side::Top | Side::Bottom) { width } else { height };
    let points = length / SPACING;
    let all: Vec<Shift> =
        (-most..=most).flat_map(|dy| (-most..=most).map(move |dx| [dy, dx])).collect();
    // The pixels of the lens that belong to each point.
    let mut near: Vec<Vec<(usize, usize)>> = vec![Vec::new(); points];
    for (y, x) in pixels(lenses.window()) {
        if lenses.at((y, x)).is_some_and(|(of, _)| of == side) {
            let along =
                if length == width && matches!(side, Side::Top | Side::Bottom) { x } else { y };
            if let Some(near) = near.get_mut((along - lenses.border) / SPACING) {
                near.push((y, x));
            }
        }
    }
    let pixel = |place: Place| {
        let [y, x] = place.map(|v| nearest(v.into()) as usize);
        image.pixel(y, x)
    };
    let squared = |(y, x): (usize, usize), [dy, dx]: Shift| -> u32 {
        let (y_moved, x_moved) = (y as i32 + dy, x as i32 + dx);
        let a = pixel([corner[0] + y_moved * PIXEL, corner[1] + x_moved * PIXEL]);
        let b = pixel(old[y * stride + x]);
        a.iter().zip(b).map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
    };
    let apart = |a: Shift, b: Shift| f64::from((a[0] - b[0]).pow(2) + (a[1] - b[1]).pow(2));
    // Viterbi: the least sum up to each displacement of a point, and where it came from.
    let mut sums: Vec<f64> = all.iter().map(|&s| BEND * apart(s, [0; 2])).collect();
    let mut came: Vec<Vec<usize>> = Vec::with_capacity(points);
    for near in &near {
        let n = near.len().max(1) as f64;
        let own = |s: Shift| {
            let sum: u32 = near.iter().map(|&at| squared(at, s)).sum();
            f64::from(sum) / n + COST * apart(s, [0; 2])
        };
        let (mut next, mut from) = (Vec::with_capacity(all.len()), Vec::with_capacity(all.len()));
        for &shift in &all {
            let to = |i: usize| {
                sums[i] + if came.is_empty() { 0.0 } else { BEND * apart(all[i], shift) }
            };
            let best = if came.is_empty() {
                all.iter().position(|&s| s == shift).unwrap_or(0)
            } else {
                (0..all.len()).fold(0, |best, i| if to(i) < to(best) { i } else { best })
            };
            next.push(to(best) + own(shift));
            from.push(best);
        }
        sums = next;
        came.push(from);
    }
    let end = |i: usize| sums[i] + BEND * apart(all[i], [0; 2]);
    let mut at = (0..all.len()).fold(0, |best, i| if end(i) < end(best) { i } else { best });
    let mut shifts = vec![[0; 2]; points];
    for (point, from) in came.iter().enumerate().rev() {
        shifts[point] = all[at];
        at = from[at];
    }
    shifts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;

    const CORNER: Place = [14 * PIXEL, 16 * PIXEL];

    /// Noise, and what lies around a gap: the same noise, `off` elsewhere.
    fn example(off: Shift) -> (MatchImage, Lenses, Vec<Place>) {
        let mut image = MatchImage::new(64, 64);
        image.fill_rows(|y, row| {
            for (x, px) in row.iter_mut().enumerate() {
                let mut rng = Rng::new(3, 0, (y / 2) as u32, (x / 2) as u64);
                *px = [rng.below(128) as u8, rng.below(128) as u8, 0, 0];
            }
        });
        let lenses = Lenses { size: (16, 24), border: 6 };
        let old = pixels(lenses.window())
            .map(|(y, x)| [14 + y as i32 + off[0], 16 + x as i32 + off[1]].map(|v| v * PIXEL))
            .collect();
        (image, lenses, old)
    }

    /// The cost of a sequence of displacements along the top, by its definition.
    fn cost(image: &MatchImage, lenses: &Lenses, old: &[Place], shifts: &[Shift]) -> f64 {
        let apart = |a: Shift, b: Shift| f64::from((a[0] - b[0]).pow(2) + (a[1] - b[1]).pow(2));
        let mut sum = 0.0;
        for (point, &[dy, dx]) in shifts.iter().enumerate() {
            let (mut squares, mut n) = (0, 0);
            for (y, x) in pixels(lenses.window()) {
                let own = lenses.at((y, x)).is_some_and(|(side, _)| side == Side::Top);
                if !own || (x - 6) / SPACING != point {
                    continue;
                }
                let a = image.pixel((14 + y as i32 + dy) as usize, (16 + x as i32 + dx) as usize);
                let [oy, ox] = old[y * 36 + x].map(|v| v / PIXEL);
                let b = image.pixel(oy as usize, ox as usize);
                squares += (0..4).map(|k| u32::from(a[k].abs_diff(b[k])).pow(2)).sum::<u32>();
                n += 1;
            }
            sum += f64::from(squares) / f64::from(n) + COST * apart([dy, dx], [0; 2]);
            let before = if point == 0 { [0; 2] } else { shifts[point - 1] };
            sum += BEND * apart([dy, dx], before);
        }
        sum + BEND * apart(*shifts.last().expect("a point"), [0; 2])
    }

    #[test]
    fn no_sequence_of_displacements_is_better() {
        for off in [[0, 0], [1, 0], [0, -1], [1, 1]] {
            let (image, lenses, old) = example(off);
            let found = along_side(&image, &lenses, Side::Top, CORNER, &old, 1);
            let one = |i: usize| [(i / 3) as i32 - 1, (i % 3) as i32 - 1];
            let all = (0..9 * 9 * 9).map(|i| [one(i / 81), one(i / 9 % 9), one(i % 9)]);
            let least = all.map(|s| cost(&image, &lenses, &old, &s)).fold(f64::MAX, f64::min);
            assert!(
                (cost(&image, &lenses, &old, &found) - least).abs() < 1e-6,
                "{off:?}: {found:?}"
            );
            if off == [0, -1] {
                assert_eq!(found, [off; 3], "the noise is where it was moved to");
            }
        }
    }

    #[test]
    fn a_patch_is_bent_at_its_sides_and_not_in_the_middle() {
        let (image, lenses, old) = example([0, -1]);
        let straight = bent(&image, &lenses, CORNER, &old, 0);
        let bent = bent(&image, &lenses, CORNER, &old, 2);
        let moved = |y: usize, x: usize| {
            let i = y * 36 + x;
            [bent[i][0] - straight[i][0], bent[i][1] - straight[i][1]].map(|v| v / PIXEL)
        };
        assert_eq!((moved(14, 18), moved(6, 18), moved(0, 0)), ([0, 0], [0, -1], [0, 0]));
        assert!(
            bent.iter()
                .zip(&straight)
                .all(|(a, b)| a[0] == b[0] && (a[1] - b[1]).abs() <= 2 * PIXEL)
        );
    }
}
