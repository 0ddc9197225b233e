//! Files that are no pictures: documents and exports.

use std::path::{Path, PathBuf};

use super::load;
use super::place::check_place;
use super::staging::Staging;
use crate::base::error::{Error, Result};

/// Reads a file of text (UTF-8).
///
/// # Errors
/// [`Error::Io`]; [`Error::Decode`] if it is not text; [`Error::Memory`].
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(load(path)?).map_err(|_| Error::Decode {
        path: path.to_owned(),
        reason: "it is not text (UTF-8); give the right file".into(),
    })
}

/// Writes files: all of them, each whole, or none.
///
/// # Errors
/// [`Error::Exists`] (unless `force`), [`Error::Io`].
pub fn write_files(files: &[(PathBuf, Vec<u8>)], force: bool) -> Result<()> {
    files.iter().try_for_each(|(path, _)| check_place(path, &[], force))?;
    let staging = Staging::default();
    files.iter().try_for_each(|(path, bytes)| staging.stage(path, bytes))?;
    staging.commit(force)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::error::ErrorKind as Kind;

    #[test]
    fn nothing_is_written_if_one_file_is_there() {
        let dir = tempfile::tempdir().expect("folder");
        let [a, b] = ["a.txt", "b.txt"].map(|name| dir.path().join(name));
        std::fs::write(&b, "old").expect("old");
        let files = [(a.clone(), b"one".to_vec()), (b.clone(), b"two".to_vec())];
        assert_eq!(write_files(&files, false).expect_err("refused").kind(), Kind::Exists);
        assert!(!a.exists());
        assert_eq!(read_text(&b).expect("text"), "old");
        write_files(&files, true).expect("replaced");
        assert_eq!(read_text(&a).expect("text") + &read_text(&b).expect("text"), "onetwo");
    }

    #[test]
    fn what_is_no_text_is_refused() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("a.json");
        std::fs::write(&path, b"\xff\xfe").expect("bytes");
        assert_eq!(read_text(&path).expect_err("refused").kind(), Kind::Decode);
        assert_eq!(read_text(dir.path()).expect_err("refused").kind(), Kind::Io);
    }
}
