//! Several photos, each used as much as it has to give.

use rayon::prelude::*;

use crate::search::field::{Field, Pos};
use crate::search::source::Source;

/// How much an iteration adds to the cost of a photo that is used twice as much as it should be, as a
/// share of a patch's variance. Without it, averaging and matching end at one of two unlike photos
/// alone; much more drives all pixels from one to the other and back.
const GAIN: f64 = 0.1;

/// The costs of using each photo, raised and lowered until its share of the output is its share of the
/// usable patches.
#[derive(Debug)]
pub(super) struct Balance {
    /// Shares of a patch's variance.
    pressure: Vec<f64>,
}

impl Balance {
    pub(super) fn new(n_photos: usize) -> Self {
        Self { pressure: vec![0.0; n_photos] }
    }

    /// Looks at what the field uses of photos that have `areas` to give; returns what a patch of each
    /// costs, if a patch's variance is `unit`. `None` for one photo.
    ///
    /// # Determinism
    /// Counts are integers, and the same for any thread count.
    pub(super) fn costs(
        &mut self,
        field: &Field,
        source: &Source,
        areas: &[u64],
        unit: f64,
    ) -> Option<Vec<i32>> {
        if self.pressure.len() < 2 {
            return None;
        }
        let mut used = vec![0; self.pressure.len()];
        for pos in &field.pos {
            if let Some(view) = source.atlas.view_at(pos.y(), pos.x()) {
                used[source.atlas.views()[view].picture] += 1;
            }
        }
        let share = |counts: &[u64], i: usize| counts[i] as f64 / counts.iter().sum::<u64>() as f64;
        for (i, pressure) in self.pressure.iter_mut().enumerate() {
            // A photo without a usable patch at this level is not used either.
            let fair = share(areas, i).max(f64::MIN_POSITIVE);
            *pressure += GAIN * (share(&used, i) / fair - 1.0).min(1.0);
        }
        // Only differences count; none is negative, and sums with distances do not overflow.
        let least = self.pressure.iter().copied().fold(f64::MAX, f64::min);
        let cost = |pressure: &f64| ((pressure - least) * unit).min(f64::from(1 << 27)) as i32;
        Some(self.pressure.iter().map(cost).collect())
    }
}

/// Number of usable patches of each photo; empty for one photo.
pub(super) fn areas(source: &Source, n_photos: usize) -> Vec<u64> {
    if n_photos < 2 {
        return Vec::new();
    }
    let mut areas = vec![0; n_photos];
    for view in source.atlas.views() {
        let rows = view.corner.0..view.corner.0 + view.size.0 + 1 - source.patch;
        let cols = view.corner.1..view.corner.1 + view.size.1 + 1 - source.patch;
        let usable =
            |y: usize| cols.clone().filter(|&x| source.is_usable(Pos::new(y, x))).count() as u64;
        areas[view.picture] += rows.into_par_iter().map(usable).sum::<u64>();
    }
    areas
}
