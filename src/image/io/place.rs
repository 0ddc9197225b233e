//! Where files go: checked before the work, put there whole after it.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::Format;
use crate::base::error::{Error, Result};

/// Checks, before the long work, that `path` can be written: a known extension, a folder that
/// exists and takes new files, no file there (unless `force`), and none of the `inputs` under
/// another name (symbolic link, hard link, other spelling).
///
/// # Errors
/// [`Error::Format`], [`Error::Io`], [`Error::SameFile`], [`Error::Exists`].
pub fn check_output(path: &Path, inputs: &[&Path], force: bool) -> Result<()> {
    known_extension(path)?;
    check_place(path, inputs, force)
}

/// The format of `path` for writing.
pub(super) fn known_extension(path: &Path) -> Result<Format> {
    Format::from_extension(path).ok_or_else(|| {
        let ending = path.extension().map(|e| format!(".{}", e.display()));
        let reason = match ending {
            Some(ending) => format!("unknown extension {ending}; use {}", Format::WRITABLE),
            None => format!("the name has no extension; use {}", Format::WRITABLE),
        };
        Error::Format { path: path.to_owned(), reason }
    })
}

/// The same for a file that is no picture: any extension, or none.
///
/// # Errors
/// [`Error::Io`], [`Error::SameFile`], [`Error::Exists`].
pub fn check_place(path: &Path, inputs: &[&Path], force: bool) -> Result<()> {
    let io = |path: &Path, source| Error::Io { action: "write", path: path.to_owned(), source };
    if path.is_dir() {
        return Err(io(path, ErrorKind::IsADirectory.into()));
    }
    let here = fs::symlink_metadata(path).is_ok();
    if here {
        for input in inputs {
            if same_file::is_same_file(path, input).unwrap_or(false) {
                return Err(Error::SameFile { path: path.to_owned() });
            }
        }
        if !force {
            return Err(Error::Exists { path: path.to_owned() });
        }
    }
    // Trying is the only honest answer to "is it writable?".
    let target = resolved(path);
    let folder = folder_of(&target);
    tempfile::Builder::new()
        .prefix(".texforge-")
        .tempfile_in(folder)
        .map(drop)
        .map_err(|source| io(path, source))
}

/// Writes `bytes` to `path` so that the file is there whole or not at all.
///
/// With `force` an existing file is replaced (a symbolic link's target, not the link) and its
/// permissions are kept; a new file gets the permissions that any new file gets.
pub(super) fn put(path: &Path, bytes: &[u8], force: bool) -> Result<()> {
    let io = |source| Error::Io { action: "write", path: path.to_owned(), source };
    let target = if force { resolved(path) } else { path.to_owned() };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".texforge-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Subject to the umask, as for any new file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder_of(&target)).map_err(io)?;
    file.write_all(bytes).map_err(io)?;
    if force && let Ok(old) = fs::metadata(&target) {
        file.as_file().set_permissions(old.permissions()).map_err(io)?;
    }
    file.as_file().sync_all().map_err(io)?;
    if force {
        file.persist(&target).map_err(|e| io(e.error))?;
    } else {
        file.persist_noclobber(&target).map_err(|e| match e.error.kind() {
            ErrorKind::AlreadyExists => Error::Exists { path: path.to_owned() },
            _ => io(e.error),
        })?;
    }
    Ok(())
}

/// The file that `path` names, symbolic links followed if they lead somewhere.
fn resolved(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::error::ErrorKind as Kind;

    fn kind(result: Result<()>) -> Kind {
        result.expect_err("refused").kind()
    }

    #[test]
    fn finds_every_reason_not_to_write() {
        let dir = tempfile::tempdir().expect("folder");
        let photo = dir.path().join("photo.png");
        fs::write(&photo, b"x").expect("photo");
        let inputs = [photo.as_path()];
        let check = |name: &str, force| check_output(&dir.path().join(name), &inputs, force);

        assert!(check("tile.png", false).is_ok());
        assert!(fs::read_dir(dir.path()).expect("list").count() == 1, "leaves nothing behind");
        assert_eq!(kind(check("tile", false)), Kind::Format);
        assert_eq!(kind(check("tile.doc", false)), Kind::Format);
        assert_eq!(kind(check("missing/tile.png", false)), Kind::Io);
        assert_eq!(kind(check("photo.png", true)), Kind::SameFile);
        fs::create_dir(dir.path().join("sub")).expect("sub");
        assert_eq!(kind(check("sub/../photo.png", true)), Kind::SameFile);
        fs::write(dir.path().join("old.png"), b"x").expect("old");
        assert_eq!(kind(check("old.png", false)), Kind::Exists);
        assert!(check("old.png", true).is_ok());
        fs::create_dir(dir.path().join("dir.png")).expect("dir");
        assert_eq!(kind(check("dir.png", true)), Kind::Io);
        fs::hard_link(&photo, dir.path().join("hard.png")).expect("hard link");
        assert_eq!(kind(check("hard.png", true)), Kind::SameFile);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&photo, dir.path().join("soft.png")).expect("link");
            assert_eq!(kind(check("soft.png", true)), Kind::SameFile);
        }
    }

    #[test]
    fn puts_whole_files_with_ordinary_permissions() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("a.bin");
        put(&path, b"one", false).expect("new");
        assert_eq!(kind(put(&path, b"two", false)), Kind::Exists);
        assert_eq!(fs::read(&path).expect("read"), b"one");
        put(&path, b"two", true).expect("replace");
        assert_eq!(fs::read(&path).expect("read"), b"two");
        assert_eq!(fs::read_dir(dir.path()).expect("list").count(), 1, "nothing left behind");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = |p: &Path| fs::metadata(p).expect("meta").permissions().mode() & 0o777;
            let plain = dir.path().join("plain");
            fs::write(&plain, b"").expect("plain");
            assert_eq!(mode(&path), mode(&plain), "as a normally created file");
            fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("chmod");
            put(&path, b"three", true).expect("replace");
            assert_eq!(mode(&path), 0o640, "kept when replaced");
            let link = dir.path().join("link");
            std::os::unix::fs::symlink(&path, &link).expect("link");
            put(&link, b"four", true).expect("through the link");
            assert!(fs::symlink_metadata(&link).expect("meta").is_symlink(), "still a link");
            assert_eq!(fs::read(&path).expect("read"), b"four");
        }
    }
}
