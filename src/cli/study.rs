//! `texforge study`: its command line. The Python package does the work: it has the statistics and
//! the plots.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Arg, Command, value_parser};

use crate::cli::{args, exit, misunderstood, show};

const EXAMPLES: &str = "\
Examples:
  texforge study photos -o study
  texforge study photos -o study --seeds 10 --size 256 --threads 1
  texforge study photos -o study --measures histogram --json";

/// What was asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Folder of photos.
    pub folder: PathBuf,
    /// Folder to write.
    pub output: PathBuf,
    /// Number of seeds.
    pub seeds: u64,
    /// Side of the tiles in pixels.
    pub size: u64,
    /// Measures by name; `None`: all.
    pub measures: Option<Vec<String>>,
    /// Patches compared for a texture cost.
    pub samples: u64,
    /// Worker threads; 0: one per core.
    pub threads: u64,
    /// Whether the summary goes to standard output.
    pub json: bool,
    /// Whether nothing but errors is said.
    pub quiet: bool,
}

/// Reads the arguments of the program, the second of which is `study`.
///
/// # Errors
/// The exit status, if there is nothing to do: help was asked for and shown, or what was typed is
/// wrong, which was said.
pub fn request(args: impl IntoIterator<Item = OsString>) -> Result<Request, u8> {
    let matches = args::command().try_get_matches_from(args).map_err(|e| misunderstood(&e))?;
    let Some(("study", matches)) = matches.subcommand() else { return Err(exit::USAGE) };
    let path = |id: &str| matches.get_one::<PathBuf>(id).cloned().unwrap_or_default();
    let number = |id: &str| matches.get_one::<u64>(id).copied().unwrap_or_default();
    Ok(Request {
        folder: path("folder"),
        output: path("output"),
        seeds: number("seeds"),
        size: number("size"),
        measures: matches.get_many("measures").map(|words| words.cloned().collect()),
        samples: number("samples"),
        threads: number("threads"),
        json: matches.get_flag("json"),
        quiet: matches.get_flag("quiet"),
    })
}

/// The stand-alone program's `study`: says where it is. Returns the exit status.
pub(super) fn elsewhere() -> u8 {
    show::write_line(
        "texforge: `study` comes with the Python package; install that: pip install \
         'texforge-textures[study]'",
    );
    exit::CANNOT
}

pub(super) fn command() -> Command {
    let number = |id: &'static str, default: &'static str| {
        Arg::new(id).long(id).value_name("N").default_value(default)
    };
    Command::new("study")
        .about(
            "Compares the baseline with every measure over a folder of photos: tables and plots \
             (Python package only).",
        )
        .before_help(EXAMPLES)
        .arg(
            args::file("folder", "FOLDER", "The photos: every picture in it and in its folders. What cannot be read is named and left out; the exit status then is 1")
                .required(true),
        )
        .arg(
            args::file("output", "OUT", "The folder to write. Finished runs that it holds already are kept")
                .short('o')
                .long("output")
                .required(true),
        )
        .arg(
            number("seeds", "10")
                .value_parser(value_parser!(u64).range(1..=1000))
                .help("How many tiles are made of each photo in each way, with seeds from 0"),
        )
        .arg(
            number("size", "256").value_parser(value_parser!(u64).range(11..=4096)).help(
                "Side of the tiles in pixels. Photos much larger than four tiles are made smaller first",
            ),
        )
        .arg(
            Arg::new("measures")
                .long("measures")
                .value_name("NAMES")
                .value_delimiter(',')
                .help("Measures to compare with the baseline, separated by commas [default: all]"),
        )
        .arg(
            number("samples", "200")
                .value_parser(value_parser!(u64).range(2..=1_000_000))
                .help("How many patches of a tile are compared with all of the photo's for its texture cost"),
        )
        .arg(
            number("threads", "0")
                .value_parser(value_parser!(u64).range(..=1024))
                .help("Worker threads, 0 for one per core; changes the speed, never the result"),
        )
        .arg(args::json())
        .arg(args::switch("quiet", "Say nothing but errors").short('q'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(args: &[&str]) -> Result<Request, u8> {
        request(["texforge", "study"].iter().chain(args).map(OsString::from))
    }

    #[test]
    fn every_flag_arrives() {
        let plain = asked(&["photos", "-o", "out"]).expect("right");
        let expected = Request {
            folder: "photos".into(),
            output: "out".into(),
            seeds: 10,
            size: 256,
            measures: None,
            samples: 200,
            threads: 0,
            json: false,
            quiet: false,
        };
        assert_eq!(plain, expected);
        let all = asked(&[
            "photos",
            "--output",
            "out",
            "--seeds",
            "3",
            "--size",
            "64",
            "--measures",
            "a,b",
            "--samples",
            "9",
            "--threads",
            "2",
            "--json",
            "-q",
        ]);
        let expected = Request {
            seeds: 3,
            size: 64,
            measures: Some(vec!["a".into(), "b".into()]),
            samples: 9,
            threads: 2,
            json: true,
            quiet: true,
            ..expected
        };
        assert_eq!(all.expect("right"), expected);
    }

    #[test]
    fn wrong_usage_is_refused() {
        for flags in
            [&["--seeds", "0"][..], &["--size", "9"], &["--samples", "1"], &["--threads", "x"]]
        {
            assert_eq!(asked(&[&["photos", "-o", "out"], flags].concat()), Err(2), "{flags:?}");
        }
        assert_eq!(asked(&["photos"]), Err(2));
    }
}
