from __future__ import annotations

import base64

import bpy
import numpy as np


class Graph:
    """Nodes of a group, laid out from left to right."""

    def __init__(self, tree):
        self.tree = tree
        self.count = 0

    def node(self, kind, label="", **settings):
        node = self.tree.nodes.new(kind)
        node.label = label
        node.location = (200 * (self.count // 8), -180 * (self.count % 8))
        self.count += 1
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def connect(self, value, socket):
        """Let a socket have a number, a vector, or what another socket gives."""
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def vector(self, operation, *values, label=""):
        node = self.node("ShaderNodeVectorMath", label, operation=operation)
        for value, socket in zip(values, node.inputs):
            self.connect(value, socket)
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def number(self, operation, *values, label=""):
        node = self.node("ShaderNodeMath", label, operation=operation)
        for value, socket in zip(values, node.inputs):
            self.connect(value, socket)
        return node.outputs["Value"]

    def parts(self, vector):
        """Return the three numbers of a vector."""
        node = self.node("ShaderNodeSeparateXYZ")
        self.connect(vector, node.inputs["Vector"])
        return list(node.outputs)

    def lookup(self, image, at, label, interpolation, extension="REPEAT"):
        """Return what an image shows at texture coordinates."""
        settings = {"image": image, "interpolation": interpolation, "extension": extension}
        node = self.node("ShaderNodeTexImage", label, **settings)
        self.connect(at, node.inputs["Vector"])
        return node.outputs["Color"]

    def combined(self, x, y, z, label=""):
        node = self.node("ShaderNodeCombineXYZ", label)
        for value, socket in zip((x, y, z), node.inputs):
            self.connect(value, socket)
        return node.outputs["Vector"]


def numbers(text, kind, *shape):
    """Return an array of its bytes in base 64."""
    return np.frombuffer(base64.b64decode(text), kind).reshape(shape).astype(np.float64)


def picture(name, rows):
    """Return an image of numbers: rows from the top, with one or three numbers in each pixel."""
    height, width = rows.shape[:2]
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = rows[::-1]
    old = bpy.data.images.get(name)
    if old is not None:
        bpy.data.images.remove(old)
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=True)
    image.alpha_mode = "CHANNEL_PACKED"
    image.use_half_precision = False
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def emptied(name):
    """Return the group of this name without its nodes, or a new one: its users keep it."""
    for group in bpy.data.node_groups:
        if group.name == name and group.bl_idname == "ShaderNodeTree":
            group.nodes.clear()
            return group
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group.use_fake_user = True
    return group


def sockets(group, wanted):
    """Give a group these sockets (name, in or out, type); those it has already keep their links."""
    there = {(s.name, s.in_out, s.socket_type): s for s in group.interface.items_tree}
    kept = []
    for key in wanted:
        name, in_out, kind = key
        socket = there.pop(key, None) or group.interface.new_socket(
            name, in_out=in_out, socket_type=kind
        )
        kept.append(socket)
    for socket in there.values():
        group.interface.remove(socket)
    return kept


def histogram(graph, noise, shape):
    """Return the noise with its histograms: pieces of cubic splines, added up."""
    value = shape["base"]
    if shape["straight"]:
        value = graph.vector("MULTIPLY_ADD", noise, shape["straight"], value)
    for knot, width, (c1, c2, c3) in shape["pieces"]:
        t = graph.vector("SUBTRACT", noise, (knot,) * 3, label=f"from {knot}")
        t = graph.vector("MAXIMUM", t, (0, 0, 0))
        t = graph.vector("MINIMUM", t, (width,) * 3)
        piece = graph.vector("MULTIPLY_ADD", t, c3, c2)
        piece = graph.vector("MULTIPLY_ADD", t, piece, c1)
        value = graph.vector("MULTIPLY_ADD", t, piece, value)
    return value


def clamped(graph, value):
    """Return a number held within 0 and 1, as a picture would."""
    node = graph.node("ShaderNodeClamp")
    graph.connect(value, node.inputs["Value"])
    return node.outputs["Result"]


def linear_light(graph, value):
    """Return the linear light of a number in sRGB's encoding."""
    low = graph.number("MINIMUM", value, 0.04045)
    high = graph.number("MAXIMUM", value, 0.04045)
    high = graph.number("MULTIPLY_ADD", high, 1 / 1.055, 0.055 / 1.055)
    high = graph.number("POWER", high, 2.4)
    high = graph.number("SUBTRACT", high, 0.04045 / 12.92)
    return graph.number("MULTIPLY_ADD", low, 1 / 12.92, high)


def normal(graph, values, flipped):
    """Return the direction in the world of a stored normal."""
    stored = graph.combined(*values)
    if flipped:
        stored = graph.vector("MULTIPLY_ADD", stored, (1, -1, 1), (0, 1, 0))
    node = graph.node("ShaderNodeNormalMap")
    graph.connect(stored, node.inputs["Color"])
    return node.outputs["Normal"]


def shown(graph, values, image):
    """Return what the outputs of a map give; `values` are its channels."""
    if image["normal"] and len(values) == 3:
        return [normal(graph, values, image["normal"] == "dx")]
    if image["encoding"] == "linear":
        values = [graph.number("MAXIMUM", value, 0) for value in values]
    else:
        values = [clamped(graph, value) for value in values]
    if image["encoding"] == "srgb":
        values = [linear_light(graph, value) for value in values]
    if len(values) == 3:
        return [graph.combined(*values, label=image["name"])]
    return values


def outputs_of(image):
    """Return names and types of the outputs of a map."""
    name, count = image["name"], image["channels"]
    if count == 3 and image["encoding"] == "data":
        return [(name, "OUTPUT", "NodeSocketVector")]
    if count == 3 or (count == 1 and image["encoding"] != "data"):
        return [(name, "OUTPUT", "NodeSocketColor")]
    numbers = [""] if count == 1 else [f" {i + 1}" for i in range(count)]
    return [(name + number, "OUTPUT", "NodeSocketFloat") for number in numbers]


def build(texture):
    """Make the node group, or make it anew."""
    group = emptied(texture["name"])
    ports = [
        ("Vector", "INPUT", "NodeSocketVector"),
        ("Scale", "INPUT", "NodeSocketFloat"),
        ("Contrast", "INPUT", "NodeSocketFloat"),
    ]
    ports += [port for image in texture["maps"] for port in outputs_of(image)]
    vector, scale, contrast, *_ = sockets(group, ports)
    vector.hide_value = True
    scale.default_value = contrast.default_value = 1
    scale.description = "Number of photos to a unit of Vector"
    contrast.description = "Factor of what differs from the mean"

    graph = Graph(group)
    given = graph.node("NodeGroupInput").outputs
    place = graph.vector("SCALE", given["Vector"], label="photos")
    graph.connect(given["Scale"], place.node.inputs["Scale"])
    place = graph.vector("MULTIPLY", place, (*texture["size"], 0), label="pixels")
    channels = [
        histogram(graph, noise, part["shape"]) if part["shape"] else noise
        for part, noise in zip(texture["groups"], noises(graph, texture, place))
    ]
    values = list(texture["mean"])
    for i, row in enumerate(texture["matrix"]):
        for noise, weights in zip(channels, row):
            part = graph.vector("DOT_PRODUCT", noise, weights, label=f"value {i + 1}")
            values[i] = graph.number("MULTIPLY_ADD", part, given["Contrast"], values[i])

    taken = graph.node("NodeGroupOutput")
    first, sink = 0, iter(taken.inputs)
    for image in texture["maps"]:
        last = first + image["channels"]
        for value in shown(graph, values[first:last], image):
            graph.connect(value, next(sink))
        first = last
