//! The command line: what is typed becomes a call of a verb, what comes back becomes files.
//!
//! Standard output is data, standard error is for people. Only this room may print, read the
//! environment or end the process.

mod apply;
mod args;
mod exit;
mod extract;
mod files;
mod folder;
mod lattice;
mod maps;
mod noise;
mod output;
mod palette;
mod regular;
mod show;
mod small;
mod sources;
pub mod study;
mod summary;
mod tile;
mod wang;
mod work;

use std::ffi::OsString;

use clap::error::ErrorKind as Usage;

use crate::base::error::Error;

/// Runs the program with these arguments (the first is its name); returns the exit status:
/// 0 done, 1 cannot, 2 wrong usage, 130 interrupted.
///
/// Ctrl-C, SIGTERM and SIGHUP are caught from the first run on, also when a host program (the
/// Python wheel's console script) calls this.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    keep_memory();
    let matches = match args::command().try_get_matches_from(args) {
        Ok(matches) => matches,
        Err(error) => return misunderstood(&error),
    };
    let Some((command, matches)) = matches.subcommand() else {
        return exit::USAGE;
    };
    let mut command = command.to_owned();
    let result = match command.as_str() {
        "tile" => tile::run(matches),
        "palette" => palette::run(matches),
        "extract" => extract::run(matches),
        "wang" => wang::run(matches),
        "apply" => apply::run(matches),
        "lattice" => lattice::run(matches),
        "regular" => regular::run(matches),
        "noise" => {
            // Errors are told of the command that was typed.
            command.extend(matches.subcommand_name().map(|name| format!(" {name}")));
            noise::run(matches)
        }
        "params" => small::params(matches),
        "info" => small::info(matches),
        "completions" => small::completions(matches),
        "man" => small::man(matches),
        "study" => return study::elsewhere(),
        other => Err(Error::Internal { message: format!("command {other} is not connected") }),
    };
    match result {
        Ok(()) => exit::DONE,
        Err(error) => {
            if !exit::is_broken_pipe(&error) {
                tell(&error, &command);
            }
            exit::status(&error)
        }
    }
}

/// Lets the process keep what it frees. The allocator of GNU/Linux hands blocks back to the system
/// and asks for new ones over and over, until it has seen a large one freed; new pages take time,
/// and more where threads share the work. Other allocators do not mind.
fn keep_memory() {
    // It learns from blocks below 32 MiB. No page of this one is ever touched.
    const LARGE: usize = 31 << 20;
    let mut block = Vec::<u8>::new();
    if block.try_reserve_exact(LARGE).is_ok() {
        std::hint::black_box(&block);
    }
}

/// Shows help that was asked for, or what is wrong with what was typed.
fn misunderstood(error: &clap::Error) -> u8 {
    match error.kind() {
        Usage::DisplayHelp | Usage::DisplayVersion => {
            // A closed pipe is all that can go wrong here, and then nobody reads.
            let _ = error.print();
            exit::DONE
        }
        Usage::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            exit::USAGE
        }
        _ => {
            let text = error.render().to_string();
            let text = text.strip_prefix("error: ").unwrap_or(&text);
            show::write_line(&format!("texforge: {}", text.trim_end()));
            exit::USAGE
        }
    }
}

/// One sentence, one hint.
fn tell(error: &Error, command: &str) {
    if matches!(error, Error::Cancelled) {
        show::write_line("texforge: interrupted; nothing was written");
        return;
    }
    // The sentence may quote file names and decoders' messages, which may hold line breaks.
    let sentence = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    show::write_line(&format!("texforge: {sentence}"));
    if let Some(hint) = exit::hint(error, command, &args::flags_of(command)) {
        show::write_line(&format!("hint: {hint}"));
    }
}
