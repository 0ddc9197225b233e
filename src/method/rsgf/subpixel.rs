//! Where between pixels a gap's patch agrees best with its neighbours.

use crate::image::interpolate::{PARTS, REACH, taps};
use crate::method::rsgf::grid::Lenses;
use crate::method::rsgf::pixels;
use crate::method::rsgf::places::Offset;
use crate::search::patch::MatchImage;

/// How often the vertex of a parabola is gone to. The second time it is near, where costs are one.
const ROUNDS: usize = 2;

/// The place of a gap's window, at most half a pixel a round beside `place`, where it differs least from
/// its neighbours, whose windows are at `around`, in the order of their sides. All are read between pixels;
/// the five that a parabola goes through lie whole pixels apart, as they are equally sharp then.
pub(super) fn refined(
    image: &MatchImage,
    lenses: &Lenses,
    around: &[Offset; 4],
    place: Offset,
) -> Offset {
    let (height, width) = lenses.window();
    let neighbours = around.map(|corner| window(image, corner, (height, width)));
    let of_frame = |(y, x)| {
        let (side, _) = lenses.at((y, x))?;
        Some((y, x, neighbours[side as usize][y * width + x]))
    };
    let wanted: Vec<(usize, usize, [f32; 4])> =
        pixels((height, width)).filter_map(of_frame).collect();
    let mut place = place;
    for _ in 0..ROUNDS {
        // A pixel more on all sides.
        let there = window(image, place.map(|v| v - PARTS), (height + 2, width + 2));
        let cost = |dy: usize, dx: usize| -> f64 {
            let difference = |&(y, x, wanted): &(usize, usize, [f32; 4])| {
                let own = there[(y + dy) * (width + 2) + x + dx];
                (0..3).map(|k| f64::from(own[k] - wanted[k]).powi(2)).sum::<f64>()
            };
            wanted.iter().map(difference).sum()
        };
        let here = cost(1, 1);
        let vertex = |before: f64, after: f64| {
            let bend = before + after - 2.0 * here;
            let at = if bend > 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
            (at.clamp(-0.5, 0.5) * PARTS as f64).round() as i64
        };
        place[0] += vertex(cost(0, 1), cost(2, 1));
        place[1] += vertex(cost(1, 0), cost(1, 2));
    }
    place
}

/// The codes of a window of `height` x `width` pixels at a place between pixels; beyond the edge the edge
/// goes on.
fn window(image: &MatchImage, place: Offset, (height, width): (usize, usize)) -> Vec<[f32; 4]> {
    let ((top, down), (left, across)) = (taps(place[0]), taps(place[1]));
    let inside = |v: i64, n: usize| v.clamp(0, n as i64 - 1) as usize;
    let added = |sum: &mut [f32; 4], weight: f64, of: [f32; 4]| {
        sum.iter_mut().zip(of).for_each(|(sum, v)| *sum += weight as f32 * v);
    };
    let rows = height + 2 * REACH - 1;
    let mut lines = vec![[0.0; 4]; rows * width];
    for (i, line) in lines.chunks_exact_mut(width).enumerate() {
        let y = inside(top + i as i64, image.height());
        for (x, sum) in line.iter_mut().enumerate() {
            for (j, &weight) in across.iter().enumerate() {
                let x = inside(left + (x + j) as i64, image.width());
                added(sum, weight, image.pixel(y, x).map(f32::from));
            }
        }
    }
    let mut out = vec![[0.0; 4]; height * width];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        for (i, &weight) in down.iter().enumerate() {
            let line = &lines[(y + i) * width..][..width];
            out.iter_mut().zip(line).for_each(|(sum, v)| added(sum, weight, *v));
        }
    }
    out
}
