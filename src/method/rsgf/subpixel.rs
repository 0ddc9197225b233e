//! Where between pixels a gap's patch agrees best with its neighbours.

use crate::image::interpolate::{PARTS, REACH, taps};
use crate::method::rsgf::grid::{Lenses, Side};
use crate::method::rsgf::pixels;
use crate::method::rsgf::places::Offset;
use crate::search::patch::MatchImage;

/// How often the vertex of a paraboloid is gone to. The second time it is near, where costs are one.
const ROUNDS: usize = 2;

/// The place of a gap's window, at most half a pixel a round beside `place`, where it differs least from
/// its neighbours, whose windows are at `around`, in the order of their sides. All are read between pixels;
/// the nine that the paraboloid goes through lie whole pixels apart, as they are equally sharp then.
pub(super) fn refined(
    image: &MatchImage,
    lenses: &Lenses,
    around: &[Offset; 4],
    place: Offset,
) -> Offset {
    let (height, width) = lenses.window();
    let reach = 2 * lenses.border;
    let neighbours = Side::ALL.map(|side| {
        // What of the window its lens lies in.
        let (top, left, size) = match side {
            Side::Top => (0, 0, (reach, width)),
            Side::Left => (0, 0, (height, reach)),
            Side::Right => (0, width - reach, (height, reach)),
            Side::Bottom => (height - reach, 0, (reach, width)),
        };
        let [y, x] = around[side as usize];
        let corner = [y + top as i64 * PARTS, x + left as i64 * PARTS];
        (top, left, size.1, window(image, corner, size))
    });
    let of_frame = |(y, x)| {
        let (side, _) = lenses.at((y, x))?;
        let (top, left, stride, codes) = &neighbours[side as usize];
        Some((y, x, codes[(y - top) * stride + x - left]))
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
        let c = [0, 1, 2].map(|dy| [0, 1, 2].map(|dx| cost(dy, dx)));
        // Slopes and bends of the paraboloid.
        let (y, x) = (0.5 * (c[2][1] - c[0][1]), 0.5 * (c[1][2] - c[1][0]));
        let yy = c[0][1] + c[2][1] - 2.0 * c[1][1];
        let xx = c[1][0] + c[1][2] - 2.0 * c[1][1];
        let yx = 0.25 * (c[0][0] + c[2][2] - c[0][2] - c[2][0]);
        let area = yy * xx - yx * yx;
        let (dy, dx) = if yy > 0.0 && xx > 0.0 && area > 0.1 * yy * xx {
            ((yx * x - xx * y) / area, (yx * y - yy * x) / area)
        } else {
            // Along a line every place is alike: each axis for itself.
            let vertex = |slope: f64, bend: f64| if bend > 0.0 { -slope / bend } else { 0.0 };
            (vertex(y, yy), vertex(x, xx))
        };
        let parts = |v: f64| (v.clamp(-0.5, 0.5) * PARTS as f64).round() as i64;
        place = [place[0] + parts(dy), place[1] + parts(dx)];
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
    let more = 2 * REACH - 1;
    let mut lines = vec![[0.0; 4]; (height + more) * width];
    let mut row = vec![[0.0; 4]; width + more];
    for (y, line) in (top..).zip(lines.chunks_exact_mut(width)) {
        let y = inside(y, image.height());
        for (x, code) in (left..).zip(&mut row) {
            *code = image.pixel(y, inside(x, image.width())).map(f32::from);
        }
        for (sum, near) in line.iter_mut().zip(row.windows(2 * REACH)) {
            near.iter().zip(across).for_each(|(v, &weight)| added(sum, weight, *v));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of all directions, none shorter than seven pixels, at any place.
    fn wave(y: f64, x: f64) -> [u8; 4] {
        let waves = [(0.09, 0.02), (-0.03, 0.11), (0.07, -0.08)];
        let of = |(p, q): (f64, f64)| (std::f64::consts::TAU * (p * y + q * x)).sin();
        let value =
            |sign: f64| (64.0 + sign * 18.0 * waves.map(of).iter().sum::<f64>()).round() as u8;
        [value(1.0), value(-1.0), value(0.5), 0]
    }

    #[test]
    fn the_place_is_found_between_pixels() {
        let mut image = MatchImage::new(64, 70);
        image.fill_rows(|y, row| {
            row.iter_mut().enumerate().for_each(|(x, px)| *px = wave(y as f64, x as f64));
        });
        let lenses = Lenses { size: (20, 18), border: 7 };
        // Neighbours as they lie, and a patch some parts of a pixel beside them.
        let around = [[15 * PARTS + 20, 12 * PARTS - 9]; 4];
        for beside in [[0, 0], [25, -30], [-31, 8], [40, 50]] {
            let place = [around[0][0] + beside[0], around[0][1] + beside[1]];
            let found = refined(&image, &lenses, &around, place);
            let off = [found[0] - around[0][0], found[1] - around[0][1]];
            assert!(off.iter().all(|v| v.abs() <= 2), "{beside:?}: {off:?}");
        }
    }

    #[test]
    fn windows_at_whole_pixels_are_copies() {
        let mut image = MatchImage::new(20, 20);
        image.fill_rows(|y, row| {
            row.iter_mut().enumerate().for_each(|(x, px)| *px = wave(y as f64, x as f64));
        });
        let got = window(&image, [4 * PARTS, 17 * PARTS], (3, 5));
        for (i, got) in got.iter().enumerate() {
            let (y, x) = (4 + i / 5, (17 + i % 5).min(19));
            assert_eq!(*got, image.pixel(y, x).map(f32::from));
        }
    }
}
