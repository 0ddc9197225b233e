//! Where results go: files that appear all at once or not at all, or standard output.

use std::fs::Permissions;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::TempPath;

use crate::base::error::{Error, Result};
use crate::cli::exit::STDOUT;
use crate::cli::work::Session;

/// Bytes written between two looks at the cancel flag.
const CHUNK: usize = 1 << 20;

/// Where a result goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Target {
    /// `-`: standard output.
    Stdout,
    /// A file.
    File(PathBuf),
}

impl Target {
    /// The target that was typed; `-` is refused where it would fill a terminal with bytes.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub(super) fn typed(path: &Path) -> Result<Self> {
        use std::io::IsTerminal as _;
        if path != Path::new("-") {
            return Ok(Self::File(path.to_owned()));
        }
        if std::io::stdout().is_terminal() {
            let expected = "a file name while standard output is a terminal";
            return Err(Error::parameter("output", expected, "`-`"));
        }
        Ok(Self::Stdout)
    }

    /// The file, if it is one.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Self::Stdout => None,
            Self::File(path) => Some(path),
        }
    }
}

/// Writes bytes to standard output.
///
/// # Errors
/// [`Error::Io`]; see [`is_broken_pipe`](crate::cli::exit::is_broken_pipe).
pub(super) fn to_stdout(bytes: &[u8]) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(bytes).and_then(|()| out.flush()).map_err(Error::io("write to", STDOUT))
}

/// Files that are complete on disk under a temporary name, waiting to be renamed together.
#[derive(Debug, Default)]
pub(super) struct Staging(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    waiting: Vec<(TempPath, PathBuf)>,
    /// No file may be begun or finished any more.
    closed: bool,
    /// The files have their names: too late to stop.
    done: bool,
}

impl Staging {
    /// Puts `bytes` under a temporary name beside `path`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Cancelled`].
    pub(super) fn stage(&self, session: &Session, path: &Path, bytes: &[u8]) -> Result<()> {
        let refused = || Error::io("write", path);
        // Replacing what a symbolic link leads to keeps the link.
        let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".texforge-").suffix(".part");
        if let Some(permissions) = permissions() {
            builder.permissions(permissions);
        }
        // Register the file before the long write, so that an interruption finds it.
        let mut file = {
            let mut state = self.lock();
            if state.closed {
                return Err(Error::Cancelled);
            }
            let (file, name) = builder.tempfile_in(folder).map_err(refused())?.into_parts();
            state.waiting.push((name, target.clone()));
            file
        };
        for chunk in bytes.chunks(CHUNK) {
            session.check()?;
            file.write_all(chunk).map_err(refused())?;
        }
        if let Ok(old) = std::fs::metadata(&target) {
            file.set_permissions(old.permissions()).map_err(refused())?;
        }
        // After a power cut the new name must not stand for an empty file.
        file.sync_all().map_err(refused())
    }

    /// Gives all files their names. If one cannot have it, those before it are removed again.
    ///
    /// # Errors
    /// [`Error::Exists`], [`Error::Io`], [`Error::Cancelled`].
    pub(super) fn commit(&self, session: &Session, force: bool) -> Result<()> {
        let mut state = self.lock();
        session.check()?;
        if state.closed {
            return Err(Error::Cancelled);
        }
        let mut written = Vec::new();
        for (name, path) in state.waiting.drain(..) {
            // Someone else may have made the file since it was checked.
            let result = if !force && path.symlink_metadata().is_ok() {
                Err(Error::Exists { path })
            } else {
                name.persist(&path)
                    .map_err(|e| Error::io("write", &path)(e.error))
                    .map(|()| written.push(path))
            };
            if let Err(error) = result {
                for path in written {
                    // The first error is the one to tell.
                    let _ = std::fs::remove_file(path);
                }
                return Err(error);
            }
        }
        state.done = true;
        Ok(())
    }

    /// Removes what was begun; nothing can be finished afterwards. `false` if all is finished
    /// already.
    pub(super) fn abandon(&self) -> bool {
        let mut state = self.lock();
        if state.done {
            return false;
        }
        state.closed = true;
        state.waiting.clear();
        true
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Temporary files are private by default; results are like any other file, less the umask.
#[cfg(unix)]
#[expect(clippy::unnecessary_wraps, reason = "other systems have no such thing")]
fn permissions() -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt as _;
    Some(Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn permissions() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder)
            .expect("folder")
            .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_together() {
        let folder = tempfile::tempdir().expect("folder");
        let session = Session::new(Arc::default(), true);
        let [a, b] = ["a", "b"].map(|n| folder.path().join(n));
        session.staging.stage(&session, &a, b"1").expect("a");
        session.staging.stage(&session, &b, b"2").expect("b");
        assert!(!a.exists() && !b.exists());
        session.staging.commit(&session, false).expect("commit");
        assert_eq!(names(folder.path()), ["a", "b"]);
        assert!(!session.staging.abandon(), "too late");
    }

    #[test]
    fn a_file_that_appeared_meanwhile_is_kept_and_ours_are_removed() {
        let folder = tempfile::tempdir().expect("folder");
        let session = Session::new(Arc::default(), true);
        let [a, b] = ["a", "b"].map(|n| folder.path().join(n));
        session.staging.stage(&session, &a, b"1").expect("a");
        session.staging.stage(&session, &b, b"2").expect("b");
        std::fs::write(&b, b"theirs").expect("theirs");
        let error = session.staging.commit(&session, false).expect_err("exists");
        assert!(matches!(error, Error::Exists { path } if path == b));
        assert_eq!(names(folder.path()), ["b"]);
        assert_eq!(std::fs::read(&b).expect("read"), b"theirs");
    }

    #[test]
    #[cfg(unix)]
    fn replacing_keeps_links_and_permissions() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().expect("folder");
        let session = Session::new(Arc::default(), true);
        let [file, link] = ["file", "link"].map(|n| folder.path().join(n));
        std::fs::write(&file, b"old").expect("file");
        std::fs::set_permissions(&file, Permissions::from_mode(0o640)).expect("chmod");
        std::os::unix::fs::symlink(&file, &link).expect("link");
        session.staging.stage(&session, &link, b"new").expect("stage");
        session.staging.commit(&session, true).expect("commit");
        assert!(link.symlink_metadata().expect("link").is_symlink());
        assert_eq!(std::fs::read(&file).expect("file"), b"new");
        assert_eq!(file.metadata().expect("file").permissions().mode() & 0o777, 0o640);
    }

    #[test]
    fn abandoned_files_vanish_and_stay_away() {
        let folder = tempfile::tempdir().expect("folder");
        let session = Session::new(Arc::default(), true);
        let a = folder.path().join("a");
        session.staging.stage(&session, &a, b"1").expect("a");
        assert!(session.staging.abandon());
        assert_eq!(names(folder.path()), [""; 0]);
        assert!(matches!(session.staging.commit(&session, false), Err(Error::Cancelled)));
        assert!(matches!(session.staging.stage(&session, &a, b"1"), Err(Error::Cancelled)));
    }
}
