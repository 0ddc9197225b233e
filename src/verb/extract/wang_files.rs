//! What a set of Wang tiles is as files.

use std::path::Path;

use serde_json::{Value, json};

use crate::base::error::Result;
use crate::base::record::{record_of, typed_params};
use crate::image::material::{MapKind, output_path};
use crate::image::picture::{Encoding, Picture};
use crate::verb::extract::params::WangParams;
use crate::verb::extract::wang::{TileSet, WangSet};

/// Pictures that every map has one of.
const ATLAS: &str = "atlas";
const PLANE: &str = "plane";

/// The document, and which tile lies where in the plane.
const DOCUMENT: &str = "wang.json";
const INDEX: &str = "index.png";

/// A file of a set.
#[derive(Debug, Clone)]
pub struct WangFile {
    /// What it is: `tile`, `atlas`, `plane`, `index`, `document`.
    pub role: &'static str,
    /// The map that it is of; `None` is the photo.
    pub map: Option<String>,
    /// Its name.
    pub name: String,
    /// What it holds.
    pub content: WangFileContent,
}

/// What a file of a set holds.
#[derive(Debug, Clone)]
pub enum WangFileContent {
    /// A picture, what its numbers are, and how it was made.
    Picture(Picture, MapKind, Option<String>),
    /// Text.
    Text(String),
}

/// A picture's name without its ending: the atlas, the plane, the tiles.
fn stems(set: TileSet) -> impl Iterator<Item = (&'static str, String)> {
    let tiles = (1..=set.tiles().len()).map(|k| ("tile", format!("tile_{k:02}")));
    [ATLAS, PLANE].into_iter().map(|role| (role, role.to_owned())).chain(tiles)
}

fn file_name(stem: &str, map: Option<&str>, like: &Picture) -> String {
    let own = if like.samples().is_float() { "exr" } else { "png" };
    let path = format!("{stem}.{own}");
    match map {
        None => path,
        Some(map) => output_path(Path::new(&path), map, like).to_string_lossy().into_owned(),
    }
}

/// The names of the files of a set that are like a photo or, with a name, like a map of it; and of those
/// that there is one of.
pub fn wang_file_names(set: TileSet, map: Option<&str>, like: &Picture) -> Vec<String> {
    let mut names: Vec<String> = stems(set).map(|(_, stem)| file_name(&stem, map, like)).collect();
    if map.is_none() {
        names.extend([INDEX, DOCUMENT].map(str::to_owned));
    }
    names
}

impl WangSet {
    /// All files of the set, of the atlases of further `maps` (name, atlas, kind), and of a plane of
    /// this height and width.
    ///
    /// # Errors
    /// As [`WangSet::plane`].
    pub fn files(
        &self,
        maps: &[(String, Picture, MapKind)],
        plane: (usize, usize),
        seed: u64,
    ) -> Result<Vec<WangFile>> {
        let record = self.record(seed);
        let kind = match self.atlas.encoding {
            Encoding::Data => MapKind::Data,
            _ => MapKind::Color,
        };
        let mut files = Vec::new();
        let own = [(None, &self.atlas, kind)].into_iter();
        let others = maps.iter().map(|(name, atlas, kind)| (Some(name.as_str()), atlas, *kind));
        for (map, atlas, kind) in own.chain(others) {
            for (k, (role, stem)) in stems(self.set).enumerate() {
                let picture = match role {
                    ATLAS => atlas.clone(),
                    PLANE => self.plane(atlas, plane, seed)?,
                    _ => self.tile(atlas, k - 2)?,
                };
                let name = file_name(&stem, map, atlas);
                let record = map.is_none().then(|| record.to_string());
                let content = WangFileContent::Picture(picture, kind, record);
                files.push(WangFile { role, map: map.map(str::to_owned), name, content });
            }
        }
        let index = self.index(seed, self.cells(plane)?)?;
        let index = WangFileContent::Picture(index, MapKind::Data, None);
        let mut add = |role, name: &str, content| {
            files.push(WangFile { role, map: None, name: name.to_owned(), content });
        };
        add("index", INDEX, index);
        let text = format!("{:#}\n", self.document(&record, plane, seed)?);
        add("document", DOCUMENT, WangFileContent::Text(text));
        Ok(files)
    }

    /// How the set and its plane were made. Holds nothing that differs between equal runs.
    fn record(&self, seed: u64) -> Value {
        let report = &self.report;
        let params = typed_params(&WangParams::schema(), &report.params);
        let mut record = record_of(WangParams::VERB, report.version, seed, &params);
        record["period"] = json!(report.period.sides);
        record["scale"] = json!(report.scale);
        record
    }

    /// What another program has to know to lay the tiles.
    fn document(&self, record: &Value, plane: (usize, usize), seed: u64) -> Result<Value> {
        let ((h, w), (rows, columns)) = (self.tile, self.set.atlas());
        let name = |stem: &str| file_name(stem, None, &self.atlas);
        let tile = |(k, edges): (usize, _)| {
            json!({
                "index": k,
                "file": name(&format!("tile_{:02}", k + 1)),
                "column": k % columns,
                "row": k / columns,
                "edges": edges,
            })
        };
        let cells = self.cells(plane)?;
        Ok(json!({
            "schema_version": 1,
            "made": record,
            "tile_size": [w, h],
            "tiles": self.set.tiles().into_iter().enumerate().map(tile).collect::<Vec<_>>(),
            "atlas": { "file": name(ATLAS), "columns": columns, "rows": rows },
            "plane": { "file": name(PLANE), "size": [plane.1, plane.0], "seed": seed },
            "index": {
                "file": INDEX,
                "columns": cells.1,
                "rows": cells.0,
                "channels": ["column in the atlas", "row in the atlas", "0"],
                "repeats": true,
            },
        }))
    }
}
