//! Several photos, each used as much as it has to give.

use crate::search::field::Field;
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

    /// Looks at what the field uses; returns what a patch of each photo costs, if a patch's variance
    /// is `unit`. `None` for one photo.
    ///
    /// # Determinism
    /// Counts are integers, and the same for any thread count.
    pub(super) fn costs(&mut self, field: &Field, source: &Source, unit: f64) -> Option<Vec<i32>> {
        if self.pressure.len() < 2 {
            return None;
        }
        let views = source.atlas.views();
        let mut used = vec![0_u64; self.pressure.len()];
        for pos in &field.pos {
            if let Some(view) = source.atlas.view_at(pos.y(), pos.x()) {
                used[views[view].picture] += 1;
            }
        }
        let mut area = vec![0_u64; self.pressure.len()];
        for view in views {
            area[view.picture] += (view.size.0 * view.size.1) as u64;
        }
        let share = |counts: &[u64], i: usize| counts[i] as f64 / counts.iter().sum::<u64>() as f64;
        for (i, pressure) in self.pressure.iter_mut().enumerate() {
            *pressure += GAIN * (share(&used, i) / share(&area, i) - 1.0).min(1.0);
        }
        // Only differences count; none is negative, and sums with distances do not overflow.
        let least = self.pressure.iter().copied().fold(f64::MAX, f64::min);
        let cost = |pressure: &f64| ((pressure - least) * unit).min(f64::from(1 << 27)) as i32;
        Some(self.pressure.iter().map(cost).collect())
    }
}
