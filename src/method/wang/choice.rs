//! Which samples of a photo that repeats: those that join best.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::method::wang::quadrant::{Quadrant, difference};
use crate::method::wang::{Offset, Samples};
use crate::search::patch::MatchImage;

/// Most places that are tried for either direction. More take their square in time, and a photo's
/// periods are no more different for being many.
const MOST_PLACES: usize = 256;

/// The same while it is found out where tiles begin.
const FEW_PLACES: usize = 36;

/// Places in a period, along either side, at which tiles are tried to begin. Fewer miss the joints of a
/// wall.
const PHASES: usize = 8;

/// Points of a quadrant in a row, at most, at which samples are compared.
const POINTS: usize = 24;

/// How far a sample may lie beside its place, as a share of the period: one in so many.
const BESIDE: usize = 16;

/// Most pixels of that.
const MOST_BESIDE: usize = 24;

/// How often each of the chosen samples is moved to where it joins the others best.
const PASSES: usize = 3;

/// What samples are taken from.
#[derive(Debug)]
pub struct Grid<'a> {
    /// The photo.
    pub image: &'a MatchImage,
    /// Where it may be used (`None`: everywhere).
    pub usable: Option<&'a [bool]>,
    /// Height and width of a tile.
    pub tile: (usize, usize),
    /// How many of the photo's periods that are.
    pub periods: usize,
    /// How much samples may overlap, as a share of their area.
    pub overlap: f64,
}

/// Where in a period tiles may begin, rows and columns as shares of it, the best first: where the tiles
/// of a `coarse` copy of the photo show the least seams. Samples meet at the corners of tiles and in
/// their middles whatever is there; a seam should be able to run along a joint there.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn phases(ctx: &Ctx, coarse: &Grid<'_>) -> Result<Vec<[f64; 2]>> {
    let share = |i: usize| (i as f64 + 0.5) / PHASES as f64;
    let cost = |i: usize| -> Result<Option<(i64, usize)>> {
        ctx.step(0)?;
        let phase = [share(i / PHASES), share(i % PHASES)];
        let samples = coarse.best(phase, FEW_PLACES);
        Ok(samples
            .map(|samples| (seams(coarse.image, &coarse.settled(samples, 1), coarse.tile), i)))
    };
    let costs: Vec<_> = (0..PHASES * PHASES).into_par_iter().map(cost).collect::<Result<_>>()?;
    let mut costs: Vec<(i64, usize)> = costs.into_iter().flatten().collect();
    costs.sort_unstable();
    ctx.step(1)?;
    Ok(costs.into_iter().map(|(_, i)| [share(i / PHASES), share(i % PHASES)]).collect())
}

/// How much all cuts of these samples' tiles show.
fn seams(image: &MatchImage, samples: &Samples, tile: (usize, usize)) -> i64 {
    let colors = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let of = |quadrant: Quadrant| colors.map(|c| quadrant.joined(image, samples, c).1).iter().sum();
    Quadrant::all(tile).map(of).iter().sum::<i64>()
}

/// The samples whose tiles show the least seams, tiles beginning at the first of these `phases` at which
/// the photo has room for four. They lie whole periods apart, up to what the photo's periods themselves
/// are out of place, so everything in them is where it is in all tiles. `None` if there is no room.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn choose(ctx: &Ctx, grid: &Grid<'_>, phases: &[[f64; 2]]) -> Result<Option<Samples>> {
    let best = phases.iter().find_map(|&phase| grid.best(phase, MOST_PLACES));
    ctx.step(1)?;
    Ok(best.map(|samples| grid.settled(samples, PASSES)))
}

fn beside(cell: usize) -> usize {
    (cell / BESIDE).clamp(1, MOST_BESIDE)
}

impl Grid<'_> {
    fn size(&self) -> (usize, usize) {
        (self.image.height(), self.image.width())
    }

    /// Height and width of a period, rounded down.
    fn cell(&self) -> (usize, usize) {
        (self.tile.0 / self.periods, self.tile.1 / self.periods)
    }

    /// Where period `k` begins along a side of the tile of this length.
    fn period(&self, k: usize, side: usize) -> usize {
        (k * side + self.periods / 2) / self.periods
    }

    /// The best samples whose tiles begin there, of at most so many places in either direction.
    fn best(&self, phase: [f64; 2], most: usize) -> Option<Samples> {
        let all = self.places(phase);
        let fitting = |is_horizontal| {
            let fits = |place: &Offset| self.fits(*place, is_horizontal);
            let all: Vec<Offset> = all.iter().copied().filter(fits).collect();
            let step = all.len().div_ceil(most).max(1);
            all.into_iter().step_by(step).collect::<Vec<Offset>>()
        };
        let (across, down) = (fitting(true), fitting(false));
        let joins: Vec<Vec<u64>> =
            across.par_iter().map(|&a| down.iter().map(|&b| self.join(a, b)).collect()).collect();
        let apart = |a: (Offset, bool), b: (Offset, bool)| self.shared(a, b) <= self.overlap;
        // The best two vertical samples for every two horizontal ones.
        let best_of = |i: usize| {
            let mut best: Option<(u64, Samples)> = None;
            for j in i + 1..across.len() {
                let horizontal = [across[i], across[j]];
                if !apart((across[i], true), (across[j], true)) {
                    continue;
                }
                let beside = |b: Offset| horizontal.iter().all(|&a| apart((a, true), (b, false)));
                let mut order: Vec<(u64, usize)> = (0..down.len())
                    .filter(|&k| beside(down[k]))
                    .map(|k| (joins[i][k] + joins[j][k], k))
                    .collect();
                order.sort_unstable();
                // Of the best that fit beside each other one is nearly always among the first few.
                for (n, &(cost, k)) in order.iter().enumerate() {
                    let other = order[n + 1..]
                        .iter()
                        .find(|(_, l)| apart((down[k], false), (down[*l], false)));
                    let Some(&(more, l)) = other else { continue };
                    if best.as_ref().is_none_or(|(least, _)| cost + more < *least) {
                        best = Some((
                            cost + more,
                            Samples { horizontal, vertical: [down[k], down[l]] },
                        ));
                    }
                    break;
                }
            }
            best
        };
        let best: Vec<_> = (0..across.len()).into_par_iter().map(best_of).collect();
        let best = best.into_iter().flatten().reduce(|a, b| if b.0 < a.0 { b } else { a });
        best.map(|(_, samples)| samples)
    }

    /// The photo's places of that phase.
    fn places(&self, [down, across]: [f64; 2]) -> Vec<Offset> {
        let ((h, w), (ch, cw)) = (self.size(), self.cell());
        let (top, left) = ((down * ch as f64) as usize, (across * cw as f64) as usize);
        let along = |from: usize, side: usize, end: usize| -> Vec<i64> {
            let all = (0..).map(|k| from + self.period(k, side)).take_while(|&at| at <= end);
            all.map(|at| at as i64).collect()
        };
        let columns = along(left, self.tile.1, w);
        let rows = along(top, self.tile.0, h);
        rows.iter().flat_map(|&y| columns.iter().map(move |&x| [y, x])).collect()
    }

    /// Where the sample of an edge begins.
    fn corner(&self, [y, x]: Offset, is_horizontal: bool) -> Offset {
        let (h, w) = self.tile;
        if is_horizontal { [y - (h - h / 2) as i64, x] } else { [y, x - (w - w / 2) as i64] }
    }

    /// Whether the photo holds the sample of an edge, and all of it may be used.
    fn fits(&self, place: Offset, is_horizontal: bool) -> bool {
        let [top, left] = self.corner(place, is_horizontal);
        let ((h, w), (th, tw)) = (self.size(), self.tile);
        if top < 0 || left < 0 || top + th as i64 > h as i64 || left + tw as i64 > w as i64 {
            return false;
        }
        let (top, left) = (top as usize, left as usize);
        let row = |usable: &[bool], y: usize| usable[y * w + left..][..tw].iter().all(|u| *u);
        self.usable.is_none_or(|usable| (top..top + th).all(|y| row(usable, y)))
    }

    /// The share of their area that two samples have in common.
    fn shared(&self, a: (Offset, bool), b: (Offset, bool)) -> f64 {
        let (a, b) = (self.corner(a.0, a.1), self.corner(b.0, b.1));
        let along = |k: usize, side: usize| (side as i64 - (a[k] - b[k]).abs()).max(0) as f64;
        let (h, w) = self.tile;
        along(0, h) * along(1, w) / (h * w) as f64
    }

    /// How unlike two samples are where they are joined: near the diagonals of tiles.
    fn join(&self, across: Offset, down: Offset) -> u64 {
        let mut sum = 0;
        for (k, quadrant) in Quadrant::all(self.tile).into_iter().enumerate() {
            let (a, b) = (quadrant.horizontal(across), quadrant.vertical(down));
            let ((top, left), (h, w)) = (quadrant.corner(), quadrant.size());
            let n = POINTS.min(h).min(w);
            for i in 0..n {
                for j in 0..n {
                    // From the corner to the middle.
                    let along = if k == 0 || k == 3 { j } else { n - 1 - j };
                    let weight = n.div_ceil(2).saturating_sub(i.abs_diff(along));
                    if weight == 0 {
                        continue;
                    }
                    let at = |i: usize, side: usize| (2 * i + 1) * side / (2 * n);
                    let (y, x) = ((top + at(i, h)) as i64, (left + at(j, w)) as i64);
                    let from = |[dy, dx]: Offset| [(y + dy) as u32, (x + dx) as u32];
                    sum += weight as u64 * difference(self.image, from(a), from(b)) as u64;
                }
            }
        }
        sum
    }

    /// The samples, each moved by what its period lies beside its place.
    fn settled(&self, mut samples: Samples, passes: usize) -> Samples {
        let (ch, cw) = self.cell();
        let (reach_y, reach_x) = (beside(ch) as i64, beside(cw) as i64);
        let places = samples;
        let cost = |place: Offset, is_horizontal: bool, samples: &Samples| -> u64 {
            if is_horizontal {
                samples.vertical.iter().map(|&b| self.join(place, b)).sum()
            } else {
                samples.horizontal.iter().map(|&a| self.join(a, place)).sum()
            }
        };
        for _ in 0..passes {
            for (is_horizontal, k) in [(false, 0), (false, 1), (true, 0), (true, 1)] {
                let of = |samples: &Samples| {
                    if is_horizontal { samples.horizontal[k] } else { samples.vertical[k] }
                };
                let [y, x] = of(&places);
                let moves: Vec<Offset> = (-reach_y..=reach_y)
                    .flat_map(|dy| (-reach_x..=reach_x).map(move |dx| [y + dy, x + dx]))
                    .filter(|&place| self.fits(place, is_horizontal))
                    .collect();
                let costs: Vec<(u64, Offset)> = moves
                    .into_par_iter()
                    .map(|place| (cost(place, is_horizontal, &samples), place))
                    .collect();
                // Where it is, unless elsewhere is better.
                let own = of(&samples);
                let mut best = (cost(own, is_horizontal, &samples), own);
                for (cost, place) in costs {
                    if cost < best.0 {
                        best = (cost, place);
                    }
                }
                if is_horizontal {
                    samples.horizontal[k] = best.1;
                } else {
                    samples.vertical[k] = best.1;
                }
            }
        }
        samples
    }
}
