//! [`Staging`]: files that appear all at once or not at all.

use std::fs::{File, Permissions};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use tempfile::TempPath;

use super::place::{folder_of, resolved};
use crate::base::ctx::Job;
use crate::base::error::{Error, Result};

/// Bytes written between two looks at the cancel flag.
const CHUNK: usize = 1 << 20;

/// Files that are complete on disk under a temporary name, waiting to be renamed together. Once its
/// job is cancelled, none can be begun, written to or renamed any more; those that wait are removed
/// with it.
#[derive(Debug, Default)]
pub(crate) struct Staging {
    job: Arc<Job>,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    waiting: Vec<Waiting>,
    /// No file may be begun or finished any more.
    closed: bool,
    /// The files have their names: too late to stop.
    done: bool,
}

#[derive(Debug)]
struct Waiting {
    name: TempPath,
    /// Where it goes, symbolic links followed.
    target: PathBuf,
    /// The same as the caller calls it.
    path: PathBuf,
}

impl Staging {
    /// For the files of a run that can be cancelled.
    pub(crate) fn new(job: Arc<Job>) -> Self {
        Self { job, state: Mutex::default() }
    }

    /// Puts `bytes` under a temporary name beside `path`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Cancelled`].
    pub(crate) fn stage(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.stage_with(path, |out| out.write_all(bytes).map_err(Error::io("write", path)))
    }

    /// Puts what `write` writes under a temporary name beside `path`.
    ///
    /// # Errors
    /// Those of `write`, [`Error::Io`], [`Error::Cancelled`].
    pub(crate) fn stage_with(
        &self,
        path: &Path,
        write: impl FnOnce(&mut Begun<'_>) -> Result<()>,
    ) -> Result<()> {
        let refused = || Error::io("write", path);
        // Replacing what a symbolic link leads to keeps the link.
        let target = resolved(path);
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
            let begun = builder.tempfile_in(folder_of(&target)).map_err(refused())?;
            let (file, name) = begun.into_parts();
            state.waiting.push(Waiting { name, target: target.clone(), path: path.to_owned() });
            file
        };
        let mut begun = Begun { file, job: &self.job };
        let written = write(&mut begun);
        // Whatever else a cancelled write says.
        check(&self.job)?;
        written?;
        let file = begun.file;
        if let Ok(old) = std::fs::metadata(&target) {
            file.set_permissions(old.permissions()).map_err(refused())?;
        }
        // After a power cut the new name must not stand for an empty file.
        file.sync_all().map_err(refused())
    }

    /// Gives all files their names. If one cannot have it, none has: new ones are removed again, and
    /// with `force` the old ones come back (where the file system has hard links).
    ///
    /// # Errors
    /// [`Error::Exists`] (without `force`), [`Error::Io`], [`Error::Cancelled`].
    pub(crate) fn commit(&self, force: bool) -> Result<()> {
        let mut state = self.lock();
        check(&self.job)?;
        if state.closed {
            return Err(Error::Cancelled);
        }
        let mut written: Vec<(PathBuf, Option<TempPath>)> = Vec::new();
        for Waiting { name, target, path } in state.waiting.drain(..) {
            let old = if force { aside(&target) } else { None };
            // Someone else may have made the file since it was checked.
            let named = if force { name.persist(&target) } else { name.persist_noclobber(&target) };
            if let Err(error) = named {
                for (path, old) in written {
                    // The first error is the one to tell.
                    let _ = match old {
                        Some(old) => old.persist(&path).map_err(|e| e.error),
                        None => std::fs::remove_file(&path),
                    };
                }
                return Err(match error.error.kind() {
                    ErrorKind::AlreadyExists if !force => Error::Exists { path },
                    _ => Error::io("write", path)(error.error),
                });
            }
            written.push((target, old));
        }
        state.done = true;
        Ok(())
    }

    /// Removes what was begun; nothing can be finished afterwards. `false` if all is finished
    /// already.
    pub(crate) fn abandon(&self) -> bool {
        let mut state = self.lock();
        if state.done {
            return false;
        }
        state.closed = true;
        state.waiting.clear();
        true
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes one file: it is there whole or not at all.
///
/// # Errors
/// [`Error::Exists`] (without `force`), [`Error::Io`].
pub(super) fn put(path: &Path, bytes: &[u8], force: bool) -> Result<()> {
    let staging = Staging::default();
    staging.stage(path, bytes)?;
    staging.commit(force)
}

/// Another name for a file that is about to be replaced, if there is one; it goes away when dropped.
fn aside(path: &Path) -> Option<TempPath> {
    let link = |name: &Path| std::fs::hard_link(path, name);
    let mut builder = tempfile::Builder::new();
    let linked = builder.prefix(".texforge-").suffix(".old").make_in(folder_of(path), link);
    linked.ok().map(tempfile::NamedTempFile::into_temp_path)
}

fn check(job: &Job) -> Result<()> {
    if job.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
}

/// A file of [`Staging`] while it is written; once the run was cancelled, writing fails.
#[derive(Debug)]
pub(crate) struct Begun<'a> {
    file: File,
    job: &'a Job,
}

impl Write for Begun<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        check(self.job).map_err(std::io::Error::other)?;
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
        let staging = Staging::default();
        let [a, b] = ["a", "b"].map(|n| folder.path().join(n));
        staging.stage(&a, b"1").expect("a");
        staging.stage(&b, b"2").expect("b");
        assert!(!a.exists() && !b.exists());
        staging.commit(false).expect("commit");
        assert_eq!(names(folder.path()), ["a", "b"]);
        assert!(!staging.abandon(), "too late");
    }

    #[test]
    fn a_file_that_appeared_meanwhile_is_kept_and_ours_are_removed() {
        let folder = tempfile::tempdir().expect("folder");
        let staging = Staging::default();
        let [a, b] = ["a", "b"].map(|n| folder.path().join(n));
        staging.stage(&a, b"1").expect("a");
        staging.stage(&b, b"2").expect("b");
        std::fs::write(&b, b"theirs").expect("theirs");
        let error = staging.commit(false).expect_err("exists");
        assert!(matches!(error, Error::Exists { path } if path == b));
        assert_eq!(names(folder.path()), ["b"]);
        assert_eq!(std::fs::read(&b).expect("read"), b"theirs");
    }

    #[test]
    #[cfg(unix)]
    fn replacing_keeps_links_and_permissions() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().expect("folder");
        let staging = Staging::default();
        let [file, link] = ["file", "link"].map(|n| folder.path().join(n));
        std::fs::write(&file, b"old").expect("file");
        std::fs::set_permissions(&file, Permissions::from_mode(0o640)).expect("chmod");
        std::os::unix::fs::symlink(&file, &link).expect("link");
        staging.stage(&link, b"new").expect("stage");
        staging.commit(true).expect("commit");
        assert!(link.symlink_metadata().expect("link").is_symlink());
        assert_eq!(std::fs::read(&file).expect("file"), b"new");
        assert_eq!(file.metadata().expect("file").permissions().mode() & 0o777, 0o640);
    }

    #[test]
    fn files_are_written_in_pieces_anywhere() {
        let folder = tempfile::tempdir().expect("folder");
        let staging = Staging::default();
        let a = folder.path().join("a");
        let write = |out: &mut Begun<'_>| {
            let mut pieces = || {
                out.write_all(b"....")?;
                out.write_all(&vec![7; CHUNK + 1])?;
                out.seek(SeekFrom::Start(0))?;
                out.write_all(b"head")
            };
            pieces().map_err(Error::io("write", &a))
        };
        staging.stage_with(&a, write).expect("stage");
        assert!(!a.exists());
        staging.commit(false).expect("commit");
        let bytes = std::fs::read(&a).expect("a");
        assert_eq!((&bytes[..5], bytes.len()), (&b"head\x07"[..], CHUNK + 5));
    }

    #[test]
    fn a_cancelled_write_ends_and_says_so() {
        let folder = tempfile::tempdir().expect("folder");
        let staging = Staging::default();
        let a = folder.path().join("a");
        let write = |out: &mut Begun<'_>| {
            out.write_all(b"1").map_err(Error::io("write", &a))?;
            staging.job.cancel();
            out.write_all(b"2").map_err(Error::io("write", &a))?;
            panic!("written after the cancel");
        };
        let result = staging.stage_with(&a, write);
        assert!(matches!(result, Err(Error::Cancelled)), "{result:?}");
        assert!(staging.abandon());
        assert_eq!(names(folder.path()), [""; 0]);
    }

    #[test]
    fn abandoned_files_vanish_and_stay_away() {
        let folder = tempfile::tempdir().expect("folder");
        let staging = Staging::default();
        let a = folder.path().join("a");
        staging.stage(&a, b"1").expect("a");
        assert!(staging.abandon());
        assert_eq!(names(folder.path()), [""; 0]);
        assert!(matches!(staging.commit(false), Err(Error::Cancelled)));
        assert!(matches!(staging.stage(&a, b"1"), Err(Error::Cancelled)));
    }

    #[test]
    fn puts_whole_files_with_ordinary_permissions() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("a.bin");
        put(&path, b"one", false).expect("new");
        assert_eq!(
            put(&path, b"two", false).expect_err("refused").kind(),
            crate::base::error::ErrorKind::Exists
        );
        assert_eq!(std::fs::read(&path).expect("read"), b"one");
        put(&path, b"two", true).expect("replace");
        assert_eq!(std::fs::read(&path).expect("read"), b"two");
        assert_eq!(std::fs::read_dir(dir.path()).expect("list").count(), 1, "nothing left behind");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let mode = |p: &Path| std::fs::metadata(p).expect("meta").permissions().mode() & 0o777;
            let plain = dir.path().join("plain");
            std::fs::write(&plain, b"").expect("plain");
            assert_eq!(mode(&path), mode(&plain), "as a normally created file");
            std::fs::set_permissions(&path, Permissions::from_mode(0o640)).expect("chmod");
            put(&path, b"three", true).expect("replace");
            assert_eq!(mode(&path), 0o640, "kept when replaced");
            let link = dir.path().join("link");
            std::os::unix::fs::symlink(&path, &link).expect("link");
            put(&link, b"four", true).expect("through the link");
            assert!(std::fs::symlink_metadata(&link).expect("meta").is_symlink(), "still a link");
            assert_eq!(std::fs::read(&path).expect("read"), b"four");
        }
    }

    #[test]
    fn old_files_come_back_if_not_all_can_be_replaced() {
        let folder = tempfile::tempdir().expect("folder");
        let [a, b, c] = ["a", "b", "c"].map(|n| folder.path().join(n));
        std::fs::write(&a, b"old").expect("old");
        let staging = Staging::default();
        for path in [&a, &b, &c] {
            staging.stage(path, b"new").expect("staged");
        }
        std::fs::create_dir(&c).expect("in the way");
        let error = staging.commit(true).expect_err("a folder");
        assert!(matches!(error, Error::Io { path, .. } if path == c));
        assert_eq!(names(folder.path()), ["a", "c"]);
        assert_eq!(std::fs::read(&a).expect("read"), b"old");
    }
}
