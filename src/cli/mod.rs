//! The command line.

use std::ffi::OsString;

/// Runs the program with these arguments (the first is its name); returns the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let _ = args.into_iter().count();
    0
}
