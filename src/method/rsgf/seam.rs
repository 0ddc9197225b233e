//! How a gap's patch and what surrounds it are joined.

use crate::image::interpolate::{PARTS, nearest};
use crate::method::rsgf::grid::{Lenses, Side};
use crate::method::rsgf::{Place, pixels};
use crate::search::cut::{self, Division};
use crate::search::patch::MatchImage;

/// Side of the squares in which the graph cut is first looked for. Larger is faster and finds fewer
/// detours.
const STEP: usize = 4;

/// How much of every pixel of its window a gap takes, in 255ths.
pub(super) type Shares = Vec<u8>;

/// Fades across every side, over the whole width of its lens (the paper's).
pub(super) fn faded(lenses: &Lenses) -> Shares {
    let share = |at| match lenses.at(at) {
        Some((_, depth)) => (127.5 * (depth + 1.0)).round() as u8,
        None if lenses.is_own(at) => 255,
        None => 0,
    };
    pixels(lenses.window()).map(share).collect()
}

/// Cuts along every side by the path of least squared difference between the gap's patch (`own`) and
/// what is there (`old`): the minimum-error boundary cut of Efros and Freeman (2001), from corner to
/// corner.
pub(super) fn cut_along_sides(
    image: &MatchImage,
    lenses: &Lenses,
    own: &[Place],
    old: &[Place],
) -> Shares {
    let mut shares = faded(lenses);
    let (height, width) = lenses.size;
    let (b, stride) = (lenses.border, lenses.window().1);
    for side in Side::ALL {
        let along = if matches!(side, Side::Top | Side::Bottom) { width } else { height };
        // From the neighbour inwards, along the side.
        let pixel = |j: usize, i: usize| match side {
            Side::Top => j * stride + b + i,
            Side::Bottom => (height + 2 * b - 1 - j) * stride + b + i,
            Side::Left => (b + i) * stride + j,
            Side::Right => (b + i) * stride + width + 2 * b - 1 - j,
        };
        let reach = |i: usize| b.min(i).min(along - 1 - i);
        let difference = |p: usize| match (color(image, own[p]), color(image, old[p])) {
            (Some(a), Some(b)) => {
                a.iter().zip(b).map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
            }
            _ => 0,
        };
        let rows = 2 * b + 1;
        let mut costs = vec![cut::BARRED; rows * along];
        for i in 0..along {
            for p in b - reach(i)..=b + reach(i) {
                let behind = p.checked_sub(1).map_or(0, |j| difference(pixel(j, i)));
                let ahead = if p < 2 * b { difference(pixel(p, i)) } else { 0 };
                costs[p * along + i] = behind + ahead;
            }
        }
        for (i, p) in cut::path(&costs, rows, along).into_iter().enumerate() {
            for j in b - reach(i)..b + reach(i) {
                shares[pixel(j, i)] = if j >= p { 255 } else { 0 };
            }
        }
    }
    shares
}

/// Cuts anywhere in the window by graph cut (Kwatra et al. 2003): the gap's patch (`own`) takes what
/// makes the least visible seams, those between the pieces that are there already (`old`) included.
pub(super) fn cut_by_graph(
    image: &MatchImage,
    lenses: &Lenses,
    own: &[Place],
    old: &[Place],
) -> Shares {
    let (height, width) = lenses.window();
    // How visible a change from one place to another is. Where a patch ends, nobody knows.
    let step =
        |a: Place, b: Place| color(image, a).zip(color(image, b)).map_or(0, |(a, b)| visible(a, b));
    let steps: Vec<i32> = own.iter().zip(old).map(|(&own, &old)| step(own, old)).collect();
    let mut division = Division::new(height, width);
    for y in 0..height {
        for x in 0..width {
            let p = y * width + x;
            for (below, q, ends) in
                [(false, p + 1, x + 1 == width), (true, p + width, y + 1 == height)]
            {
                if ends {
                    continue;
                }
                let delta = [i32::from(below), i32::from(!below)].map(|v| v * PARTS as i32);
                let beyond = [old[p][0] + delta[0], old[p][1] + delta[1]];
                let costs = if beyond == old[q] {
                    let both = steps[p] + steps[q];
                    [0, both, both]
                } else {
                    let before = [old[q][0] - delta[0], old[q][1] - delta[1]];
                    let none = step(old[p], before) + step(beyond, old[q]);
                    let other = steps[p] + step(beyond, own[q]);
                    let this = step(before, own[p]) + steps[q];
                    // Less only where a patch ends.
                    [none.min(other + this), other, this]
                };
                division.pair((y, x), below, costs);
            }
        }
    }
    for at in pixels((height, width)) {
        let rim = at.0 == 0 || at.1 == 0 || at.0 + 1 == height || at.1 + 1 == width;
        if rim || lenses.is_core(at) {
            division.bind(at, !rim);
        }
    }
    division.solve_by_steps(STEP).into_iter().map(|inside| if inside { 255 } else { 0 }).collect()
}

/// Softens the edge of a cut: over `reach` pixels to both sides the shares fade into each other, as the
/// mean over a square. The core, where there is nothing to fade into, stays the gap's.
pub(super) fn feathered(lenses: &Lenses, shares: &[u8], reach: usize) -> Shares {
    let (height, width) = lenses.window();
    let blurred = |from: &[u32], n: usize, at: &dyn Fn(usize, usize) -> usize| {
        let mut out = vec![0; from.len()];
        for line in 0..from.len() / n {
            let value = |i: usize| from[at(line, i)];
            let mut sum: u32 = (0..reach.min(n)).map(value).sum();
            for i in 0..n {
                sum += if i + reach < n { value(i + reach) } else { 0 };
                sum -= if i > reach { value(i - reach - 1) } else { 0 };
                let count = (i + reach).min(n - 1) - i.saturating_sub(reach) + 1;
                out[at(line, i)] = (sum + count as u32 / 2) / count as u32;
            }
        }
        out
    };
    let wide: Vec<u32> = shares.iter().map(|&s| u32::from(s)).collect();
    let rows = blurred(&wide, width, &|line, i| line * width + i);
    let both = blurred(&rows, height, &|line, i| i * width + line);
    let soft = pixels((height, width)).zip(both);
    soft.map(|(at, share)| if lenses.is_core(at) { 255 } else { share as u8 }).collect()
}

/// The colour of the pixel nearest to a place of the photo, if it is in it.
fn color(image: &MatchImage, place: Place) -> Option<[u8; 4]> {
    let [y, x] = place.map(|v| usize::try_from(nearest(v.into())).ok());
    let (y, x) = (y?, x?);
    (y < image.height() && x < image.width()).then(|| image.pixel(y, x))
}

/// How much the eye is caught by one colour in place of another; a metric, as graph cuts need it.
fn visible(a: [u8; 4], b: [u8; 4]) -> i32 {
    a.iter().zip(b).map(|(&a, b)| i32::from(a.abs_diff(b))).sum()
}
