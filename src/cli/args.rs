//! What may be typed: commands, flags and their help. Flags of parameters come from the schema.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, RangedU64ValueParser, StringValueParser, ValueParser};
use clap::{Arg, ArgAction, ArgMatches, Command, ValueHint, value_parser};

use crate::base::params::{Param, Value as _};
use crate::cli::small::SCHEMAS;
use crate::cli::sources::Sources;
use crate::cli::{extract, maps, noise, palette, regular, study, wang};
use crate::image::material::MapKind;
use crate::verb::lattice::LatticeParams;
use crate::verb::params::TileParams;
use crate::verb::tile::MAX_VARIANTS;

const TILE_EXAMPLES: &str = "\
Examples:
  texforge tile brick.jpg -o brick.png
  texforge tile brick.jpg -o brick.png --size 1024x1024 --preview
  texforge tile brick.jpg -o trim.png --axis x --quality best
  texforge tile scan.png -o wall.png --mask usable.png --map normal=scan_nrm.png
  texforge tile brick.jpg -o clean.png --avoid stains.png --avoid-grow 12
  texforge tile wall.jpg -o wall.png --stationarity 0.7
  texforge tile meadow.jpg -o meadow.png --flatten 0.2 --variants 4
  texforge tile grass_a.jpg --also grass_b.jpg --symmetry all -o grass.png
  texforge tile brick.jpg -o better.png --redo 120x80+430+16 --redo-of brick_source.exr
  texforge tile brick.jpg -o - | display";

const APPLY_EXAMPLES: &str = "\
Examples:
  texforge tile brick.jpg -o brick.png --save-source-map brick_source.exr
  texforge apply brick_source.exr photo_normal.png -o brick_normal.png
  texforge apply brick_source.exr photo_wetness.png -o brick_wetness.png --kind data
  texforge apply grass_source.exr a_normal_gl.png --also b_normal_gl.png -o grass_normal_gl.png";

const LATTICE_EXAMPLES: &str = "\
Examples:
  texforge lattice bricks.jpg
  texforge lattice bricks.jpg --overlay lattice.png
  texforge lattice bricks.jpg --json
  texforge lattice tablecloth.jpg --min-period 30";

/// The whole command line.
pub(super) fn command() -> Command {
    Command::new("texforge")
        .version(env!("CARGO_PKG_VERSION"))
        .about("Turns photographs into textures that can be used.")
        .before_help(
            "Examples:\n  texforge tile brick.jpg -o brick.png\n  texforge tile --help\n  \
             texforge info brick.png",
        )
        .after_help(
            "Exit status: 0 done, 1 cannot, 2 wrong usage, 130 interrupted. Results go to standard \
             output,\nmessages to standard error.",
        )
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(tile())
        .subcommand(palette::command())
        .subcommand(regular::command())
        .subcommand(noise::command())
        .subcommand(extract::command())
        .subcommand(wang::command())
        .subcommand(apply())
        .subcommand(lattice())
        .subcommand(study::command())
        .subcommand(
            Command::new("params")
                .about("Lists the parameters of a command: meaning, default, range.")
                .before_help("Examples:\n  texforge params tile\n  texforge params lattice --json")
                .arg(
                    Arg::new("verb")
                        .value_name("COMMAND")
                        .value_parser(PossibleValuesParser::new(SCHEMAS.iter().map(|(verb, _)| *verb)))
                        .help("Only this command's"),
                )
                .arg(json()),
        )
        .subcommand(
            Command::new("info")
                .about("Says what a picture file holds: size, sample type, encoding, how it was made.")
                .before_help("Examples:\n  texforge info tile.png\n  texforge info tile.png --json")
                .arg(file("file", "FILE", "The picture").required(true))
                .arg(json()),
        )
        .subcommand(
            Command::new("completions")
                .about("Writes the tab completions of a shell to standard output.")
                .before_help(
                    "Examples:\n  texforge completions bash > ~/.local/share/bash-completion/completions/texforge\n  \
                     texforge completions zsh > ~/.zfunc/_texforge",
                )
                .arg(
                    Arg::new("shell")
                        .value_name("SHELL")
                        .required(true)
                        .value_parser(value_parser!(clap_complete::Shell))
                        .help("The shell"),
                ),
        )
        .subcommand(
            Command::new("man")
                .about("Writes the manual page to standard output.")
                .before_help("Examples:\n  texforge man | man -l -\n  texforge man tile > texforge-tile.1")
                .arg(
                    Arg::new("verb")
                        .value_name("COMMAND")
                        .value_parser(["tile", "palette", "regular", "noise", "extract", "wang", "apply", "lattice", "study", "params", "info", "completions"])
                        .help("The page of this command"),
                ),
        )
}

fn tile() -> Command {
    let command = Command::new(TileParams::VERB)
        .about("Turns a photo into a stationary tile: no seam, and no blob that gives the repetition away.")
        .before_help(TILE_EXAMPLES)
        .arg(Sources::photo())
        .arg(
            file("output", "TILE", "The tile to write; the extension chooses the format. `-`: PNG to standard output")
                .short('o')
                .long("output")
                .required(true),
        )
        .args(TileParams::schema().into_iter().map(flag))
        .next_help_heading("Inputs")
        .args(Sources::args())
        .arg(
            file("sigma-map", "FILE", "Grey picture of the tile's size that says sigma at every pixel, in place of \
                 --sigma: floats are sigma itself, of integers black is 0.01, mid grey 0.1 and white 1, in even factors")
                .long("sigma-map"),
        )
        .args(maps::flags("A further map of the same surface that follows the tile pixel by pixel; may be repeated, and \
             comes once for each photo, in their order"))
        .args(redo())
        .next_help_heading("Outputs")
        .arg(
            Arg::new("variants")
                .long("variants")
                .value_name("N")
                .default_value("1")
                .value_parser(RangedU64ValueParser::<usize>::new().range(1..=MAX_VARIANTS as u64))
                .allow_negative_numbers(true)
                .help(
                    "Make N tiles, 1 to 1000, whose seeds are --seed and those after it; with two and more \
                     every output's name is numbered: tile-1.png, tile-2.png, ...",
                ),
        )
        .arg(
            file("save-source-map", "FILE.exr", "Also write which photo pixel each tile pixel is, for `texforge apply`")
                .long("save-source-map"),
        )
        .arg(switch("preview", "Also write a 3x3 tiling, as TILE.preview.png beside the tile"));
    usual(command)
}

/// What any command that makes pictures by chance can be told about its outputs and its run.
pub(super) fn usual(command: Command) -> Command {
    let seed = Arg::new("seed")
        .long("seed")
        .value_name("N")
        .default_value("0")
        .value_parser(value_parser!(u64))
        .allow_negative_numbers(true)
        .help("Seed of all random choices; the same seed gives the same pixels on any machine");
    // The seed first.
    without_chance(command.next_help_heading("Running").arg(seed))
}

/// The same for a command that leaves nothing to chance.
pub(super) fn without_chance(command: Command) -> Command {
    command
        .next_help_heading("Outputs")
        .arg(switch("force", "Overwrite outputs that exist already"))
        .arg(json())
        .arg(switch("quiet", "Say nothing but errors").short('q'))
        .next_help_heading("Running")
        .arg(threads())
}

/// What makes one rectangle of a tile anew.
fn redo() -> [Arg; 2] {
    [
        Arg::new("redo")
            .long("redo")
            .value_name("WxH+X+Y")
            .requires("redo-of")
            .help(
                "Make only this rectangle of a finished tile anew, W pixels wide and H high, X from the left and Y \
                 from the top; it may reach over an edge that repeats. What was in it is not to come back; another \
                 --seed gives another choice, --variants several. All else stays as it is, pixel for pixel",
            ),
        file("redo-of", "FILE.exr", "Source map of that tile, written by --save-source-map; give the photos, --symmetry \
             and --flatten that the tile was made with")
            .long("redo-of")
            .requires("redo"),
    ]
}

fn apply() -> Command {
    Command::new("apply")
        .about("Makes the map that fits a tile out of a map that fits its photo, by the tile's source map.")
        .before_help(APPLY_EXAMPLES)
        .arg(file("source-map", "SOURCE_MAP", "Source map written by --save-source-map").required(true))
        .arg(file("map", "MAP", "The map: shows what the photo shows, at any resolution").required(true))
        .arg(
            file("output", "OUT", "The file to write; `-`: PNG to standard output")
                .short('o')
                .long("output")
                .required(true),
        )
        .arg(
            file("also", "MAP", "The same map of the next photo, for a tile made of several; may be repeated")
                .long("also")
                .action(ArgAction::Append),
        )
        .arg(
            Arg::new("kind")
                .long("kind")
                .value_name("KIND")
                .value_parser(PossibleValuesParser::new(MapKind::CHOICES))
                .help(
                    "What the map's numbers are; without it the file's name decides. Normals whose green points \
                     up are normal_gl (OpenGL), down normal_dx (DirectX)",
                ),
        )
        .arg(switch("force", "Overwrite an output that exists already"))
        .arg(json())
        .arg(switch("quiet", "Say nothing but errors").short('q'))
}

fn lattice() -> Command {
    let command = Command::new(LatticeParams::VERB)
        .about("Finds by which displacements a photo of bricks, tiles or cloth repeats.")
        .before_help(LATTICE_EXAMPLES)
        .arg(Sources::photo())
        .args(LatticeParams::schema().into_iter().map(flag))
        .next_help_heading("Outputs")
        .arg(
            file(
                "overlay",
                "FILE",
                "Write the photo with the lattice drawn over it, also if it is but a guess",
            )
            .long("overlay"),
        )
        .arg(
            file(
                "autocorrelation",
                "FILE",
                "Write the autocorrelation that was looked at, no displacement in the middle: \
                 EXR holds it as it is (-1 to 1), other formats as grey, 0 at half",
            )
            .long("autocorrelation"),
        );
    without_chance(command)
}

fn threads() -> Arg {
    Arg::new("threads")
        .long("threads")
        .value_name("N")
        .default_value("0")
        .value_parser(value_parser!(usize))
        .allow_negative_numbers(true)
        .help("Worker threads, 0 for one per core; changes the speed, never the result")
}

/// The flag of one parameter.
pub(super) fn flag(param: Param) -> Arg {
    let mut facts = Vec::new();
    if !param.range.is_empty() {
        facts.push(param.range);
    }
    if !param.unit.is_empty() {
        facts.push(param.unit.to_owned());
    }
    let mut help = param.doc;
    if !facts.is_empty() {
        help = format!("{help} [{}]", facts.join(", "));
    }
    let parser: ValueParser = if param.choices.is_empty() {
        StringValueParser::new().into()
    } else {
        PossibleValuesParser::new(param.choices).into()
    };
    let value_name = match param.kind {
        "size" | "period" => "WxH",
        "choice" => "WORD",
        _ => "N",
    };
    Arg::new(param.name)
        .long(param.name.replace('_', "-"))
        .value_name(value_name)
        .default_value(param.default)
        .value_parser(parser)
        // A negative number is out of range, not an unknown flag.
        .allow_negative_numbers(true)
        .allow_hyphen_values(param.kind == "lattice")
        .help_heading("Parameters")
        .help(help)
}

/// What was typed for a parameter, or its default; a command may leave out some.
pub(super) fn text<'a>(matches: &'a ArgMatches) -> impl Fn(&'static str) -> Option<&'a str> {
    move |name| matches.try_get_one::<String>(name).ok().flatten().map(String::as_str)
}

pub(super) fn file(id: &'static str, value_name: &'static str, help: &'static str) -> Arg {
    Arg::new(id)
        .value_name(value_name)
        .value_parser(value_parser!(PathBuf))
        .value_hint(ValueHint::FilePath)
        .help(help)
}

pub(super) fn switch(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).action(ArgAction::SetTrue).help(help)
}

pub(super) fn json() -> Arg {
    switch("json", "Write one JSON object to standard output")
}

/// The long flags of a command, for hints.
pub(super) fn flags_of(command: &str) -> Vec<String> {
    let mut all = self::command();
    command
        .split(' ')
        .try_fold(&mut all, |command, name| command.find_subcommand_mut(name))
        .map(|c| c.get_arguments().filter_map(|a| a.get_long().map(str::to_owned)).collect())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        command().debug_assert();
    }

    #[test]
    fn no_flags_mean_the_default_parameters() {
        let matches = command().get_matches_from(["texforge", "tile", "a.jpg", "-o", "b.png"]);
        let (_, tile) = matches.subcommand().expect("tile");
        assert_eq!(
            TileParams::from_texts(text(tile)).expect("defaults are valid"),
            TileParams::default()
        );
    }

    #[test]
    fn every_parameter_has_a_flag_and_every_help_begins_with_examples() {
        let flags = flags_of("tile");
        for param in TileParams::schema() {
            assert!(flags.contains(&param.name.replace('_', "-")), "{}", param.name);
        }
        let mut all = command();
        let mut waiting: Vec<_> = all.get_subcommands_mut().collect();
        while let Some(sub) = waiting.pop() {
            // What clap adds to a command with commands of its own.
            if sub.get_name() == "help" {
                continue;
            }
            let help = sub.render_long_help().to_string();
            assert!(help.starts_with("Examples:"), "{help}");
            waiting.extend(sub.get_subcommands_mut());
        }
    }

    #[test]
    fn values_out_of_range_name_the_parameter() {
        let matches =
            command().get_matches_from(["texforge", "tile", "a", "-o", "b", "--patch", "-4"]);
        let (_, tile) = matches.subcommand().expect("tile");
        let error = TileParams::from_texts(text(tile)).expect_err("negative");
        assert!(error.to_string().starts_with("`patch` must be"), "{error}");
    }
}
