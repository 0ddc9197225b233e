//! The graph of a tiled texture (see [`Tiles`]), and the pictures that it reads.

use half::f16;

use super::super::ExportFile;
use super::super::nodes::{Group, Tiles};
use super::{Graph, In, Node, exr};
use crate::base::error::Result;
use crate::method::noise::tiling::SIDE;
use crate::method::noise::tiling::input::PER_DEVIATION;

/// Numbers for each color of vertices.
const COLORS: usize = 3;

/// The nodes that lead to vertices and to their weights; all have a number for each color.
struct Vertices {
    /// Place of the vertices in the table's pictures.
    table: [Node; 2],
    /// The way from the vertices to the point, in pixels of the input, y down.
    way: [Node; 2],
    /// Their weights, to the power of the sharpness.
    weights: Node,
    /// The weights of the next color's vertex along each of three ways, likewise.
    next: [Node; COLORS],
}

impl Graph {
    /// The noise of every group of channels at a place in pixels, v up.
    pub(super) fn tiled(
        &mut self,
        pixels: &Node,
        tiles: &Tiles,
        groups: &[Group],
        name: &str,
    ) -> Vec<Node> {
        let vertices = self.vertices(pixels, tiles);
        let shares = self.shares(&vertices, name);
        let mut sums: Vec<Option<Node>> = groups.iter().map(|_| None).collect();
        for k in 0..COLORS {
            let named = |what: &str| format!("vertex{k}_{what}");
            let place = self.of_color(&vertices.table, k, &named("place"));
            let choice = self.table(name, "places", "vector2", &place, &named("choice"));
            let steps = self.two("multiply", &named("steps"), &choice, In::Numbers(&tiles.step));
            let input = self.two("add", &named("first"), &steps, In::Numbers(&tiles.first));
            let way = self.of_color(&vertices.way, k, &named("way"));
            let input = self.two("add", &named("pixel"), &input, In::Node(&way));
            let [width, height] = tiles.size.map(|n| n as f64);
            // Rows are counted from the top, v from the bottom.
            let input = self.two("divide", &named("part"), &input, In::Numbers(&[width, -height]));
            let input = self.two("add", &named("input"), &input, In::Numbers(&[0.0, 1.0]));
            let share = self.extract(&shares, k, &named("share"));
            for (g, sum) in sums.iter_mut().enumerate() {
                let file = input_file(name, g);
                let inputs = [
                    ("file", In::Word("filename", &file)),
                    ("texcoord", In::Node(&input)),
                    ("uaddressmode", In::Word("string", "clamp")),
                    ("vaddressmode", In::Word("string", "clamp")),
                    ("filtertype", In::Word("string", "linear")),
                ];
                let tile = self.node("image", self.kind, &named("tile"), &inputs);
                let tile = self.two("multiply", &named("blended"), &tile, In::Node(&share));
                *sum = Some(match sum.take() {
                    Some(sum) => self.two("add", "blend", &sum, In::Node(&tile)),
                    None => tile,
                });
            }
        }
        let weighted = |(sum, group): (Option<Node>, &Group)| {
            let weights = self.channels(&group.weights[0]);
            sum.map(|sum| self.two("multiply", "weighted", &sum, In::Numbers(&weights)))
        };
        sums.into_iter().zip(groups).filter_map(weighted).collect()
    }

    /// The vertex of each color around a place in pixels, v up.
    fn vertices(&mut self, pixels: &Node, tiles: &Tiles) -> Vertices {
        let [a, b] = tiles.cell;
        // Along the skewed axes: v = y / b and u = x / a - v / 2, with y down.
        let cells = self.two("divide", "cells", pixels, In::Numbers(&[a, -b]));
        let cells = self.two("add", "cells", &cells, In::Numbers(&[0.0, tiles.top]));
        let [x, v] = [("x", 0), ("v", 1)].map(|(name, i)| self.extract(&cells, i, name));
        let half = self.two("multiply", "half", &v, In::Number(0.5));
        let u = self.two("subtract", "u", &x, In::Node(&half));
        let [u, v] = [u, v].map(|axis| self.one("convert", "vector3", "along", &axis));
        let [i, j] = [&u, &v].map(|axis| self.one("floor", "vector3", "corner", axis));
        let f = self.two("subtract", "f", &u, In::Node(&i));
        let g = self.two("subtract", "g", &v, In::Node(&j));

        // 0.5, 1.5 or 2.5 instead of 0, 1 or 2: so rounding does not matter.
        let of_cell = self.two("subtract", "of_cell", &i, In::Node(&j));
        let colors = [("in1", In::Numbers(&[0.5, 1.5, 2.5])), ("in2", In::Node(&of_cell))];
        let from = self.node("subtract", "vector3", "from_cell", &colors);
        let turns = self.two("divide", "turns", &from, In::Number(3.0));
        let turns = self.one("floor", "vector3", "turns", &turns);
        let turns = self.two("multiply", "turns", &turns, In::Number(3.0));
        let which = self.two("subtract", "which", &from, In::Node(&turns));
        let before = [("in1", In::Numbers(&[1.5; COLORS])), ("in2", In::Node(&which))];
        let corner = self.node("subtract", "vector3", "at_corner", &before);
        let corner = self.two("max", "at_corner", &corner, In::Number(0.0));
        let below = self.two("subtract", "below", &which, In::Number(1.5));
        let below = self.two("max", "below", &below, In::Number(0.0));
        // The far corner is (1, 1).
        let far = self.two("add", "far", &f, In::Node(&g));
        let far = self.one("floor", "vector3", "far", &far);
        let far = self.two("min", "far", &far, In::Number(1.0));
        let far = self.two("multiply", "at_far_corner", &corner, In::Node(&far));
        let right = self.two("add", "not_right", &corner, In::Node(&below));
        let right = [("in1", In::Numbers(&[1.0; COLORS])), ("in2", In::Node(&right))];
        let right = self.node("subtract", "vector3", "right", &right);
        let steps = [(right, "steps_u"), (below, "steps_v")]
            .map(|(step, name)| self.two("add", name, &step, In::Node(&far)));

        let x = self.two("subtract", "x", &f, In::Node(&steps[0]));
        let y = self.two("subtract", "y", &g, In::Node(&steps[1]));
        let z = self.two("add", "z", &x, In::Node(&y));
        let [ax, ay, az] = [&x, &y, &z].map(|way| self.one("absval", "vector3", "length", way));
        let longest = self.two("max", "longest", &ax, In::Node(&ay));
        let longest = self.two("max", "longest", &longest, In::Node(&az));
        let weight = [("in1", In::Numbers(&[1.0; COLORS])), ("in2", In::Node(&longest))];
        let weight = self.node("subtract", "vector3", "weight", &weight);
        // Rounding must not make it less than nothing.
        let weight = self.two("max", "weight", &weight, In::Number(0.0));
        let power = In::Number(f64::from(tiles.sharpness));
        let weights = self.two("power", "weights", &weight, power);

        let [minus_x, minus_y, minus_z] =
            [&x, &y, &z].map(|way| self.two("multiply", "minus", way, In::Number(-1.0)));
        let next = [(&x, &z), (&minus_y, &minus_z), (&minus_x, &y)].map(|(a, b)| {
            let next = self.two("min", "next", a, In::Node(b));
            let next = self.two("max", "next", &next, In::Number(0.0));
            self.two("power", "next", &next, In::Number(f64::from(tiles.sharpness)))
        });

        let down = self.two("multiply", "half_y", &y, In::Number(0.5));
        let along = self.two("add", "way_x", &x, In::Node(&down));
        let way = [(along, a), (y, b)]
            .map(|(way, cell)| self.two("multiply", "way", &way, In::Number(cell)));
        // Row 0 is on top: v = -(j + 0.5) / SIDE, as the picture repeats.
        let side = SIDE as f64;
        let table = [(i, &steps[0], side), (j, &steps[1], -side)].map(|(corner, steps, side)| {
            let vertex = self.two("add", "vertex", &corner, In::Node(steps));
            let middle = self.two("add", "middle", &vertex, In::Number(0.5));
            self.two("divide", "table", &middle, In::Number(side))
        });
        Vertices { table, way, weights, next }
    }

    /// How much of each color's tile is taken.
    fn shares(&mut self, vertices: &Vertices, name: &str) -> Node {
        let pairs: [Node; COLORS] = std::array::from_fn(|k| {
            let named = |what: &str| format!("pair{k}_{what}");
            let place = self.of_color(&vertices.table, k, &named("place"));
            let alike = self.table(name, "alike", "vector3", &place, &named("alike"));
            let next = self.of_color(&vertices.next, k, &named("next"));
            let inputs = [("in1", In::Node(&alike)), ("in2", In::Node(&next))];
            self.node("dotproduct", "float", &named("product"), &inputs)
        });
        let pairs = self.combined(&pairs.each_ref(), "pairs");
        // Twice, and 255 is 1.
        let pairs = self.two("divide", "pairs", &pairs, In::Number(127.5));
        let weights = &vertices.weights;
        let all = self.two("add", "all", weights, In::Node(&pairs));
        let inputs = [("in1", In::Node(weights)), ("in2", In::Node(&all))];
        let variance = self.node("dotproduct", "float", "variance", &inputs);
        let deviation = self.one("sqrt", "float", "deviation", &variance);
        self.two("divide", "shares", weights, In::Node(&deviation))
    }

    /// What a picture of the table says at a vertex.
    fn table(
        &mut self,
        name: &str,
        which: &str,
        kind: &'static str,
        place: &Node,
        node: &str,
    ) -> Node {
        let file = table_file(name, which);
        let inputs = [
            ("file", In::Word("filename", &file)),
            ("texcoord", In::Node(place)),
            ("uaddressmode", In::Word("string", "periodic")),
            ("vaddressmode", In::Word("string", "periodic")),
            ("filtertype", In::Word("string", "closest")),
        ];
        self.node("image", kind, node, &inputs)
    }

    /// The numbers of one color.
    fn of_color(&mut self, nodes: &[Node], color: usize, name: &str) -> Node {
        let parts: Vec<Node> = nodes.iter().map(|node| self.extract(node, color, name)).collect();
        self.combined(&parts.iter().collect::<Vec<_>>(), name)
    }

    fn one(&mut self, category: &str, kind: &'static str, name: &str, value: &Node) -> Node {
        self.node(category, kind, name, &[("in", In::Node(value))])
    }

    fn extract(&mut self, value: &Node, index: usize, name: &str) -> Node {
        let index = index.to_string();
        let inputs = [("in", In::Node(value)), ("index", In::Word("integer", &index))];
        self.node("extract", "float", name, &inputs)
    }

    /// Two or three numbers as a vector.
    fn combined(&mut self, parts: &[&Node], name: &str) -> Node {
        let (category, kind) =
            if parts.len() == 2 { ("combine2", "vector2") } else { ("combine3", "vector3") };
        let inputs: Vec<_> = ["in1", "in2", "in3"]
            .into_iter()
            .zip(parts.iter().map(|part| In::Node(part)))
            .collect();
        self.node(category, kind, name, &inputs)
    }
}

fn table_file(name: &str, which: &str) -> String {
    format!("{name}_table_{which}.exr")
}

fn input_file(name: &str, i: usize) -> String {
    format!("{name}_input_{i}.exr")
}

/// What the graph reads: of every vertex its steps and its correlations, the latter times 255; and the input,
/// in standard deviations. Half floats, so that all are read alike and no host takes one for colors.
pub(super) fn pictures(tiles: &Tiles, name: &str) -> Result<Vec<ExportFile>> {
    let table = [("places", &tiles.choices), ("alike", &tiles.alike)].map(|(which, bytes)| {
        let samples = bytes.iter().flatten().map(|&v| f16::from_f32(f32::from(v))).collect();
        (table_file(name, which), [SIDE; 2], COLORS, samples)
    });
    let [width, height] = tiles.size;
    let inputs = tiles.inputs.iter().enumerate().map(|(i, samples)| {
        let value = |&v: &u16| f16::from_f64((f64::from(v) - 32768.0) / PER_DEVIATION);
        let samples = samples.iter().map(value).collect();
        (input_file(name, i), [height, width], tiles.together, samples)
    });
    let file = |(name, [height, width], channels, samples): (_, [usize; 2], usize, _)| {
        Ok(ExportFile { name, bytes: exr(height, width, channels, samples)? })
    };
    table.into_iter().chain(inputs).map(file).collect()
}
