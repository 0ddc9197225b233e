//! Where files go: checked before the work, put there whole after it.

use std::fs;
use std::io::ErrorKind;
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

/// Fails if one of these outputs, each with the flag that asks for it, cannot be written, or two are
/// the same file.
///
/// # Errors
/// Those of [`check_output`], [`Error::Parameter`].
pub(crate) fn check_outputs(
    outputs: impl Iterator<Item = (&'static str, PathBuf)>,
    inputs: &[&Path],
    force: bool,
) -> Result<()> {
    let mut seen: Vec<PathBuf> = Vec::new();
    for (name, path) in outputs {
        check_output(&path, inputs, force)?;
        let absolute = std::path::absolute(&path).map_err(Error::io("write", &path))?;
        if seen.contains(&absolute) {
            let got = format!("{} twice", path.display());
            return Err(Error::parameter(name, "a file of its own for each output", got));
        }
        seen.push(absolute);
    }
    Ok(())
}

/// The file that `path` names, symbolic links followed if they lead somewhere.
pub(super) fn resolved(path: &Path) -> PathBuf {
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
}
