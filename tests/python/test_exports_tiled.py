"""Shader exports of tiled textures: compiled, rendered, compared with our own values."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import texforge

from .shaders import EXAMPLES, Filtered, View, compile_example, render_example
from .tiled_exports import points, textures

if TYPE_CHECKING:
    from pathlib import Path

    from .shaders import Picture, Texture

SIZE = (75, 128)
TARGETS = ["glsl", "glsl-es", "wgsl", "hlsl"]
VIEWS = {
    "photo": (1.0, (-40.0, -30.0)),
    "magnified": (0.37, (-700.25, 1234.5)),
    "filtered": (2.9, (30.0, -50.0)),
    "fading": (6.3, (-900.0, 20.0)),
    # Where a float holds halves of a pixel and no more.
    "far away": (1.0, (1048576.0, -8000000.0)),
}
"""Pixels of the photo to a pixel, and where the corner lies."""
CASES = [
    ("grey", "magnified"),
    ("grey", "filtered"),
    ("color", "photo"),
    ("color", "filtered"),
    ("color", "far away"),
    ("material", "magnified"),
    ("material", "fading"),
]


@pytest.fixture(scope="module")
def made() -> dict[str, texforge.NoiseTexture]:
    return textures()


def pictures(
    files: dict[str, bytes], folder: Path, *, flipped: bool
) -> dict[str, Texture | Filtered]:
    """Return the pictures among the files: the table as it is, the input with mipmaps."""
    read: dict[str, Texture | Filtered] = {}
    for file, content in files.items():
        name, _, extension = file.rpartition(".")
        if extension == "png":
            (folder / file).write_bytes(content)
            pixels: Texture = texforge.read_image(folder / file, kind="data")
            if pixels.ndim == 3:
                pixels = np.concatenate([pixels, np.zeros_like(pixels[..., :1])], axis=2)
            if flipped:
                pixels = np.ascontiguousarray(pixels[::-1])
            read[name] = pixels if name.endswith("_table") else Filtered(pixels)
    return read


def shown(
    files: dict[str, bytes], target: str, folder: Path, *, flipped: bool = False, **view: Any
) -> Picture:
    """Render the example of an export."""
    source = files[f"stones{EXAMPLES[target]}"].decode()
    images = pictures(files, folder, flipped=flipped)
    if flipped:
        assert "flipped = false" in source
        source = source.replace("flipped = false", "flipped = true")
    return render_example(source, target, SIZE, images, View(**view))


@pytest.mark.parametrize(("name", "view"), CASES)
@pytest.mark.parametrize("target", TARGETS)
def test_values_are_ours(
    made: dict[str, texforge.NoiseTexture],
    tmp_path: Path,
    target: str,
    name: str,
    view: str,
) -> None:
    texture = made[name]
    scale, origin = VIEWS[view]
    files = texture.export(target, name="stones")  # type: ignore[arg-type]
    # What the shader is given is a float.
    places = points(SIZE, scale, origin).astype(np.float32)
    wanted = texture.at(places, footprint=scale)
    for number, (map_name, channels) in enumerate(texture.channels.items()):
        which = number if len(texture.maps) > 1 else None
        read = shown(files, target, tmp_path, scale=scale, origin=origin, which=which)
        expected = wanted[..., channels]
        error = np.abs(read[..., : expected.shape[-1]] - expected)
        print(f"{target} {name} {view} {map_name}: {error.mean():.2g}, at most {error.max():.2g}")
        # Mipmaps are whole numbers.
        assert error.mean() < 1e-5, map_name
        assert error.max() < 5e-4, map_name


@pytest.mark.parametrize("target", TARGETS)
def test_contrast_linear_light_and_flipped_pictures(
    made: dict[str, texforge.NoiseTexture], tmp_path: Path, target: str
) -> None:
    texture = made["color"]
    files = texture.export(target, name="stones")  # type: ignore[arg-type]
    mean = np.asarray(texture.document["mean"])
    stored = mean + 0.5 * (texture.at(points(SIZE, 1)) - mean)
    light = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    for flipped in (False, True):
        read = shown(files, target, tmp_path, contrast=0.5, linear_light=True, flipped=flipped)
        np.testing.assert_allclose(read[..., :3], light, atol=1e-4)


@pytest.mark.parametrize("target", TARGETS)
def test_any_name(made: dict[str, texforge.NoiseTexture], target: str) -> None:
    for name in ("table", "input_0", "WIDTH", "log2"):
        files = made["grey"].export(target, name=name)  # type: ignore[arg-type]
        (example,) = (f for f in files if f.endswith(EXAMPLES[target]))
        source = files[example].decode()
        compile_example(source, target)


@pytest.mark.parametrize("name", ["grey", "color"])
def test_osl_holds_the_same(
    made: dict[str, texforge.NoiseTexture], tmp_path: Path, name: str
) -> None:
    files = made[name].export("osl", name="stones") | made[name].export("wgsl", name="stones")
    for file in ("stones_levels.png", "stones_input.png", "stones_table.png"):
        (tmp_path / file).write_bytes(files[file])
    levels, level, table = (
        np.asarray(texforge.read_image(tmp_path / f"stones_{what}.png", kind="data"))
        for what in ("levels", "input", "table")
    )
    height, width = level.shape[:2]
    assert levels.dtype == np.uint16
    assert levels.shape[:2] == (height, width * 3 // 2)
    exact, top, left = level.astype(float), 0, 0
    for number in range(3):
        rows, columns = exact.shape[:2]
        part = levels[top : top + rows, left : left + columns]
        assert np.abs(part - exact).max() <= 0.5, number
        top, left = (0 if number == 0 else top + rows), width
        halves = exact.reshape(rows // 2, 2, columns // 2, 2, *exact.shape[2:])
        exact = halves.mean((1, 3))
    assert not levels[top:, width:].any()

    found = re.search(r"int table\[2048\] = \{(.*?)\}", files["stones.osl"].decode(), re.DOTALL)
    assert found is not None
    words = np.array([int(word) for word in found[1].split(",")]).reshape(32, 32, 2)
    for side in (0, 1):
        three = words[..., side, None] >> (0, 8, 16) & 255
        np.testing.assert_array_equal(three, table[:, 32 * side : 32 * side + 32])


def test_targets_share_their_pictures(made: dict[str, texforge.NoiseTexture]) -> None:
    known: dict[str, bytes] = {}
    for target in (*TARGETS, "osl"):
        for name, content in made["material"].export(target, name="stones").items():  # type: ignore[arg-type]
            assert known.setdefault(name, content) == content
    assert sorted(name for name in known if name.endswith(".png")) == [
        "stones_input_0.png",
        "stones_input_1.png",
        "stones_levels_0.png",
        "stones_levels_1.png",
        "stones_table.png",
    ]
