//! Names that every language takes, and that the exports do not use themselves.

/// Words that people may give to textures and maps, and that a language or an export keeps for itself.
const TAKEN: &[&str] = &[
    "active",
    "alias",
    "auto",
    "bool",
    "break",
    "buffer",
    "case",
    "cast",
    "char",
    "class",
    "closure",
    "color",
    "common",
    "const",
    "coherent",
    "discard",
    "double",
    "emit",
    "enum",
    "export",
    "external",
    "extern",
    "false",
    "filter",
    "fixed",
    "flat",
    "float",
    "fn",
    "for",
    "from",
    "get",
    "goto",
    "half",
    "handle",
    "hash",
    "highp",
    "if",
    "illuminance",
    "illuminate",
    "import",
    "in",
    "inline",
    "inout",
    "input",
    "int",
    "interface",
    "invariant",
    "layout",
    "let",
    "line",
    "linear",
    "loop",
    "lowp",
    "main",
    "matrix",
    "mediump",
    "meta",
    "metal",
    "mod",
    "module",
    "new",
    "noise",
    "normal",
    "open",
    "out",
    "output",
    "package",
    "partition",
    "patch",
    "pass",
    "pixel",
    "point",
    "precise",
    "precision",
    "private",
    "public",
    "ref",
    "resource",
    "return",
    "sample",
    "sampler",
    "set",
    "shader",
    "shared",
    "short",
    "signed",
    "sin",
    "cos",
    "smooth",
    "static",
    "std",
    "step",
    "string",
    "struct",
    "surface",
    "switch",
    "target",
    "technique",
    "template",
    "texture",
    "triangle",
    "true",
    "type",
    "uniform",
    "union",
    "unsigned",
    "use",
    "using",
    "var",
    "vector",
    "void",
    "volatile",
    "volume",
    "where",
    "while",
    "with",
    "yield",
    "abs",
    "mix",
    "normalize",
    "floor",
    "round",
    "sign",
    "displacement",
    "maps",
    "tile",
    "fract",
    "length",
    "reflect",
    "refract",
    "transpose",
    "x",
    "y",
    "pow",
    "log",
    "log2",
    "exp",
    "ceil",
    "clamp",
    "dot",
    "cross",
    "distance",
    "sqrt",
    "tan",
    "min",
    "max",
];

/// The letters, digits and single underscores of a name; `what` if there are none.
pub(super) fn plain(name: &str, what: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c);
        } else if !out.ends_with('_') && !out.is_empty() {
            out.push('_');
        }
    }
    let out = out.trim_end_matches('_');
    if out.is_empty() { what.to_owned() } else { out.to_owned() }
}

/// A name for functions and variables; `what` stands beside it where it would be taken.
pub(super) fn identifier(name: &str, what: &str) -> String {
    let out = plain(name, what);
    if TAKEN.contains(&out.to_lowercase().as_str()) {
        format!("{out}_{what}")
    } else if out.starts_with(|c: char| c.is_ascii_digit()) || out.starts_with("gl_") {
        // A digit, or what OpenGL keeps.
        format!("{what}_{out}")
    } else {
        out
    }
}

/// The same names, none of them twice.
pub(super) fn fields(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for name in names {
        let taken = |candidate: &String| out.contains(candidate);
        let numbered = (2..).map(|i| format!("{name}_{i}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|c| !taken(c));
        out.extend(free);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_fit() {
        for (name, expected) in [
            ("granite", "granite"),
            ("Old  wall.2", "Old_wall_2"),
            ("__a__b__", "a_b"),
            ("2 bricks", "map_2_bricks"),
            ("gl_Position", "map_gl_Position"),
            ("Texture", "Texture_map"),
            ("\u{e9}\u{e8}", "map"),
            ("", "map"),
        ] {
            assert_eq!(identifier(name, "map"), expected);
        }
    }

    #[test]
    fn no_name_comes_twice() {
        let names = ["a", "b", "a", "a_2", "a"].map(str::to_owned);
        assert_eq!(fields(names.into_iter()), ["a", "b", "a_2", "a_2_2", "a_3"]);
    }
}
