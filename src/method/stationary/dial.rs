//! [`Dial`]: sigma on a scale whose equal steps look like equal steps.

use rayon::prelude::*;

use crate::analyze::appearance::Appearance;
use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::method::stationary::{Evenness, Exemplar, Plan, centers, synthesize};
use crate::signal::window::Domain;

/// Sigma at 0 and at 1. A Gaussian of half the tile sees all of it from everywhere, so a wider one
/// changes nothing; narrower than the other, it leaves one material of the photo.
const SIGMAS: (f32, f32) = (0.5, 0.02);

/// Sigmas that are looked at first, in even factors.
const FIRST: usize = 9;

/// Rounds of looking closer, each in the middle of the two gaps across which the look changes most.
const ROUNDS: usize = 4;
const PER_ROUND: usize = 2;

/// Neighbours nearer than this factor are close enough.
const CLOSE: f64 = 1.03;

/// Seeds that are averaged, so that the dial follows sigma and not chance. Fixed: for a photo, the
/// dial is the same whatever the user's seed is.
const SEEDS: [u64; 2] = [0, 1];

/// Iterations at the coarsest level, at most: those of a draft show the look well enough.
const ITERATIONS: u32 = 12;

/// Shorter side of the level at which the look is judged, at most, in pixels.
const SIDE: usize = 192;

/// How the look of a tile depends on sigma.
#[derive(Debug, Clone, PartialEq)]
pub struct Dial {
    /// Sigma, falling, and the change of look up to it.
    points: Vec<(f64, f64)>,
}

/// What was made with one sigma.
struct Trial {
    sigma: f64,
    look: Appearance,
    /// Difference to the trial before.
    change: f64,
}

impl Dial {
    /// Tries sigmas on the pyramid's coarse levels, for tiles of this plan but for its sigma. Counts
    /// [`Dial::work`] steps of progress.
    ///
    /// # Paper
    /// Moritz et al. 2017, Sec. 4.4: the differences `d_j` of neighbouring results, accumulated and
    /// inverted. Where the look jumps, more sigmas are tried than the paper's even ones.
    ///
    /// # Determinism
    /// Same bytes for any thread count; does not depend on `ctx.seed`.
    ///
    /// # Errors
    /// See [`tile`](crate::tile).
    pub fn new(ctx: &Ctx, exemplar: &Exemplar, plan: &Plan) -> Result<Self> {
        let finest = judged(exemplar);
        let (low, high) = (libm::log(f64::from(SIGMAS.1)), libm::log(f64::from(SIGMAS.0)));
        let even = |i: usize| libm::exp(high + (low - high) * i as f64 / (FIRST - 1) as f64);
        let mut trials =
            tried(ctx, exemplar, plan, finest, &(0..FIRST).map(even).collect::<Vec<_>>())?;
        for i in 1..trials.len() {
            trials[i].change = trials[i].look.distance(&trials[i - 1].look);
        }
        for _ in 0..ROUNDS {
            let mut gaps: Vec<usize> = (1..trials.len())
                .filter(|&i| trials[i - 1].sigma > CLOSE * trials[i].sigma)
                .collect();
            // The sort is stable: equal changes stay in order.
            gaps.sort_by(|&a, &b| trials[b].change.total_cmp(&trials[a].change));
            gaps.truncate(PER_ROUND);
            let middle = |&i: &usize| (trials[i - 1].sigma * trials[i].sigma).sqrt();
            let middles: Vec<f64> = gaps.iter().map(middle).collect();
            for trial in tried(ctx, exemplar, plan, finest, &middles)? {
                let i = trials.partition_point(|other| other.sigma > trial.sigma);
                insert(&mut trials, i, trial);
            }
        }
        let mut sum = 0.0;
        let point = |trial: &Trial| {
            sum += trial.change;
            (trial.sigma, sum)
        };
        Ok(Self { points: trials.iter().map(point).collect() })
    }

    /// Most steps of progress that [`Dial::new`] counts.
    pub fn work(exemplar: &Exemplar, plan: &Plan) -> u64 {
        let runs = (FIRST + ROUNDS * PER_ROUND) * SEEDS.len();
        exemplar.work_down_to(&trial(plan), judged(exemplar)) * runs as u64
    }

    /// The sigma at `stationarity`: 0 evens out least, 1 most. Three digits, so that it can be read.
    pub fn sigma(&self, stationarity: f32) -> f32 {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        // No number counts as 0.
        let share = f64::from(stationarity.max(0.0));
        let wanted = share * last.1;
        let reached = self.points.partition_point(|point| point.1 < wanted);
        let exact = if share <= 0.0 {
            first.0
        } else if share >= 1.0 {
            last.0
        } else if last.1 <= 0.0 {
            between(first.0, last.0, share)
        } else {
            let (low, high) = (self.points[reached - 1], self.points[reached]);
            between(low.0, high.0, (wanted - low.1) / (high.1 - low.1))
        };
        let unit = libm::pow(10.0, libm::floor(libm::log10(exact)) - 2.0);
        ((exact / unit).round() * unit) as f32
    }

    /// The sigmas that were tried, falling, and how much the look has changed up to each, in L*a*b*
    /// units.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }
}

/// Between two sigmas, in even factors.
fn between(from: f64, to: f64, share: f64) -> f64 {
    from * libm::pow(to / from, share)
}

/// The number of the level at which looks are judged.
fn judged(exemplar: &Exemplar) -> usize {
    let small = |level: &super::Level| level.size.0.min(level.size.1) <= SIDE;
    exemplar.levels.iter().position(small).unwrap_or(exemplar.levels.len() - 1)
}

/// The plan of a tile that is only looked at.
fn trial(plan: &Plan) -> Plan {
    let coarse_iterations = plan.coarse_iterations.min(ITERATIONS);
    Plan { coarse_iterations, kept: None, ..plan.clone() }
}

/// Puts a trial between two neighbours. The way over it is longer than the straight one by what is
/// chance, so both parts are shortened alike.
fn insert(trials: &mut Vec<Trial>, i: usize, mut trial: Trial) {
    let (there, on) =
        (trial.look.distance(&trials[i - 1].look), trial.look.distance(&trials[i].look));
    let straight = trials[i].change;
    let share = if there + on > 0.0 { there / (there + on) } else { 0.5 };
    trial.change = straight * share;
    trials[i].change = straight * (1.0 - share);
    trials.insert(i, trial);
}

/// What the tile looks like with each sigma.
fn tried(
    ctx: &Ctx,
    exemplar: &Exemplar,
    plan: &Plan,
    finest: usize,
    sigmas: &[f64],
) -> Result<Vec<Trial>> {
    let look = |(sigma, seed): (f64, u64)| {
        let evenness = plan.evenness.clone().map(|e| Evenness { sigma: sigma as f32, ..e });
        let plan = Plan { evenness, ..trial(plan) };
        let (field, _) = synthesize(&ctx.with_seed(seed), exemplar, &plan, finest, None)?;
        let level = &exemplar.levels[finest];
        let color = |[y, x]: [u32; 2]| {
            let [l, a, b, _] = level.source.image.pixel(y as usize, x as usize);
            [l, a, b].map(|code| f32::from(code) * level.unit)
        };
        let pixels: Vec<[f32; 3]> = centers(&field, plan.patch).into_iter().map(color).collect();
        let (height, width) = level.size;
        let domain = Domain { height, width, wrap_y: plan.wrap.y, wrap_x: plan.wrap.x };
        Ok(Appearance::of(&pixels, domain))
    };
    let runs: Vec<_> = sigmas.iter().flat_map(|&sigma| SEEDS.map(|seed| (sigma, seed))).collect();
    let looks = runs.into_par_iter().map(look).collect::<Result<Vec<_>>>()?;
    let trials = |(&sigma, looks): (&f64, &[Appearance])| Trial {
        sigma,
        look: Appearance::typical(looks),
        change: 0.0,
    };
    Ok(sigmas.iter().zip(looks.chunks_exact(SEEDS.len())).map(trials).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_steps_of_the_dial_are_equal_changes() {
        let dial = Dial { points: vec![(0.5, 0.0), (0.2, 1.0), (0.1, 1.0), (0.02, 4.0)] };
        assert_eq!(dial.sigma(0.0), 0.5);
        assert_eq!(dial.sigma(1.0), 0.02);
        // A quarter of all change lies between 0.5 and 0.2.
        assert_eq!(dial.sigma(0.25), 0.2);
        // From 0.1 on: halfway in even factors.
        assert_eq!(dial.sigma(0.625), 0.0447);
        let falling: Vec<f32> = (0..=100).map(|i| dial.sigma(i as f32 / 100.0)).collect();
        assert!(falling.is_sorted_by(|a, b| a >= b), "{falling:?}");
    }

    #[test]
    fn where_nothing_changes_the_factors_are_even() {
        let dial = Dial { points: vec![(0.5, 0.0), (0.3, 0.0), (0.02, 0.0)] };
        assert_eq!([0.0, 0.5, 1.0].map(|s| dial.sigma(s)), [0.5, 0.1, 0.02]);
    }
}
