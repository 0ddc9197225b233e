//! Gap filling: the patch whose frame agrees best with what surrounds the gap.

use crate::base::ctx::Simd;
use crate::method::rsgf::grid::Lenses;
use crate::method::rsgf::places::Offset;
use crate::search::patch::{Kernel, MatchImage, WithKernel, with_kernel};

/// The overlaps around a gap, row by row, with the codes that its neighbours have there.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    /// Row and column in the window where a run of overlapping pixels begins, and its codes.
    runs: Vec<(usize, usize, std::ops::Range<usize>)>,
    codes: Vec<u8>,
}

impl Frame {
    /// The frame of a gap whose neighbours' codes are `code(y, x)` at pixels of the window.
    pub(super) fn new(
        lenses: &Lenses,
        mut code: impl FnMut(super::grid::Side, (usize, usize)) -> [u8; 4],
    ) -> Self {
        let (height, width) = lenses.window();
        let mut frame = Self { runs: Vec::new(), codes: Vec::new() };
        for y in 0..height {
            let mut open = false;
            for x in 0..width {
                let Some((side, _)) = lenses.at((y, x)) else {
                    open = false;
                    continue;
                };
                let at = frame.codes.len();
                frame.codes.extend(code(side, (y, x)));
                match frame.runs.last_mut() {
                    Some((_, _, run)) if open => run.end = at + 4,
                    _ => frame.runs.push((y, x, at..at + 4)),
                }
                open = true;
            }
        }
        frame
    }
}

/// How many of the places are looked at more closely. More finds a little better ones.
const CLOSER: usize = 8;

/// The place of a patch whose frame is most like the one around the gap, by the sum of squared
/// differences (paper eq. 10): of `places`, the best few, each moved by at most `tolerance` rows and
/// columns. Places are the window's top left corner in `source`; moved ones that do not fit are
/// skipped. Of equally good ones the first. `None` without any place.
pub(super) fn nearest_in_color(
    simd: Simd,
    source: &MatchImage,
    frame: &Frame,
    places: &[Offset],
    tolerance: usize,
    fits: impl Fn(Offset) -> bool,
) -> Option<Offset> {
    let costs = with_kernel(simd, 1, Costs { source, frame, places, cut_off: false });
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|&i| costs[i]);
    let t = tolerance as i64;
    let closer = order.iter().take(CLOSER).flat_map(|&i| {
        let [y, x] = places[i];
        let moved = (-t..=t).flat_map(move |dy| (-t..=t).map(move |dx| [y + dy, x + dx]));
        // Itself before those around it: a good one early saves most of the others.
        std::iter::once([y, x]).chain(moved)
    });
    let closer: Vec<Offset> = closer.filter(|&place| fits(place)).collect();
    let costs = with_kernel(simd, 1, Costs { source, frame, places: &closer, cut_off: true });
    (0..closer.len()).min_by_key(|&i| costs[i]).map(|i| closer[i])
}

/// The sum of squared differences at every place; with `cut_off`, only those are summed to the end
/// that are less than all before them.
struct Costs<'a> {
    source: &'a MatchImage,
    frame: &'a Frame,
    places: &'a [Offset],
    cut_off: bool,
}

impl WithKernel for Costs<'_> {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) -> Self::Output {
        let mut costs = Vec::with_capacity(self.places.len());
        let mut least = u64::MAX;
        for place in self.places {
            let mut cost = 0;
            for (y, x, run) in &self.frame.runs {
                let wanted = &self.frame.codes[run.clone()];
                let at = self.source.at(place[0] as usize + y, place[1] as usize + x);
                cost += u64::from(squared(wanted, self.source.codes_from(at, wanted.len())));
                if self.cut_off && cost >= least {
                    break;
                }
            }
            least = least.min(cost);
            costs.push(cost);
        }
        costs
    }
}

/// The sum of squared differences of codes.
#[inline(always)]
fn squared(a: &[u8], b: &[u8]) -> u32 {
    let mut sum = 0;
    for (&a, &b) in a.iter().zip(b) {
        let d = i32::from(i16::from(a) - i16::from(b));
        sum += (d * d) as u32;
    }
    sum
}
