//! `MaterialX`: a graph of standard nodes, a material that uses it, and the pictures that it reads.

mod tiles;

use std::collections::HashSet;
use std::fmt::Write as _;

use half::f16;

use super::nodes::{GroupShape, Nodes, TOGETHER};
use super::{ExportFile, Program};
use crate::base::error::Result;
use crate::image::io::{Format, WriteOptions, encode};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::signal::wavelet_noise::{Torus, spline_weights};

/// Samples to a coefficient in the pictures, which are looked up linearly. With 3 the error of a band is
/// 1.4 to 1.9 % of its amplitude, with 5 it is 0.5 to 0.7 %; even numbers, which have samples where the
/// spline's pieces meet, are no better than the odd ones below them.
const FINE: usize = 5;

/// The files `name.mtlx` and `name_noise_*.exr`, or `name_table_*.exr` and `name_input_*.exr`.
pub(super) fn materialx(program: &Program, name: &str) -> Result<Vec<ExportFile>> {
    let nodes = Nodes::new(program, FINE);
    let picture = |i: usize| format!("{name}_noise_{i}.exr");
    let mut graph = Graph::new(program.channels.len());
    let pixels = graph.pixels(program);
    let sums = match &nodes.tiles {
        Some(tiles) => graph.tiled(&pixels, tiles, &nodes.groups, name),
        None => graph.sums(program, &nodes, pixels, picture),
    };
    let channels: Vec<Node> = sums
        .into_iter()
        .zip(&nodes.groups)
        .map(|(sum, group)| match &group.shape {
            Some(shape) => graph.shaped(&sum, shape),
            None => sum,
        })
        .collect();
    let values: Vec<Node> =
        (0..program.mean.len()).map(|i| graph.value(program, &channels, i)).collect();
    let mut rest = &values[..];
    let mut outputs = Vec::new();
    for (map, kind) in program.maps.iter().zip(&program.kinds) {
        let (values, others) = rest.split_at(map.2);
        outputs.extend(graph.map(map, *kind, values));
        rest = others;
    }
    let text = document(name, &graph, &outputs);
    let mut files = vec![ExportFile { name: format!("{name}.mtlx"), bytes: text.into_bytes() }];
    if let Some(tiles) = &nodes.tiles {
        files.extend(tiles::pictures(tiles, name)?);
    }
    let planes = program.channels.len().min(2) * 2 - 1;
    for (i, (integers, scale)) in program.tiles.iter().enumerate() {
        let bytes = drawn(integers, *scale, &nodes.shifts[..planes])?;
        files.push(ExportFile { name: picture(i), bytes });
    }
    Ok(files)
}

/// A tile's spline surface as an EXR file of half floats; a channel for each of `shifts`.
fn drawn(integers: &[i16], scale: f32, shifts: &[[usize; 2]]) -> Result<Vec<u8>> {
    let coefficients: Vec<f32> = integers.iter().map(|&v| f32::from(v) * scale).collect();
    // Rows, and then columns as rows; turned twice it is upright.
    let plane = finer(&finer(&coefficients));
    let side = Torus::SIDE * FINE;
    let pixels = (0..side * side).flat_map(|i| {
        let (x, y) = (i % side, i / side);
        shifts.iter().map(move |[dx, dy]| ((x + dx * FINE) % side, (y + dy * FINE) % side))
    });
    let samples = pixels.map(|(x, y)| f16::from_f32(plane[y * side + x])).collect();
    exr(side, side, shifts.len(), samples)
}

/// Numbers as an EXR file.
fn exr(height: usize, width: usize, channels: usize, samples: Vec<f16>) -> Result<Vec<u8>> {
    let picture = Picture::new(height, width, channels, Samples::F16(samples), Encoding::Data)?;
    encode(&picture, Format::Exr, &WriteOptions::new(MapKind::Data))
}

/// Rows of [`Torus::SIDE`] coefficients as columns of [`FINE`] times as many samples.
///
/// Straight lines between samples of an arc run inside it: by a twelfth of the second difference on
/// average, by which the samples are moved out.
fn finer(rows: &[f32]) -> Vec<f32> {
    let count = rows.len() / Torus::SIDE;
    let long = Torus::SIDE * FINE;
    let mut out = vec![0.0; count * long];
    let mut line = vec![0.0f32; long];
    for (y, row) in rows.chunks_exact(Torus::SIDE).enumerate() {
        for (j, sample) in line.iter_mut().enumerate() {
            let (first, weights) = spline_weights(j as f64 / FINE as f64);
            let at = |k: i64| row[(first as i64 + k).rem_euclid(Torus::SIDE as i64) as usize];
            *sample = weights[0] * at(0) + weights[1] * at(1) + weights[2] * at(2);
        }
        for j in 0..long {
            let beside = line[(j + long - 1) % long] + line[(j + 1) % long];
            out[j * count + y] = line[j] + (2.0 * line[j] - beside) / 12.0;
        }
    }
    out
}

/// A node's output.
#[derive(Debug, Clone)]
struct Node {
    name: String,
    kind: &'static str,
}

/// What goes into an input of a node.
enum In<'a> {
    Node(&'a Node),
    /// An input of the graph.
    Port(&'a str, &'static str),
    /// Numbers: a float or a vector.
    Numbers(&'a [f64]),
    /// A number, also where the node is of vectors.
    Number(f64),
    /// A word.
    Word(&'a str, &'a str),
}

/// The nodes of the graph as text.
#[derive(Debug)]
struct Graph {
    text: String,
    names: HashSet<String>,
    /// The type of the channels' values.
    kind: &'static str,
}

impl Graph {
    fn new(channels: usize) -> Self {
        let kind = if channels == 1 { "float" } else { "vector3" };
        Self { text: String::new(), names: HashSet::new(), kind }
    }

    /// A name like `wanted` that nothing has yet.
    fn unique(&mut self, wanted: &str) -> String {
        let wanted = identifier(wanted);
        let mut name = wanted.clone();
        let mut count = 1;
        while !self.names.insert(name.clone()) {
            count += 1;
            name = format!("{wanted}_{count}");
        }
        name
    }

    fn node(
        &mut self,
        category: &str,
        kind: &'static str,
        name: &str,
        inputs: &[(&str, In)],
    ) -> Node {
        let name = self.unique(name);
        // Only strings and file names are written to `text`: that does not fail.
        let _ = writeln!(self.text, r#"    <{category} name="{name}" type="{kind}">"#);
        for (input, value) in inputs {
            let (kind, value) = match value {
                In::Node(node) => (node.kind, format!(r#"nodename="{}""#, node.name)),
                In::Port(port, kind) => (*kind, format!(r#"interfacename="{port}""#)),
                In::Numbers(v) => (vector(v.len()), format!(r#"value="{}""#, numbers(v))),
                In::Number(v) => ("float", format!(r#"value="{}""#, numbers(&[*v]))),
                In::Word(kind, word) => (*kind, format!(r#"value="{word}""#)),
            };
            let _ = writeln!(self.text, r#"      <input name="{input}" type="{kind}" {value} />"#);
        }
        let _ = writeln!(self.text, "    </{category}>");
        Node { name, kind }
    }

    /// A node with inputs `in1` and `in2`, of the type of `a`.
    fn two(&mut self, category: &str, name: &str, a: &Node, b: In) -> Node {
        self.node(category, a.kind, name, &[("in1", In::Node(a)), ("in2", b)])
    }

    /// As many of `values` as the channels' type has.
    fn channels(&self, values: &[f64; TOGETHER]) -> Vec<f64> {
        values[..if self.kind == "float" { 1 } else { TOGETHER }].to_vec()
    }

    /// The place in pixels of the photo, v up.
    fn pixels(&mut self, program: &Program) -> Node {
        let size = program.size.map(f64::from);
        let uv = self.node("texcoord", "vector2", "texcoord", &[]);
        let scaled = self.two("multiply", "scaled", &uv, In::Port("scale", "vector2"));
        self.two("multiply", "pixels", &scaled, In::Numbers(&size))
    }

    /// The noise of every group of channels.
    fn sums(
        &mut self,
        program: &Program,
        nodes: &Nodes,
        mut pixels: Node,
        picture: impl Fn(usize) -> String,
    ) -> Vec<Node> {
        if let Some(turn) = nodes.turn {
            let [x, y] = turn.map(|row| {
                let inputs = [("in1", In::Node(&pixels)), ("in2", In::Numbers(&row))];
                self.node("dotproduct", "float", "along", &inputs)
            });
            let inputs = [("in1", In::Node(&x)), ("in2", In::Node(&y))];
            pixels = self.node("combine2", "vector2", "turned", &inputs);
        }
        let mut sums: Vec<Option<Node>> = nodes.groups.iter().map(|_| None).collect();
        for (t, term) in program.terms.iter().enumerate() {
            if nodes.groups.iter().all(|g| g.weights[t] == [0.0; TOGETHER]) {
                continue;
            }
            // Not multiplied: MaterialX writes six decimals into shaders.
            let span = In::Numbers(&nodes.spans[t]);
            let band = self.two("divide", &format!("band{t}"), &pixels, span);
            for (group, sum) in nodes.groups.iter().zip(&mut sums) {
                if group.weights[t] == [0.0; TOGETHER] {
                    continue;
                }
                let name = |what: &str| format!("band{t}_{what}");
                let place = self.two("add", &name("place"), &band, In::Numbers(&group.offsets[t]));
                let file = picture(term.tile);
                let inputs = [
                    ("file", In::Word("filename", &file)),
                    ("texcoord", In::Node(&place)),
                    ("uaddressmode", In::Word("string", "periodic")),
                    ("vaddressmode", In::Word("string", "periodic")),
                    ("filtertype", In::Word("string", "linear")),
                ];
                let noise = self.node("image", self.kind, &name("noise"), &inputs);
                let weights = self.channels(&group.weights[t]);
                let noise = self.two("multiply", &name("weighted"), &noise, In::Numbers(&weights));
                *sum = Some(match sum.take() {
                    Some(sum) => self.two("add", &name("sum"), &sum, In::Node(&noise)),
                    None => noise,
                });
            }
        }
        let zero = self.channels(&[0.0; TOGETHER]);
        sums.into_iter()
            .map(|sum| {
                sum.unwrap_or_else(|| {
                    self.node("constant", self.kind, "none", &[("value", In::Numbers(&zero))])
                })
            })
            .collect()
    }

    /// The histograms of a group of channels applied to its noise.
    fn shaped(&mut self, noise: &Node, shape: &GroupShape) -> Node {
        let base = self.channels(&shape.base);
        let mut sum = if let Some(straight) = &shape.straight {
            let straight = self.channels(straight);
            let kept = self.two("multiply", "straight", noise, In::Numbers(&straight));
            self.two("add", "histogram", &kept, In::Numbers(&base))
        } else {
            self.node("constant", noise.kind, "histogram", &[("value", In::Numbers(&base))])
        };
        for (i, (knot, width, coefficients)) in shape.pieces.iter().enumerate() {
            let name = |what: &str| format!("histogram{i}_{what}");
            let [c1, c2, c3] = coefficients.each_ref().map(|c| self.channels(c));
            let from = self.two("subtract", &name("from"), noise, In::Number(*knot));
            let inputs =
                [("in", In::Node(&from)), ("low", In::Number(0.0)), ("high", In::Number(*width))];
            let t = self.node("clamp", noise.kind, &name("t"), &inputs);
            let mut value = self.two("multiply", &name("c3"), &t, In::Numbers(&c3));
            value = self.two("add", &name("c2"), &value, In::Numbers(&c2));
            value = self.two("multiply", &name("t2"), &value, In::Node(&t));
            value = self.two("add", &name("c1"), &value, In::Numbers(&c1));
            value = self.two("multiply", &name("t3"), &value, In::Node(&t));
            sum = self.two("add", "histogram", &sum, In::Node(&value));
        }
        sum
    }

    /// Value `i` of all maps' channels.
    fn value(&mut self, program: &Program, channels: &[Node], i: usize) -> Node {
        let mut sum: Option<Node> = None;
        for (channel, row) in channels.iter().zip(program.matrix[i].chunks(TOGETHER)) {
            let row: [f64; TOGETHER] =
                std::array::from_fn(|k| row.get(k).map_or(0.0, |&v| f64::from(v)));
            let (category, row) = match self.kind {
                "float" => ("multiply", self.channels(&row)),
                _ => ("dotproduct", self.channels(&row)),
            };
            let inputs = [("in1", In::Node(channel)), ("in2", In::Numbers(&row))];
            let name = format!("value{i}");
            let part = self.node(category, "float", &name, &inputs);
            sum = Some(match sum {
                Some(sum) => self.two("add", &name, &sum, In::Node(&part)),
                None => part,
            });
        }
        let noise = sum.unwrap_or_else(|| Node { name: String::new(), kind: "float" });
        let noise =
            self.two("multiply", &format!("value{i}_noise"), &noise, In::Port("contrast", "float"));
        let mean = [f64::from(program.mean[i])];
        self.two("add", &format!("value{i}_encoded"), &noise, In::Numbers(&mean))
    }

    /// The outputs of a map whose channels are `values`.
    fn map(
        &mut self,
        (map, encoding, _): &(String, String, usize),
        kind: MapKind,
        values: &[Node],
    ) -> Vec<Output> {
        let vector = if encoding == "data" { "vector3" } else { "color3" };
        let together = match values {
            [x, y, z] => Some([x, y, z]),
            // A material wants grey as a color.
            [grey] if vector == "color3" => Some([grey; 3]),
            _ => None,
        };
        let nodes = match together {
            Some(parts) => {
                let inputs: Vec<_> =
                    ["in1", "in2", "in3"].into_iter().zip(parts.map(In::Node)).collect();
                vec![self.node("combine3", vector, map, &inputs)]
            }
            None => values.to_vec(),
        };
        let count = nodes.len();
        let output = |(i, node): (usize, Node)| {
            let node = match encoding.as_str() {
                "srgb" => self.decoded(map, &node),
                "linear" => self.two("max", map, &node, In::Number(0.0)),
                _ if kind.is_normal() && node.kind == "vector3" => self.normal(map, kind, &node),
                _ => self.clamped(map, &node),
            };
            let number = if count > 1 { format!("_{}", i + 1) } else { String::new() };
            let map = format!("{map}{number}");
            let name = self.unique(&format!("{map}_out"));
            Output { map, is_normal: kind.is_normal(), name, node }
        };
        nodes.into_iter().enumerate().map(output).collect()
    }

    /// Within 0 and 1, as a picture would be.
    fn clamped(&mut self, name: &str, value: &Node) -> Node {
        let inputs = [("in", In::Node(value)), ("low", In::Number(0.0)), ("high", In::Number(1.0))];
        self.node("clamp", value.kind, &format!("{name}_clamped"), &inputs)
    }

    /// Linear light of sRGB values: a straight line up to a threshold plus a power of what is above.
    fn decoded(&mut self, map: &str, encoded: &Node) -> Node {
        let name = |what: &str| format!("{map}_{what}");
        let value = self.clamped(map, encoded);
        let low = self.two("min", &name("low"), &value, In::Number(THRESHOLD));
        let low = self.two("divide", &name("line"), &low, In::Number(12.92));
        let high = self.two("max", &name("high"), &value, In::Number(THRESHOLD));
        let high = self.two("add", &name("high"), &high, In::Number(0.055));
        let high = self.two("divide", &name("high"), &high, In::Number(1.055));
        let high = self.two("power", &name("high"), &high, In::Number(2.4));
        let high = self.two("subtract", &name("high"), &high, In::Number(THRESHOLD / 12.92));
        // Where a host writes six decimals, black would be less than nothing.
        let high = self.two("max", &name("high"), &high, In::Number(0.0));
        self.two("add", &name("light"), &low, In::Node(&high))
    }

    /// A stored normal brought to unit length, with green up.
    fn normal(&mut self, map: &str, kind: MapKind, stored: &Node) -> Node {
        let name = |what: &str| format!("{map}_{what}");
        let up = if kind == MapKind::NormalDx { -2.0 } else { 2.0 };
        let vector = self.two("subtract", &name("vector"), stored, In::Number(0.5));
        let vector = self.two("multiply", &name("vector"), &vector, In::Numbers(&[2.0, up, 2.0]));
        let unit = self.node("normalize", "vector3", &name("unit"), &[("in", In::Node(&vector))]);
        let half = self.two("multiply", &name("half"), &unit, In::Number(0.5));
        self.two("add", &name("stored"), &half, In::Number(0.5))
    }
}

/// Where sRGB's straight line ends.
const THRESHOLD: f64 = 0.040_45;

/// An output of the graph.
struct Output {
    /// The map, or its channel.
    map: String,
    is_normal: bool,
    name: String,
    node: Node,
}

/// Maps by the inputs of the surface that take them, and their types.
const SURFACE: [(&str, &str, &str); 4] = [
    ("basecolor", "base_color", "color3"),
    ("roughness", "specular_roughness", "float"),
    ("metallic", "metalness", "float"),
    ("emission", "emission_color", "color3"),
];

/// The whole file: the graph, and a material that uses its outputs by the names of the maps.
fn document(name: &str, graph: &Graph, outputs: &[Output]) -> String {
    let id = identifier(name);
    let (mut ports, mut normal, mut surface) = (String::new(), String::new(), String::new());
    for Output { map, is_normal, name: output, node } in outputs {
        let kind = node.kind;
        let _ = writeln!(
            ports,
            r#"    <output name="{output}" type="{kind}" nodename="{}" />"#,
            node.name
        );
        let from = format!(r#"nodegraph="NG_{id}" output="{output}""#);
        // A single color is the base's, whatever it is called.
        let map = if outputs.len() == 1 && kind == "color3" { "basecolor" } else { map };
        if let Some((_, input, _)) = SURFACE.iter().find(|s| (s.0, s.2) == (map, kind)) {
            let _ = writeln!(surface, r#"    <input name="{input}" type="{kind}" {from} />"#);
            if let Some(weight) = input.strip_suffix("_color") {
                let _ =
                    writeln!(surface, r#"    <input name="{weight}" type="float" value="1" />"#);
            }
        } else if *is_normal && kind == "vector3" && normal.is_empty() {
            normal = format!(
                r#"  <normalmap name="normal_{id}" type="vector3">
    <input name="in" type="vector3" {from} />
  </normalmap>
"#
            );
            let source = format!(r#"nodename="normal_{id}""#);
            let _ = writeln!(surface, r#"    <input name="normal" type="vector3" {source} />"#);
        }
    }
    let nodes = &graph.text;
    format!(
        r#"<?xml version="1.0"?>
<!-- A procedural texture by texforge. The graph is the texture, the material uses it. One unit of the
     texture coordinates is one photo; `scale` is the number of photos, `contrast` multiplies what differs
     from the mean. Colors come out as linear light with Rec. 709 primaries. The pictures are numbers: no
     color conversion, linear interpolation. -->
<materialx version="1.38" colorspace="lin_rec709">
  <nodegraph name="NG_{id}">
    <input name="scale" type="vector2" value="1, 1" doc="number of photos along u and v" />
    <input name="contrast" type="float" value="1" doc="factor of what differs from the mean" />
{nodes}{ports}  </nodegraph>
{normal}  <standard_surface name="SR_{id}" type="surfaceshader">
{surface}  </standard_surface>
  <surfacematerial name="{id}" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="SR_{id}" />
  </surfacematerial>
</materialx>
"#
    )
}

fn vector(len: usize) -> &'static str {
    match len {
        1 => "float",
        2 => "vector2",
        _ => "vector3",
    }
}

/// As single floats, which is how they are computed with.
fn numbers(values: &[f64]) -> String {
    values.iter().map(|&v| (v as f32).to_string()).collect::<Vec<_>>().join(", ")
}

/// Letters, digits and underscores, no digit in front.
fn identifier(name: &str) -> String {
    let mut text: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        text.insert_str(0, "map_");
    }
    text
}
