"""The harness of cycles.py, on subjects with one right answer: a 32-bit hash, and a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from .cycles import OslError, compile_osl, render_node_group, render_osl

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from .cycles import Engine

SIZE = (37, 53)
"""Odd, so that a swapped or padded row shows."""
SEED = 7

OSL = """
shader hashed(point At = 0, int seed = 0, output color Color = 0) {
    int x = (int)floor(At[0] * 53);
    int y = (int)floor(At[1] * 37);
    int h = x * 374761393 + y * 668265263 + seed;
    h = (h ^ ((h >> 13) & 0x7ffff)) * 1274126177;
    h = h ^ ((h >> 16) & 0xffff);
    Color = color(((h >> 8) & 0xffffff) / 16777216.0, h & 255, x + 64 * y);
}
"""

NODES = """
import bpy
import numpy as np

table = np.load({table!r})
image = bpy.data.images.new(
    "table", table.shape[1], table.shape[0], alpha=True, float_buffer=True, is_data=True
)
image.pixels.foreach_set(table.ravel())
image.pack()
group = bpy.data.node_groups.new("table", "ShaderNodeTree")
group.interface.new_socket("At", in_out="INPUT", socket_type="NodeSocketVector")
group.interface.new_socket("Factor", in_out="INPUT", socket_type="NodeSocketFloat")
group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
given = group.nodes.new("NodeGroupInput")
taken = group.nodes.new("NodeGroupOutput")
texture = group.nodes.new("ShaderNodeTexImage")
texture.image = image
texture.interpolation = "Closest"
scaled = group.nodes.new("ShaderNodeVectorMath")
scaled.operation = "SCALE"
group.links.new(given.outputs["At"], texture.inputs["Vector"])
group.links.new(texture.outputs["Color"], scaled.inputs["Vector"])
group.links.new(given.outputs["Factor"], scaled.inputs["Scale"])
group.links.new(scaled.outputs["Vector"], taken.inputs["Color"])
"""


def hashed() -> npt.NDArray[np.float32]:
    """Return what the shader must say."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.uint32)
    h = x * np.uint32(374761393) + y * np.uint32(668265263) + np.uint32(SEED)
    h = (h ^ (h >> np.uint32(13))) * np.uint32(1274126177)
    h ^= h >> np.uint32(16)
    top = (h >> np.uint32(8)).astype(np.float32) / np.float32(1 << 24)
    low = (h & np.uint32(255)).astype(np.float32)
    return np.stack([top, low, (x + 64 * y).astype(np.float32)], axis=2)


def test_osl_hashes(tmp_path: Path) -> None:
    source = tmp_path / "hashed.osl"
    source.write_text(OSL)
    read = render_osl(source, SIZE, {"seed": SEED}, coordinate="At", output="Color")
    np.testing.assert_array_equal(read[..., :3], hashed())


def test_osl_is_given_the_middle_of_pixels(tmp_path: Path) -> None:
    source = tmp_path / "point.osl"
    source.write_text("shader at(point At = 0, output color Color = 0) { Color = (color)At; }")
    read = render_osl(source, SIZE, {}, coordinate="At", output="Color")
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    np.testing.assert_array_equal(read[..., 0], (x + np.float32(0.5)) / np.float32(SIZE[1]))
    np.testing.assert_array_equal(read[..., 1], (y + np.float32(0.5)) / np.float32(SIZE[0]))


def test_refused_osl_says_why(tmp_path: Path) -> None:
    source = tmp_path / "broken.osl"
    source.write_text(OSL.replace("x *", "q *"))
    with pytest.raises(OslError, match="'q' was not declared in this scope"):
        compile_osl(source, tmp_path / "broken.oso")


@pytest.mark.parametrize(
    ("engine", "tolerance"),
    # Eevee's pictures hold half floats, cut off.
    [("CYCLES", 0), ("BLENDER_EEVEE_NEXT", 2**-10)],
)
def test_a_node_group_reads_its_packed_table(
    tmp_path: Path, engine: Engine, tolerance: float
) -> None:
    table = np.random.default_rng(0).random((*SIZE, 4), np.float32)
    table[..., 3] = 1
    np.save(tmp_path / "table.npy", table)
    script = tmp_path / "table.py"
    script.write_text(NODES.format(table=str(tmp_path / "table.npy")))
    read = render_node_group(
        script, SIZE, {"Factor": 0.5}, coordinate="At", output="Color", engine=engine
    )
    np.testing.assert_allclose(read[..., :3], table[..., :3] / 2, rtol=tolerance, atol=0)


def test_a_script_that_makes_no_group_is_refused(tmp_path: Path) -> None:
    script = tmp_path / "nothing.py"
    script.write_text("import bpy\n")
    with pytest.raises(ValueError, match="made 0 node groups"):
        render_node_group(script, SIZE, {}, coordinate="At", output="Color")
