//! The doorway: everything that takes time goes through [`enter`].

use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

use pyo3::prelude::*;

use super::error::IntoPy;
use crate::base::ctx::Job;
use crate::base::error::{Error, Result, guarded};

/// How often the waiting thread looks up. Longer makes Ctrl-C and progress bars sluggish, much
/// shorter takes the interpreter from its other threads.
const STEP: Duration = Duration::from_millis(15);

/// Runs `work` on a thread of its own while the calling thread, detached from the interpreter,
/// waits for it, and now and then attends to signals and to `progress`.
///
/// `progress` is called on the caller's thread with the fraction done, which never falls: first
/// 0, last 1. The work is cancelled and waited for if a signal handler raises (Ctrl-C:
/// `KeyboardInterrupt`), if `progress` raises, or if it returns `False` (`texforge.Cancelled`).
/// A panic in `work` becomes [`Error::Internal`].
pub(super) fn enter<T: Send + 'static>(
    py: Python<'_>,
    job: &Arc<Job>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce() -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let mut progress = Progress { callback: progress, shown: -1.0 };
    progress.show(0.0)?;
    let (send, mut receive) = sync_channel(1);
    std::thread::Builder::new()
        .name("texforge".into())
        .spawn(move || {
            // Nobody listens only if the caller was unwound: nothing is left to be told.
            let _ = send.send(guarded(work));
        })
        .map_err(|e| Error::parameter("threads", format!("startable ({e})"), 1))
        .into_py(py)?;
    loop {
        let waiting = &mut receive;
        match py.detach(move || waiting.recv_timeout(STEP)) {
            Ok(result) => {
                let value = result.into_py(py)?;
                progress.finish()?;
                return Ok(value);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let message = "the worker went away".into();
                return Err(Error::Internal { message }).into_py(py);
            }
        }
        let attended = py.check_signals().and_then(|()| progress.show(job.fraction()));
        if let Err(stop) = attended {
            job.cancel();
            // Whatever the work still returns, the caller gets to know why it was stopped.
            let waiting = &mut receive;
            let _ = py.detach(move || waiting.recv());
            return Err(stop);
        }
    }
}

/// As [`enter`], for work that counts no steps: Ctrl-C is heard when it is done.
pub(super) fn unheard<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T> + Send + 'static,
) -> PyResult<T> {
    enter(py, &Arc::default(), None, work)
}

/// The caller's callback and what it was last told.
struct Progress<'a, 'py> {
    callback: Option<&'a Bound<'py, PyAny>>,
    shown: f64,
}

impl Progress<'_, '_> {
    /// Calls the callback if `fraction` is more than it was told; fails if it says stop.
    fn show(&mut self, fraction: f64) -> PyResult<()> {
        let Some(callback) = self.callback else { return Ok(()) };
        if fraction <= self.shown {
            return Ok(());
        }
        self.shown = fraction;
        let answer = callback.call1((fraction,))?;
        let stop = answer.is_instance_of::<pyo3::types::PyBool>() && !answer.is_truthy()?;
        if stop { Err(Error::Cancelled).into_py(callback.py()) } else { Ok(()) }
    }

    /// Tells the callback that all is done; too late for it to cancel.
    fn finish(&mut self) -> PyResult<()> {
        match self.callback {
            Some(callback) if self.shown < 1.0 => callback.call1((1.0,)).map(drop),
            _ => Ok(()),
        }
    }
}
