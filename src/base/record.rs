//! How a result was made, as it stands in files and reports.

use std::collections::BTreeMap;

use crate::base::params::Param;

/// A parameter's text as the JSON type that it has.
pub(crate) fn typed(param: &Param, text: &str) -> serde_json::Value {
    match param.kind {
        "optional number" if text == "none" => serde_json::Value::Null,
        "integer" | "number" | "optional number" => {
            serde_json::from_str(text).unwrap_or_else(|_| text.into())
        }
        _ => text.into(),
    }
}

/// What every command records in its files.
pub(crate) fn record_of(verb: &str, version: &str, seed: u64, params: &Typed) -> serde_json::Value {
    serde_json::json!({
        "tool": "texforge", "version": version, "verb": verb, "seed": seed, "params": params,
    })
}

/// Parameters by name.
pub(crate) type Typed = BTreeMap<&'static str, serde_json::Value>;

/// Parameters as numbers and words.
pub(crate) fn typed_params(schema: &[Param], params: &[(&'static str, String)]) -> Typed {
    let value = |name: &str, text: &str| match schema.iter().find(|p| p.name == name) {
        Some(param) => typed(param, text),
        None => text.into(),
    };
    params.iter().map(|(name, text)| (*name, value(name, text))).collect()
}
