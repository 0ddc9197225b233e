//! Errors become the exceptions of `python/texforge/_errors.py`.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::base::error::{Error, ErrorKind, Result};

/// Results that can be handed to Python.
pub(super) trait IntoPy<T> {
    /// The same, with the error as its Python exception.
    fn into_py(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> IntoPy<T> for Result<T> {
    fn into_py(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error).unwrap_or_else(|failure| failure))
    }
}

/// Calls `_errors.from_core(kind, message, fields)`.
fn exception(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let fields = fields(py, error)?;
    let from_core = py.import("texforge._errors")?.getattr("from_core")?;
    from_core.call1((error.kind().slug(), error.to_string(), fields)).map(PyErr::from_value)
}

/// The error's fields by name.
fn fields<'py>(py: Python<'py>, error: &Error) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    match error {
        Error::Parameter { name, expected, got } => {
            dict.set_item("name", name)?;
            dict.set_item("expected", expected)?;
            dict.set_item("got", got)?;
        }
        Error::TooSmall { what, width, height, need, .. } => {
            dict.set_item("what", what)?;
            dict.set_item("size", (height, width))?;
            dict.set_item("need", need)?;
        }
        Error::EmptyMask { usable, patch } => {
            dict.set_item("usable", usable)?;
            dict.set_item("patch", patch)?;
        }
        Error::NotFinite { what, count, y, x } => {
            dict.set_item("what", what)?;
            dict.set_item("count", count)?;
            dict.set_item("first", (y, x))?;
        }
        Error::SizeMismatch { what, got_w, got_h, want_w, want_h, .. } => {
            dict.set_item("what", what)?;
            dict.set_item("size", (got_h, got_w))?;
            dict.set_item("expected", (want_h, want_w))?;
        }
        Error::BadPicture { what, .. } => dict.set_item("what", what)?,
        Error::NoStructure { what, confidence, least, .. } => {
            dict.set_item("what", what)?;
            dict.set_item("confidence", confidence)?;
            dict.set_item("least", least)?;
        }
        Error::Document { reason } => dict.set_item("reason", reason)?,
        Error::Memory { what, need_mib, available_mib } => {
            dict.set_item("what", what)?;
            dict.set_item("need_mib", need_mib)?;
            dict.set_item("available_mib", available_mib)?;
        }
        Error::Decode { path, .. }
        | Error::Format { path, .. }
        | Error::Exists { path }
        | Error::SameFile { path } => dict.set_item("path", path)?,
        Error::Io { action, path, source } => {
            dict.set_item("action", action)?;
            dict.set_item("path", path)?;
            dict.set_item("errno", errno(source))?;
        }
        Error::Cancelled | Error::Internal { .. } => {}
    }
    Ok(dict)
}

/// The system's error number; if the error was made without one, that of its kind.
fn errno(error: &std::io::Error) -> Option<i32> {
    use std::io::ErrorKind as Kind;
    // The numbers that Linux, macOS and Windows' C library share.
    error.raw_os_error().or(match error.kind() {
        Kind::NotFound => Some(2),
        Kind::PermissionDenied => Some(13),
        Kind::AlreadyExists => Some(17),
        Kind::NotADirectory => Some(20),
        Kind::IsADirectory => Some(21),
        _ => None,
    })
}

/// An error of this kind, for the tests; panics for `internal`, as a bug would.
pub(super) fn example(kind: &str) -> Result<()> {
    let kind = ErrorKind::ALL
        .into_iter()
        .find(|k| k.slug() == kind)
        .ok_or_else(|| Error::parameter("kind", "a kind of error", format!("`{kind}`")))?;
    let what = || String::from("the example");
    let path = || "example.png".into();
    Err(match kind {
        ErrorKind::Parameter => Error::parameter("patch", "3 to 31", 99),
        ErrorKind::TooSmall => {
            Error::TooSmall { what: what(), width: 3, height: 4, need: 11, remedy: what() }
        }
        ErrorKind::EmptyMask => Error::EmptyMask { usable: 3, patch: 11 },
        ErrorKind::NotFinite => Error::NotFinite { what: what(), count: 1, y: 2, x: 3 },
        ErrorKind::SizeMismatch => Error::SizeMismatch {
            what: what(),
            got_w: 1,
            got_h: 2,
            want_w: 3,
            want_h: 4,
            remedy: what(),
        },
        ErrorKind::BadPicture => Error::BadPicture { what: what(), reason: what() },
        ErrorKind::NoStructure => {
            Error::NoStructure { what: what(), confidence: 0.1, least: 0.5, remedy: what() }
        }
        ErrorKind::Document => Error::Document { reason: what() },
        ErrorKind::Memory => Error::Memory { what: what(), need_mib: 2, available_mib: 1 },
        ErrorKind::Decode => Error::Decode { path: path(), reason: what() },
        ErrorKind::Format => Error::Format { path: path(), reason: what() },
        ErrorKind::Io => Error::io("read", path())(std::io::ErrorKind::NotFound.into()),
        ErrorKind::Exists => Error::Exists { path: path() },
        ErrorKind::SameFile => Error::SameFile { path: path() },
        ErrorKind::Cancelled => Error::Cancelled,
        ErrorKind::Internal => panic!("an example of a bug"),
    })
}
