//! The commands that only tell: `params`, `info`, `completions`, `man`.

use std::path::PathBuf;

use clap::ArgMatches;
use serde_json::json;

use crate::base::error::{Error, Result};
use crate::base::params::Param;
use crate::base::record::typed;
use crate::cli::output::to_stdout;
use crate::cli::show::table;
use crate::cli::work::{Session, supervise, watch_signals};
use crate::cli::{args, files};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture};
use crate::verb::extract::{ExtractParams, WangParams};
use crate::verb::lattice::LatticeParams;
use crate::verb::noise::{NoiseEditParams, NoiseParams};
use crate::verb::params::TileParams;
use crate::verb::regular::RegularParams;

/// Version of what `--json` writes; goes up when a field changes its meaning or goes away.
pub(super) const SCHEMA_VERSION: u32 = 1;

/// A command and its parameters.
type Schema = (&'static str, fn() -> Vec<Param>);

/// The commands that have parameters of their own.
pub(super) const SCHEMAS: &[Schema] = &[
    (TileParams::VERB, TileParams::schema),
    (LatticeParams::VERB, LatticeParams::schema),
    (RegularParams::VERB, RegularParams::schema),
    (ExtractParams::VERB, ExtractParams::schema),
    (WangParams::VERB, WangParams::schema),
    (NoiseParams::VERB, NoiseParams::schema),
    (NoiseEditParams::VERB, NoiseEditParams::schema),
];

/// `texforge params`.
pub(super) fn params(matches: &ArgMatches) -> Result<()> {
    let only = matches.get_one::<String>("verb");
    let chosen = SCHEMAS.iter().filter(|(verb, _)| only.is_none_or(|only| only == verb));
    if matches.get_flag("json") {
        let mut object = serde_json::Map::new();
        object.insert("schema_version".into(), SCHEMA_VERSION.into());
        for (verb, schema) in chosen {
            object.insert((*verb).into(), schema().iter().map(described).collect());
        }
        return print_json(&object);
    }
    let mut text = String::new();
    for (verb, schema) in chosen {
        text.extend([format!("texforge {verb}\n")]);
        for p in schema() {
            let accepts = if p.choices.is_empty() { p.range } else { p.choices.join(", ") };
            let facts = [accepts.as_str(), p.unit];
            let facts: Vec<_> = facts.into_iter().filter(|fact| !fact.is_empty()).collect();
            let facts =
                if facts.is_empty() { String::new() } else { format!(" ({})", facts.join("; ")) };
            let flag = p.name.replace('_', "-");
            text.extend([format!("  --{flag} {}{facts}\n      {}\n", p.default, p.doc)]);
        }
    }
    to_stdout(text.as_bytes())
}

fn described(param: &Param) -> serde_json::Value {
    json!({
        "name": param.name,
        "flag": format!("--{}", param.name.replace('_', "-")),
        "kind": param.kind,
        "choices": param.choices,
        "default": typed(param, &param.default),
        "range": param.range,
        "unit": param.unit,
        "doc": param.doc,
    })
}

/// `texforge info`.
pub(super) fn info(matches: &ArgMatches) -> Result<()> {
    let path = matches.get_one::<PathBuf>("file").cloned().unwrap_or_default();
    let session = Session::new(std::sync::Arc::default(), false);
    watch_signals();
    let from = path.clone();
    let (picture, record) = supervise(&session, move |_| {
        Ok((files::read(&from, MapKind::Color)?, files::read_record(&from)?))
    })?;
    if matches.get_flag("json") {
        let record: Option<serde_json::Value> =
            record.map(|text| serde_json::from_str(&text).unwrap_or_else(|_| text.into()));
        return print_json(&json!({
            "schema_version": SCHEMA_VERSION,
            "path": path.to_string_lossy(),
            "width": picture.width(),
            "height": picture.height(),
            "channels": picture.channels(),
            "type": picture.samples().dtype(),
            "encoding": encoding(&picture),
            "icc_bytes": picture.meta.icc.as_ref().map(Vec::len),
            "pixels_per_metre": picture.meta.pixels_per_metre,
            "notes": picture.meta.notes,
            "record": record,
        }));
    }
    let mut rows = vec![
        ("file", path.display().to_string()),
        ("size", format!("{}x{}", picture.width(), picture.height())),
        ("channels", picture.channels().to_string()),
        ("type", picture.samples().dtype().to_owned()),
        ("encoding", encoding(&picture).to_owned()),
    ];
    if let Some(icc) = &picture.meta.icc {
        rows.push(("profile", format!("kept ({} bytes)", icc.len())));
    }
    if let Some((x, y)) = picture.meta.pixels_per_metre {
        rows.push(("pixels per metre", format!("{x} x {y}")));
    }
    rows.extend(picture.meta.notes.iter().map(|note| ("note", note.clone())));
    rows.extend(record.map(|record| ("made by", record)));
    let rows: Vec<_> = rows.into_iter().map(|(name, value)| vec![name.into(), value]).collect();
    to_stdout(table(&rows).as_bytes())
}

fn encoding(picture: &Picture) -> &'static str {
    match picture.encoding {
        Encoding::Srgb => "srgb",
        Encoding::Linear => "linear",
        Encoding::Data => "data",
    }
}

/// `texforge completions`.
pub(super) fn completions(matches: &ArgMatches) -> Result<()> {
    let mut text = Vec::new();
    if let Some(&shell) = matches.get_one::<clap_complete::Shell>("shell") {
        clap_complete::generate(shell, &mut args::command(), "texforge", &mut text);
    }
    to_stdout(&text)
}

/// `texforge man`.
pub(super) fn man(matches: &ArgMatches) -> Result<()> {
    let mut command = args::command();
    if let Some(verb) = matches.get_one::<String>("verb") {
        command.build();
        if let Some(sub) = command.find_subcommand(verb) {
            let version = env!("CARGO_PKG_VERSION");
            command = sub.clone().display_name(format!("texforge-{verb}")).version(version);
        }
    }
    let mut text = Vec::new();
    clap_mangen::Man::new(command)
        .render(&mut text)
        .map_err(Error::io("write", crate::cli::exit::STDOUT))?;
    to_stdout(&text)
}

/// Says in `lines` what was done, and prints the summary if that was asked for.
///
/// # Errors
/// As [`print_json`].
pub(super) fn told(
    matches: &ArgMatches,
    session: &Session,
    (summary, lines): &(impl serde::Serialize, Vec<String>),
) -> Result<()> {
    lines.iter().for_each(|line| session.console.say(line));
    if matches.get_flag("json") { print_json(summary) } else { Ok(()) }
}

/// Writes one JSON object and a line break to standard output.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let mut text = serde_json::to_vec_pretty(value)
        .map_err(|e| Error::Internal { message: format!("cannot write JSON: {e}") })?;
    text.push(b'\n');
    to_stdout(&text)
}
