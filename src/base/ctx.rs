//! What every run is given besides its parameters: seed, threads, SIMD level, progress, cancel.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::base::error::{Error, Result, guarded};

/// Progress and cancel flag of one run, shared between the worker and whoever waits for it.
#[derive(Debug, Default)]
pub struct Job {
    cancelled: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
}

impl Job {
    /// Asks the run to stop; it returns [`Error::Cancelled`] within milliseconds.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether [`Job::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Fraction of the work done, in `0..=1`.
    pub fn fraction(&self) -> f64 {
        let total = self.total.load(Ordering::Relaxed);
        if total == 0 {
            return 0.0;
        }
        (self.done.load(Ordering::Relaxed) as f64 / total as f64).min(1.0)
    }
}

/// Widest instruction set the kernels may use. All give the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Simd {
    /// Plain Rust.
    Scalar,
    /// AVX2.
    Avx2,
    /// AVX-512 F and BW.
    Avx512,
    /// AVX-512 with VNNI; the default means "the best this CPU has".
    #[default]
    Avx512Vnni,
}

/// Context of a run: first argument of everything that takes time.
///
/// # Determinism
/// `threads` and `simd` change the speed, never the result.
#[derive(Debug, Clone)]
pub struct Ctx {
    /// Seed of all random choices.
    pub seed: u64,
    /// Upper limit of the instruction set; clamped to what the CPU has.
    pub simd: Simd,
    job: Arc<Job>,
    pool: Arc<rayon::ThreadPool>,
}

impl Ctx {
    /// A context with its own pool of `threads` workers (0: one per core).
    ///
    /// # Errors
    /// [`Error::Parameter`] if `threads` exceeds 1024 or the pool cannot be started.
    pub fn new(seed: u64, threads: usize) -> Result<Self> {
        if threads > 1024 {
            return Err(Error::parameter("threads", "at most 1024", threads));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("texforge-{i}"))
            .build()
            .map_err(|e| Error::parameter("threads", format!("startable ({e})"), threads))?;
        Ok(Self { seed, simd: Simd::default(), job: Arc::default(), pool: Arc::new(pool) })
    }

    /// The same context with another seed.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        Self { seed, ..self.clone() }
    }

    /// The progress and cancel handle of this run.
    pub fn job(&self) -> Arc<Job> {
        Arc::clone(&self.job)
    }

    /// Number of worker threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `f` inside the pool, so that rayon's iterators use its workers. A panic inside
    /// (a bug of ours) comes back as [`Error::Internal`].
    ///
    /// # Errors
    /// Those of `f`, or [`Error::Internal`].
    pub fn install<T: Send>(&self, f: impl FnOnce() -> Result<T> + Send) -> Result<T> {
        self.pool.install(|| guarded(f))
    }

    /// Announces the amount of work (any unit); resets the progress.
    pub fn begin(&self, total: u64) {
        self.job.done.store(0, Ordering::Relaxed);
        self.job.total.store(total, Ordering::Relaxed);
    }

    /// Counts `amount` of the work as done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] once the job was cancelled: the only cancel point there is.
    #[inline]
    pub fn step(&self, amount: u64) -> Result<()> {
        self.job.done.fetch_add(amount, Ordering::Relaxed);
        if self.job.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_become_errors() {
        let ctx = Ctx::new(0, 2).expect("pool");
        let result: Result<()> = ctx.install(|| panic!("boom"));
        assert!(matches!(result, Err(Error::Internal { message }) if message == "boom"));
    }

    #[test]
    fn cancel_stops_at_the_next_step() {
        let ctx = Ctx::new(0, 1).expect("pool");
        ctx.begin(4);
        assert!(ctx.step(1).is_ok());
        assert_eq!(ctx.job().fraction(), 0.25);
        ctx.job().cancel();
        assert!(matches!(ctx.step(1), Err(Error::Cancelled)));
    }
}
