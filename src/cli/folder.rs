//! A folder that a command fills.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::base::error::{Error, Result};
use crate::cli::work::{Session, supervise};
use crate::image::io::check_place;

/// Fails if the folder cannot be, or holds one of the files already.
pub(super) fn check(folder: &Path, files: &[PathBuf], inputs: &[&Path], force: bool) -> Result<()> {
    if folder == Path::new("-") {
        return Err(Error::parameter("output", "a folder, as there are several files", "`-`"));
    }
    if !folder.exists() {
        // What could be made here could be made in it.
        return check_place(&folder.with_file_name(".texforge.png"), &[], true).map_err(|error| {
            match error {
                Error::Io { action, source, .. } => {
                    Error::Io { action, path: folder.to_owned(), source }
                }
                error => error,
            }
        });
    }
    if !folder.is_dir() {
        return Err(Error::Exists { path: folder.to_owned() });
    }
    files.iter().try_for_each(|file| check_place(file, inputs, force))
}

/// [`supervise`]s what fills the folder. If that fails and the folder was not there before, it is gone again.
///
/// # Errors
/// As [`supervise`].
pub(super) fn filled<T: Send + 'static>(
    folder: &Path,
    session: &Arc<Session>,
    work: impl FnOnce(&Session) -> Result<T> + Send + 'static,
) -> Result<T> {
    let was_there = folder.exists();
    let done = supervise(session, work);
    if done.is_err() && !was_there {
        // Only if it is empty; the first error is the one to tell.
        let _ = std::fs::remove_dir(folder);
    }
    done
}
