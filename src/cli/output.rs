//! Where results go: a file, or standard output.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::cli::exit::STDOUT;

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
