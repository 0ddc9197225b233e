//! `texforge noise morph` and `texforge noise edit`: documents from documents.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use serde_json::{Value, json};

use super::{about, document, made_of, output, path, read, shown, target, write};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::record::typed_params;
use crate::cli::args;
use crate::cli::output::Target;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::work::{Session, supervise, watch_signals};
use crate::image::io::check_place;
use crate::verb::noise::{NoiseEdit, NoiseEditParams, NoiseTexture};

const MORPH_EXAMPLES: &str = "\
Examples:
  texforge noise morph granite.json sand.json --at 0.5 -o between.json
  texforge noise morph granite.json sand.json --at 0.1 -o - > sandy_granite.json";

const EDIT_EXAMPLES: &str = "\
Examples:
  texforge noise edit granite.json -o strong.json --contrast 1.4 --saturation 0.8
  texforge noise edit granite.json -o red.json --mean basecolor=#a05040
  texforge noise edit granite.json -o shiny.json --mean roughness=0.2
  texforge noise edit granite.json -o smooth.json --gains 0.3,0.6
  texforge noise edit granite.json -o coarse.json --feature-size 4
  texforge noise edit granite.json -o other.json --seed 7";

/// The command as it is typed.
pub(super) fn morph_command() -> Command {
    let command = Command::new("morph")
        .about("Writes the texture between two: means, weights and histograms go straight, colours turn into each other.")
        .before_help(MORPH_EXAMPLES)
        .arg(document("first", "FIRST"))
        .arg(document("second", "SECOND"))
        .arg(output())
        .arg(
            Arg::new("at")
                .long("at")
                .value_name("N")
                .default_value("0.5")
                .value_parser(value_parser!(f64))
                .allow_negative_numbers(true)
                .help_heading("Parameters")
                .help("How far from the first to the second texture [0 to 1]"),
        );
    usual(command)
}

/// The command as it is typed.
pub(super) fn edit_command() -> Command {
    let command = Command::new(NoiseEditParams::VERB.trim_start_matches("noise "))
        .about("Changes a texture: contrast, colours, octaves, the size of features, the seed.")
        .before_help(EDIT_EXAMPLES)
        .arg(document("document", "TEXTURE"))
        .arg(output())
        .args(NoiseEditParams::schema().into_iter().map(args::flag))
        .next_help_heading("Parameters")
        .arg(
            Arg::new("gains")
                .long("gains")
                .value_name("N,N,...")
                .help("Factors of the octaves' weights, the finest first; those beyond the list stay [0 to 100]"),
        )
        .arg(
            Arg::new("mean")
                .long("mean")
                .value_name("MAP=COLOR")
                .action(ArgAction::Append)
                .help("New mean of a map: #rrggbb, or a number for each of its channels (or one for all) with commas in \
                       between, where 1 is full scale in the map's encoding; may be repeated"),
        )
        .arg(
            Arg::new("seed")
                .long("seed")
                .value_name("N")
                .value_parser(value_parser!(u32))
                .allow_negative_numbers(true)
                .help("Another seed: the same statistics elsewhere"),
        );
    usual(command)
}

fn usual(command: Command) -> Command {
    command
        .next_help_heading("Outputs")
        .arg(args::switch("force", "Overwrite an output that exists already"))
        .arg(args::json())
        .arg(args::switch("quiet", "Say nothing but errors").short('q'))
}

/// Runs `texforge noise morph`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn morph(matches: &ArgMatches) -> Result<()> {
    let at = matches.get_one::<f64>("at").copied().unwrap_or_default();
    let inputs = [path(matches, "first"), path(matches, "second")];
    let shown = json!({ "at": at });
    run(matches, "noise morph", inputs.to_vec(), shown, move |textures| {
        let named = |error| match error {
            Error::Parameter { name: "t", .. } => about("at", error),
            error => about("second", error),
        };
        textures[0].morph(&textures[1], at).map_err(named)
    })
}

/// Runs `texforge noise edit`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn edit(matches: &ArgMatches) -> Result<()> {
    let gains = matches.get_one::<String>("gains").map_or(Ok(Vec::new()), |text| gains(text))?;
    let means = matches.get_many::<String>("mean").into_iter().flatten();
    let edit = NoiseEdit {
        params: NoiseEditParams::from_texts(args::text(matches))?,
        gains,
        means: means.map(|text| mean(text)).collect::<Result<_>>()?,
        seed: matches.get_one("seed").copied(),
    };
    let mut shown = json!(typed_params(&NoiseEditParams::schema(), &edit.params.show()));
    shown["gains"] = json!(edit.gains);
    shown["means"] = json!(edit.means);
    run(matches, NoiseEditParams::VERB, vec![path(matches, "document")], shown, move |textures| {
        let named = |error| match error {
            Error::Parameter { name: "means", .. } => about("mean", error),
            error => error,
        };
        textures[0].edit(&Ctx::new(0, 0)?, &edit).map_err(named)
    })
}

/// Reads documents, makes one of them and writes it.
fn run(
    matches: &ArgMatches,
    verb: &'static str,
    inputs: Vec<PathBuf>,
    params: Value,
    change: impl FnOnce(&[NoiseTexture]) -> Result<NoiseTexture> + Send + 'static,
) -> Result<()> {
    let (output, force) = (target(matches)?, matches.get_flag("force"));
    let session = Session::new(Arc::default(), matches.get_flag("quiet"));
    watch_signals();
    let summary = supervise(&session, move |session| {
        if let Some(path) = output.file() {
            let inputs: Vec<_> = inputs.iter().map(PathBuf::as_path).collect();
            check_place(path, &inputs, force)?;
        }
        let textures = inputs.iter().map(|path| read(path)).collect::<Result<Vec<_>>>()?;
        let texture = change(&textures)?;
        write(session, &output, &texture, force)?;
        Ok(said(session, verb, &output, &texture, &params))
    })?;
    if matches.get_flag("json") { print_json(&summary) } else { Ok(()) }
}

fn said(
    session: &Session,
    verb: &str,
    output: &Target,
    texture: &NoiseTexture,
    params: &Value,
) -> Value {
    let (bytes, bands) = (texture.to_json().len(), texture.document().terms().len());
    let seed = texture.document().seed;
    let (shown, made_of) = (shown(output), made_of(bands));
    session.console.say(&format!("{shown}  {bytes} bytes, {made_of}, seed {seed}"));
    json!({
        "schema_version": SCHEMA_VERSION,
        "verb": verb,
        "version": env!("CARGO_PKG_VERSION"),
        "seed": seed,
        "params": params,
        "path": output.file().map(|path| path.to_string_lossy()),
        "bytes": bytes,
        "bands": bands,
    })
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|number| number.trim().parse().ok()).collect()
}

fn gains(text: &str) -> Result<Vec<f64>> {
    let expected = "numbers with commas in between, e.g. 0.5,1,2";
    numbers(text).ok_or_else(|| Error::parameter("gains", expected, format!("`{text}`")))
}

/// `basecolor=#a08060` or `roughness=0.4`.
fn mean(text: &str) -> Result<(String, Vec<f64>)> {
    let parsed = text.split_once('=').and_then(|(name, value)| {
        let values = value.strip_prefix('#').map_or_else(|| numbers(value), hexadecimal)?;
        Some((name.to_owned(), values))
    });
    let expected = "MAP=#rrggbb or MAP=NUMBERS, e.g. basecolor=#a08060 or roughness=0.4";
    parsed.ok_or_else(|| Error::parameter("mean", expected, format!("`{text}`")))
}

/// Three channels of two digits each, as shares of 255.
fn hexadecimal(digits: &str) -> Option<Vec<f64>> {
    if digits.len() != 6 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let channel = |i: usize| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok();
    (0..3).map(|i| channel(i).map(|value| f64::from(value) / 255.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_colours_or_numbers() {
        assert_eq!(
            mean("basecolor=#ff0033").expect("colour"),
            ("basecolor".into(), vec![1.0, 0.0, 0.2])
        );
        assert_eq!(mean("a=0.5, -1,2e-1").expect("numbers"), ("a".into(), vec![0.5, -1.0, 0.2]));
        for bad in ["basecolor", "a=", "a=#12345", "a=#+12345", "a=1,,2", "a=red", "a=#ääa"] {
            let error = mean(bad).expect_err(bad).to_string();
            assert!(error.starts_with("`mean` must be MAP=#rrggbb"), "{error}");
        }
        assert!(gains("1;2").is_err());
    }
}
