//! Where results go: files that appear all at once or not at all, or standard output.

use std::fs::{File, Permissions};
use std::io::{Seek, SeekFrom, Write};
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
        self.stage_with(session, path, |out| out.write_all(bytes).map_err(Error::io("write", path)))
    }

    /// Puts what `write` writes under a temporary name beside `path`.
    ///
    /// # Errors
    /// Those of `write`, [`Error::Io`], [`Error::Cancelled`].
    pub(super) fn stage_with(
        &self,
        session: &Session,
        path: &Path,
        write: impl FnOnce(&mut Begun) -> Result<()>,
    ) -> Result<()> {
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
        let file = {
            let mut state = self.lock();
            if state.closed {
                return Err(Error::Cancelled);
            }
            let (file, name) = builder.tempfile_in(folder).map_err(refused())?.into_parts();
            state.waiting.push((name, target.clone()));
            file
        };
        let mut begun = Begun { file, session };
        let written = write(&mut begun);
        // Whatever else a cancelled write says.
        session.check()?;
        written?;
        let file = begun.file;
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

/// A file of [`Staging`] while it is written; once the user has asked to stop, writing fails.
#[derive(Debug)]
pub(super) struct Begun<'a> {
    file: File,
    session: &'a Session,
}

impl Write for Begun<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.session.check().map_err(std::io::Error::other)?;
        self.file.write(&bytes[..bytes.len().min(CHUNK)])
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Begun<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(to)
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
    fn files_are_written_in_pieces_anywhere() {
        let folder = tempfile::tempdir().expect("folder");
        let session = Session::new(Arc::default(), true);
        let a = folder.path().join("a");
        let write = |out: &mut Begun| {
            let mut pieces = || {
                out.write_all(b"....")?;
                out.write_all(&vec![7; CHUNK + 1])?;
                out.seek(SeekFrom::Start(0))?;
                out.write_all(b"head")
            };
            pieces().map_err(Error::io("write", &a))
        };
        session.staging.stage_with(&session, &a, write).expect("stage");
        assert!(!a.exists());
        session.staging.commit(&session, false).expect("commit");
        let bytes = std::fs::read(&a).expect("a");
        assert_eq!((&bytes[..5], bytes.len()), (&b"head\x07"[..], CHUNK + 5));
    }

    #[test]
    fn a_cancelled_write_ends_and_says_so() {
        let folder = tempfile::tempdir().expect("folder");
        let session = Session::new(Arc::default(), true);
        let a = folder.path().join("a");
        let write = |out: &mut Begun| {
            out.write_all(b"1").map_err(Error::io("write", &a))?;
            session.job.cancel();
            out.write_all(b"2").map_err(Error::io("write", &a))?;
            panic!("written after the cancel");
        };
        let result = session.staging.stage_with(&session, &a, write);
        assert!(matches!(result, Err(Error::Cancelled)), "{result:?}");
        assert!(session.staging.abandon());
        assert_eq!(names(folder.path()), [""; 0]);
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
