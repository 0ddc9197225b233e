//! `texforge apply`.

use std::path::{Path, PathBuf};

use clap::ArgMatches;
use serde_json::json;

use crate::base::error::{Error, Result};
use crate::base::params::Value as _;
use crate::cli::files;
use crate::cli::output::{Target, to_stdout};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::work::{Session, supervise, watch_signals};
use crate::image::material::MapKind;

/// What was typed.
#[derive(Debug)]
struct Request {
    source_map: PathBuf,
    /// One of each photo.
    maps: Vec<PathBuf>,
    target: Target,
    kind: Option<MapKind>,
    force: bool,
}

/// Runs `texforge apply`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let path = |id| matches.get_one::<PathBuf>(id).cloned().unwrap_or_default();
    let json = matches.get_flag("json");
    let also = matches.get_many::<PathBuf>("also").into_iter().flatten().cloned();
    let request = Request {
        source_map: path("source-map"),
        maps: [path("map")].into_iter().chain(also).collect(),
        target: Target::typed(&path("output"))?,
        kind: matches.get_one::<String>("kind").and_then(|word| MapKind::parse(word)),
        force: matches.get_flag("force"),
    };
    if json && request.target == Target::Stdout {
        let expected = "left out when the map goes to standard output";
        return Err(Error::parameter("json", expected, "`-o -`"));
    }
    let session = Session::new(std::sync::Arc::default(), matches.get_flag("quiet"));
    watch_signals();
    let summary = supervise(&session, move |session| work(session, &request))?;
    if json { print_json(&summary) } else { Ok(()) }
}

fn work(session: &Session, request: &Request) -> Result<serde_json::Value> {
    let target = request.target.file();
    if let Some(path) = target {
        let inputs = request.maps.iter().chain([&request.source_map]).map(PathBuf::as_path);
        files::check_place(path, &inputs.collect::<Vec<_>>(), request.force)?;
    }
    let kind = request.kind.unwrap_or_else(|| {
        let kind = files::kind_of_file(&request.maps[0]);
        session.console.say(&format!(
            "{}: read as {} by its name (--kind says otherwise)",
            request.maps[0].display(),
            kind.show()
        ));
        kind
    });
    let mut maps = Vec::new();
    for path in &request.maps {
        maps.push(files::read(path, kind)?);
        session.check()?;
    }
    let source_map = files::read_source_map(&request.source_map)?;
    session.check()?;
    let out = source_map.apply_all(&maps.iter().collect::<Vec<_>>(), kind)?;
    let bytes = files::encode(&out, target, kind, None)?;
    session.check()?;
    match target {
        None => to_stdout(&bytes)?,
        Some(path) => {
            session.staging.stage(path, &bytes)?;
            session.staging.commit(request.force)?;
        }
    }
    let place = target.unwrap_or(Path::new("-"));
    let elapsed = session.console.elapsed();
    session.console.say(&format!(
        "{}  {}x{}, {}",
        place.display(),
        out.width(),
        out.height(),
        duration(elapsed)
    ));
    Ok(json!({
        "schema_version": SCHEMA_VERSION,
        "verb": "apply",
        "version": env!("CARGO_PKG_VERSION"),
        "kind": kind.show(),
        "path": place.to_string_lossy(),
        "width": out.width(),
        "height": out.height(),
        "seconds": { "total": elapsed.as_secs_f64() },
        "notes": maps.iter().flat_map(|map| &map.meta.notes).collect::<Vec<_>>(),
    }))
}
