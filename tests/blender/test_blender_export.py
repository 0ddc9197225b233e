"""Blender exports: the node group is rendered and compared with our own values."""

from __future__ import annotations

import os
import runpy
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
import pytest

from .cycles import render_node_group

if TYPE_CHECKING:
    import numpy.typing as npt

    from .cycles import Engine

HERE = Path(__file__).parent
PYTHON = HERE.parent.parent / ".venv" / "bin" / "python"
"""Where texforge is installed."""

MAPS = [
    ("grey", "basecolor"),
    ("color", "basecolor"),
    ("square", "basecolor"),
    ("material", "basecolor"),
    ("material", "roughness"),
    ("material", "normal_dx"),
    ("oriented", "basecolor"),
    ("tiled_grey", "basecolor"),
    ("tiled_color", "basecolor"),
    ("tiled_material", "basecolor"),
    ("tiled_material", "roughness"),
]


@pytest.fixture(scope="module")
def exports(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a folder for each texture: its script, and what its maps must show."""
    folder = tmp_path_factory.mktemp("exports")
    command: list[str | Path] = [PYTHON, "-m", "tests.python.node_exports", "blender", folder]
    try:
        done = subprocess.run(
            command, cwd=HERE.parent.parent, capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        if os.environ.get("TEXFORGE_CI"):
            raise
        pytest.skip(f"{PYTHON} is missing: make setup")
    assert not done.returncode, done.stderr
    return folder


def shown(
    exports: Path,
    name: str,
    output: str,
    wanted: npt.NDArray[np.float64],
    engine: Engine = "CYCLES",
    **inputs: float,
) -> npt.NDArray[np.float32]:
    """Render an output as the arrays have it: row 0 on top, colors in sRGB's encoding."""
    script = exports / name / f"{name}.py"
    read = render_node_group(
        script, wanted.shape[:2], inputs, coordinate="Vector", output=output, engine=engine
    )
    values = read[::-1, :, : wanted.shape[-1]]
    if output != "basecolor":
        return values
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize(("name", "output"), MAPS)
def test_maps_are_ours(exports: Path, name: str, output: str) -> None:
    arrays = [a for a in sorted((exports / name).glob(f"{output}-*.npy")) if a.stem[-1].isdigit()]
    assert len(arrays) == 2
    for array in arrays:
        wanted = np.load(array)
        error = np.abs(shown(exports, name, output, wanted) - wanted)
        print(f"{name} {array.stem}: {error.mean():.2g}, at most {error.max():.2g}")
        # Of tiled textures the pictures are exact.
        factor = 0.05 if name.startswith("tiled") else 1
        assert error.mean() < 0.3 / 255 * factor, array
        assert error.max() < 4 / 255 * factor, array


@pytest.mark.parametrize("name", ["color", "oriented", "tiled_color"])
def test_eevee_shows_the_same(exports: Path, name: str) -> None:
    wanted = np.load(next((exports / name).glob("basecolor-7*.npy")))
    read = shown(exports, name, "basecolor", wanted, "BLENDER_EEVEE_NEXT")
    # Half floats.
    assert np.abs(read - wanted).mean() < 0.4 / 255


def test_contrast_multiplies_what_differs_from_the_mean(exports: Path) -> None:
    wanted = np.load(exports / "color" / "basecolor-contrast.npy")
    read = shown(exports, "color", "basecolor", wanted, Contrast=0.5)
    assert np.abs(read - wanted).mean() < 0.3 / 255


def test_scale_is_the_number_of_photos(exports: Path) -> None:
    one = np.load(next((exports / "color").glob("basecolor-7*.npy")))
    rows, columns = one.shape[0] // 2, one.shape[1] // 2
    small = shown(exports, "color", "basecolor", one[:rows, :columns])
    read = shown(exports, "color", "basecolor", one, Scale=2)
    # v begins at the bottom.
    np.testing.assert_allclose(read[-rows:, :columns], small, atol=1e-3)


@pytest.mark.parametrize("name", ["material", "tiled_material"])
def test_run_again_it_keeps_what_uses_it(exports: Path, name: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    script = str(exports / name / f"{name}.py")
    runpy.run_path(script, run_name="__main__")
    material = bpy.data.materials.new("user")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    node = nodes.new("ShaderNodeGroup")
    node.node_tree = bpy.data.node_groups[name]
    node.inputs["Scale"].default_value = 3
    material.node_tree.links.new(
        node.outputs["roughness"], nodes["Principled BSDF"].inputs["Roughness"]
    )
    counts = [len(kind) for kind in (bpy.data.node_groups, bpy.data.images)]
    size = len(node.node_tree.nodes)
    runpy.run_path(script, run_name="__main__")
    assert [len(kind) for kind in (bpy.data.node_groups, bpy.data.images)] == counts
    assert node.node_tree == bpy.data.node_groups[name]
    assert len(node.node_tree.nodes) == size
    assert node.inputs["Scale"].default_value == 3
    assert nodes["Principled BSDF"].inputs["Roughness"].is_linked


@pytest.mark.parametrize(("name", "picture"), [("grey", "noise 0"), ("tiled_grey", "input 0")])
def test_the_file_keeps_the_texture(exports: Path, tmp_path: Path, name: str, picture: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    runpy.run_path(str(exports / name / f"{name}.py"), run_name="__main__")
    image = bpy.data.images[f"{name} {picture}"]
    before = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(before)
    saved = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(saved))
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    image = bpy.data.images[f"{name} {picture}"]
    assert bpy.data.node_groups[name].nodes
    after = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(after)
    np.testing.assert_array_equal(before, after)
