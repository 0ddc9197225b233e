//! Exit statuses, and how an error is told: one sentence, one hint that names the flag.

use std::path::Path;

use crate::base::error::Error;

/// Everything was done.
pub(super) const DONE: u8 = 0;
/// The work could not be done.
pub(super) const CANNOT: u8 = 1;
/// The command line is wrong.
pub(super) const USAGE: u8 = 2;
/// Ctrl-C.
pub(super) const INTERRUPTED: u8 = 130;

/// What standard output is called in errors.
pub(super) const STDOUT: &str = "standard output";

/// The exit status of a run that ended with this error.
pub(super) fn status(error: &Error) -> u8 {
    match error {
        Error::Parameter { .. } => USAGE,
        Error::Cancelled => INTERRUPTED,
        // Whoever reads our output has seen enough: nothing went wrong.
        error if is_broken_pipe(error) => DONE,
        _ => CANNOT,
    }
}

/// Whether the reader of standard output went away.
pub(super) fn is_broken_pipe(error: &Error) -> bool {
    matches!(error, Error::Io { path, source, .. }
        if source.kind() == std::io::ErrorKind::BrokenPipe && path == Path::new(STDOUT))
}

/// What the user can type to get on; `None` where the sentence says it already.
///
/// `flags` are the long flags of the command that failed.
pub(super) fn hint(error: &Error, command: &str, flags: &[String]) -> Option<String> {
    let has = |flag: &str| flags.iter().any(|f| f == flag);
    let first = |wanted: &[&str]| {
        let found: Vec<_> = wanted.iter().filter(|f| has(f)).map(|f| format!("--{f}")).collect();
        (!found.is_empty()).then(|| found.join(" or "))
    };
    match error {
        Error::Parameter { name, .. } => {
            let flag = name.replace('_', "-");
            let help = format!("`texforge {command} --help` lists what is accepted");
            Some(if has(&flag) { format!("change --{flag}; {help}") } else { help })
        }
        Error::TooSmall { .. } => Some(format!("change {}", first(&["patch", "size"])?)),
        Error::EmptyMask { .. } => Some(format!("change {}", first(&["mask", "avoid", "patch"])?)),
        Error::Memory { .. } => Some(format!("change {}", first(&["size", "symmetry"])?)),
        Error::SizeMismatch { what, .. } if what.contains("sigma map") => {
            Some(format!("change {}", first(&["sigma-map"])?))
        }
        Error::SizeMismatch { what, .. } if what.contains("avoid") => {
            Some(format!("change {}", first(&["avoid"])?))
        }
        Error::SizeMismatch { what, .. } if what.contains("mask") => {
            Some(format!("change {}", first(&["mask"])?))
        }
        Error::SizeMismatch { .. } => Some(format!("change {}", first(&["map"])?)),
        Error::SameFile { .. } | Error::Format { .. } if has("output") => {
            Some("change --output (-o)".into())
        }
        Error::Io { action: "write", .. } if has("output") => {
            Some("choose a folder that exists and that you may write to with --output (-o)".into())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_pipe_is_success_only_on_standard_output() {
        let broken = || std::io::Error::from(std::io::ErrorKind::BrokenPipe);
        assert_eq!(status(&Error::io("write", STDOUT)(broken())), DONE);
        assert_eq!(status(&Error::io("write", "tile.png")(broken())), CANNOT);
    }

    #[test]
    fn hints_name_flags_that_exist() {
        let flags = ["patch".to_owned(), "size".to_owned()];
        let error = Error::EmptyMask { usable: 3, patch: 11 };
        assert_eq!(hint(&error, "tile", &flags).as_deref(), Some("change --patch"));
        let error = Error::parameter("patch", "3 to 31", 99);
        let hint = hint(&error, "tile", &flags).expect("hint");
        assert!(hint.starts_with("change --patch; `texforge tile --help`"), "{hint}");
    }

    #[test]
    fn bugs_cannot_and_cancelled_is_interrupted() {
        assert_eq!(status(&Error::Internal { message: "boom".into() }), CANNOT);
        assert_eq!(status(&Error::Cancelled), INTERRUPTED);
    }
}
