//! A run that can be stopped: the work on its own thread, the caller's thread watching over it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use clap::ArgMatches;

use crate::base::ctx::{Ctx, Job};
use crate::base::error::{Error, Result};
use crate::cli::show::Console;
use crate::image::io::Staging;

/// How often the watching thread looks up.
const POLL: Duration = Duration::from_millis(20);
/// How long the worker may take to stop by itself. Together with two polls it must stay below the
/// quarter of a second that is promised, with room for a busy machine. Decoders and encoders know
/// no cancel point and run into it.
const GRACE: Duration = Duration::from_millis(120);

/// Signals seen since the run began. Signal handlers belong to the process, so does this.
static SIGNALS: AtomicUsize = AtomicUsize::new(0);

/// Begins to count Ctrl-C, SIGTERM and SIGHUP.
///
/// The first asks the run to stop, the second does not wait for it, from the third on the process
/// ends at once.
pub(super) fn watch_signals() {
    SIGNALS.store(0, Ordering::SeqCst);
    // An error means that a handler is installed already: ours, if this is the second run in the
    // process, and then it counts for this run; or the host's, who then decides.
    let _ = ctrlc::set_handler(|| {
        if SIGNALS.fetch_add(1, Ordering::SeqCst) >= 2 {
            std::process::exit(i32::from(crate::cli::exit::INTERRUPTED));
        }
    });
}

/// What the worker and the watching thread share.
#[derive(Debug)]
pub(super) struct Session {
    /// Progress and cancel flag.
    pub(super) job: Arc<Job>,
    /// Standard error.
    pub(super) console: Console,
    /// Files on their way.
    pub(super) staging: Staging,
}

impl Session {
    /// A session around the job of a run.
    pub(super) fn new(job: Arc<Job>, quiet: bool) -> Arc<Self> {
        let staging = Staging::new(Arc::clone(&job));
        Arc::new(Self { job, console: Console::new(quiet), staging })
    }

    /// Begins a run as typed: `--seed` (0 for a command without), `--threads` and `--quiet`.
    ///
    /// # Errors
    /// Those of [`Ctx::new`].
    pub(super) fn begin(matches: &ArgMatches) -> Result<(Ctx, Arc<Self>)> {
        let seed = matches.try_get_one("seed").ok().flatten().copied().unwrap_or_default();
        let threads = matches.get_one("threads").copied().unwrap_or_default();
        // Before the first thread: whoever sees that one may send a signal.
        watch_signals();
        let ctx = Ctx::new(seed, threads)?;
        let session = Self::new(ctx.job(), matches.get_flag("quiet"));
        Ok((ctx, session))
    }

    /// Fails once the user has asked to stop; for the stretches of work outside the core.
    pub(super) fn check(&self) -> Result<()> {
        if self.job.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Does `work` on a thread of its own; shows progress and listens to signals meanwhile.
///
/// If the work does not stop in time after a signal, it is left behind: the files it has begun
/// are removed, and it can complete none any more.
///
/// # Errors
/// Those of `work`, [`Error::Cancelled`] after a signal, [`Error::Internal`] after a panic.
pub(super) fn supervise<T: Send + 'static>(
    session: &Arc<Session>,
    work: impl FnOnce(&Session) -> Result<T> + Send + 'static,
) -> Result<T> {
    let internal = |message: &str| Error::Internal { message: message.to_owned() };
    let (tell, hear) = mpsc::sync_channel(1);
    let shared = Arc::clone(session);
    std::thread::Builder::new()
        .name("texforge-run".into())
        // Decoders are tested with the stack of a main thread.
        .stack_size(8 << 20)
        .spawn(move || {
            let result = catch_unwind(AssertUnwindSafe(|| work(&shared)))
                .unwrap_or_else(|_| Err(internal("the worker panicked")));
            if result.is_err() {
                shared.staging.abandon();
            }
            // Nobody listens any more after an interruption.
            let _ = tell.send(result);
        })
        .map_err(Error::io("start a thread for", "the run"))?;

    let mut asked: Option<Instant> = None;
    let result = loop {
        match hear.recv_timeout(POLL) {
            Ok(result) => break result,
            Err(RecvTimeoutError::Disconnected) => break Err(internal("the worker vanished")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        session.console.tick(session.job.fraction());
        let signals = SIGNALS.load(Ordering::SeqCst);
        if signals > 0 {
            session.job.cancel();
            let asked = *asked.get_or_insert_with(Instant::now);
            if signals > 1 || asked.elapsed() >= GRACE {
                // Losing the race against the worker's last rename means that it is done.
                if session.staging.abandon() {
                    break Err(Error::Cancelled);
                }
            }
        }
    };
    session.console.finish();
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_in_the_worker_becomes_an_error() {
        let session = Session::new(Arc::default(), true);
        let result: Result<()> = supervise(&session, |_| panic!("boom"));
        assert!(matches!(result, Err(Error::Internal { .. })));
    }

    #[test]
    fn a_worker_that_ends_gives_its_result() {
        let session = Session::new(Arc::default(), true);
        assert_eq!(supervise(&session, |_| Ok(7)).expect("seven"), 7);
    }
}
