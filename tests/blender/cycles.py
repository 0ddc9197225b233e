"""OSL shaders and Blender's node groups, rendered by Blender as functions of texture coordinates.

Every picture is float32, height x width x 4; its pixel `[y, x]` is the value at
`((x + 0.5) / width, (y + 0.5) / height)`, exactly: row 0 is at the bottom of Blender's picture.
"""

from __future__ import annotations

import runpy
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import numpy as np

try:
    import bpy
except ImportError as error:
    raise ImportError(
        f"{error}; on Debian: apt-get install libsm6 libxi6 libxkbcommon0 libxrender1"
    ) from error

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy.typing as npt

# Beside Blender's own Python: `oslquery`, with which Blender asks a script for its parameters.
for folder in Path(bpy.utils.resource_path("LOCAL")).glob("python/lib/*/site-packages"):
    if str(folder) not in sys.path:
        sys.path.append(str(folder))

Engine: TypeAlias = Literal["CYCLES", "BLENDER_EEVEE_NEXT"]

COMPILE = "import sys, bpy, _cycles; sys.exit(not _cycles.osl_compile(*sys.argv[1:]))"


class OslError(Exception):
    """A shader did not compile; the message is the compiler's."""


class _Sockets(NamedTuple):
    """Where a node is asked and answers."""

    coordinate: Any
    output: Any


def compile_osl(source: Path, target: Path) -> None:
    """Compile an `.osl` file to an `.oso` file.

    In a process of its own: the compiler prints its messages, and some sources crash it.
    """
    done = subprocess.run(
        [sys.executable, "-c", COMPILE, source, target], capture_output=True, text=True, check=False
    )
    if done.returncode:
        message = (done.stdout + done.stderr).strip()
        raise OslError(message or f"the compiler ended with status {done.returncode}")


def render_osl(
    source: Path,
    size: tuple[int, int],
    parameters: Mapping[str, object],
    *,
    coordinate: str,
    output: str,
) -> npt.NDArray[np.float32]:
    """Compile a shader and render its output named so; `coordinate` names the input for the point.

    `size` is height and width. An output that is a single number comes as a grey.
    """
    with tempfile.TemporaryDirectory() as folder:
        compiled = Path(folder) / "shader.oso"
        compile_osl(source, compiled)

        def script(tree: Any) -> _Sockets:
            node = tree.nodes.new("ShaderNodeScript")
            node.mode = "EXTERNAL"
            node.filepath = str(compiled)
            for name, value in parameters.items():
                node.inputs[name].default_value = value
            return _Sockets(node.inputs[coordinate], node.outputs[output])

        return _render(script, size, osl=True)


def render_node_group(
    script: Path,
    size: tuple[int, int],
    parameters: Mapping[str, object],
    *,
    coordinate: str,
    output: str,
    engine: Engine = "CYCLES",
) -> npt.NDArray[np.float32]:
    """Run a Python script that makes one shader node group, and render that group's output."""

    def group(tree: Any) -> _Sockets:
        before = set(bpy.data.node_groups)
        runpy.run_path(str(script), run_name="__main__")
        # Groups inside the group are made as well: it is the one that no other uses.
        made = [g for g in bpy.data.node_groups if g not in before and g.users == g.use_fake_user]
        if len(made) != 1:
            raise ValueError(f"{script} made {len(made)} node groups that no other uses")
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = made[0]
        for name, value in parameters.items():
            node.inputs[name].default_value = value
        return _Sockets(node.inputs[coordinate], node.outputs[output])

    return _render(group, size, osl=False, engine=engine)


def _render(
    build: Callable[[Any], _Sockets], size: tuple[int, int], *, osl: bool, engine: Engine = "CYCLES"
) -> npt.NDArray[np.float32]:
    """Render a plane that glows in the color of the node that `build` adds."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _settings(scene, size, engine, osl=osl)
    tree = _plane(scene, size)
    sockets = build(tree)
    emission = tree.nodes.new("ShaderNodeEmission")
    surface = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(_pixel_centers(tree, size), sockets.coordinate)
    tree.links.new(sockets.output, emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], surface.inputs["Surface"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(str(path))
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty((*size, 4), np.float32)
        image.pixels.foreach_get(pixels.ravel())
    return pixels


def _settings(scene: Any, size: tuple[int, int], engine: Engine, *, osl: bool) -> None:
    """One ray through each pixel, light as it comes, floats in the file."""
    render = scene.render
    render.engine = engine
    render.resolution_y, render.resolution_x = size
    render.resolution_percentage = 100
    render.filter_size = 0.01
    render.dither_intensity = 0
    scene.display_settings.display_device = "sRGB"
    scene.view_settings.view_transform = "Raw"
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGBA"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "ZIP"
    scene.eevee.taa_render_samples = 1
    # On the processor it blurs what is magnified.
    bpy.context.preferences.system.anisotropic_filter = "FILTER_0"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.shading_system = osl
    cycles.samples = 1
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.max_bounces = 0
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 0.01


def _plane(scene: Any, size: tuple[int, int]) -> Any:
    """Fill the camera's view with a plane; return its material's node tree."""
    height, width = (n / max(size) for n in size)
    mesh = bpy.data.meshes.new("plane")
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    mesh.from_pydata([(u * width, v * height, 0) for u, v in corners], [], [(0, 1, 2, 3)])
    for loop, uv in zip(mesh.uv_layers.new().data, corners, strict=True):
        loop.uv = uv
    plane = bpy.data.objects.new("plane", mesh)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 1
    camera.location = (width / 2, height / 2, 1)
    scene.camera = camera
    scene.collection.objects.link(plane)
    scene.collection.objects.link(camera)
    material = bpy.data.materials.new("glow")
    material.use_nodes = True
    material.node_tree.nodes.clear()
    mesh.materials.append(material)
    return material.node_tree


def _pixel_centers(tree: Any, size: tuple[int, int]) -> Any:
    """Return a socket with the middle of each pixel.

    The ray goes through a random point within a hundredth of a pixel, at the least; floors undo it.
    """
    height, width = size
    value = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
    for operation, operand in [
        ("MULTIPLY", (width, height, 1)),
        ("FLOOR", (0, 0, 0)),
        ("ADD", (0.5, 0.5, 0)),
        ("DIVIDE", (width, height, 1)),
    ]:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        tree.links.new(value, node.inputs[0])
        node.inputs[1].default_value = operand
        value = node.outputs["Vector"]
    return value
