"""Shader exports: compiled, rendered, compared with our own values."""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge
from PIL import Image

from .noise_exports import ORIENTED, textures
from .shaders import EXAMPLES, View, render_example

if TYPE_CHECKING:
    Picture = npt.NDArray[np.float32]

SIZE = (75, 128)
TARGETS = ["glsl", "glsl-es", "wgsl", "hlsl"]
NAMES = ["grey", "color", "square", "material", "oriented"]
VIEWS = {
    "photo": (1.0, (0.0, 0.0)),
    "magnified": (0.37, (-700.25, 1234.5)),
    "filtered": (2.9, (30.0, -50.0)),
}
"""Pixels of the photo to a pixel, and where the corner lies."""


@pytest.fixture(scope="module")
def made() -> dict[str, texforge.NoiseTexture]:
    return textures()


def shown(files: dict[str, bytes], target: str, name: str = "granite", **view: Any) -> Picture:
    """Render the example of an export."""
    source = files[f"{name}{EXAMPLES[target]}"].decode()
    with Image.open(io.BytesIO(files[f"{name}_tile.png"])) as image:
        tile = np.asarray(image.convert("RGBA"))
    return render_example(source, target, SIZE, {f"{name}_tile": tile}, View(**view))


def points(scale: float, origin: tuple[float, float]) -> npt.NDArray[np.float64]:
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] + 0.5
    return np.stack([x, y], axis=-1) * scale + origin


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("target", TARGETS)
def test_values_are_ours(
    made: dict[str, texforge.NoiseTexture], target: str, name: str, view: str
) -> None:
    texture = made[name]
    scale, origin = VIEWS[view]
    files = texture.export(target, name="granite")  # type: ignore[arg-type]
    wanted = texture.at(points(scale, origin), footprint=scale)
    for number, (map_name, channels) in enumerate(texture.channels.items()):
        which = number if len(texture.maps) > 1 else None
        read = shown(files, target, scale=scale, origin=origin, which=which)
        expected = wanted[..., channels]
        error = np.abs(read[..., : expected.shape[-1]] - expected)
        # A float's digits of coordinates around 1000 are the most of it.
        assert error.mean() < 1e-5, map_name
        assert error.max() < 5e-4, map_name


@pytest.mark.parametrize("target", TARGETS)
def test_contrast_and_linear_light(made: dict[str, texforge.NoiseTexture], target: str) -> None:
    texture = made["color"]
    files = texture.export(target, name="granite")  # type: ignore[arg-type]
    read = shown(files, target, contrast=0.5, linear_light=True)[..., :3]
    mean = np.asarray(texture.document["mean"])
    stored = mean + 0.5 * (texture.at(points(1, (0, 0))) - mean)
    light = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(read, light, atol=1e-5)


MAPS = [("half", 1), ("Normal", 2), ("2 x", 3), ("texture", 4), ("c0", 5), ("scale", 1)]
"""Of all numbers of channels, with names that no language takes, or that the shader itself uses."""


@pytest.mark.parametrize("target", TARGETS)
def test_any_name_and_number_of_channels(target: str) -> None:
    count = sum(channels for _, channels in MAPS)
    document = json.loads(json.dumps(ORIENTED))
    document["maps"] = [
        {"name": name, "kind": "color", "encoding": "srgb", "channels": channels}
        for name, channels in MAPS
    ]
    document["mean"] = [0.05 * i for i in range(count)]
    document["matrix"] = [[1, 0.1 * i, -0.1] for i in range(count)]
    texture = texforge.NoiseTexture.from_json(json.dumps(document))
    # In a structure each holds up to four channels.
    starts = [0, 1, 3, 6, 10, 14, 15]
    wanted = texture.at(points(1, (0, 0)), footprint=1)
    for given, name in [("float", "float_texture"), ("a--b", "a_b"), ("7", "texture_7")]:
        files = texture.export(target, name=given)  # type: ignore[arg-type]
        for which, (start, end) in enumerate(zip(starts, [*starts[1:], count], strict=True)):
            read = shown(files, target, name, which=which)
            np.testing.assert_allclose(read[..., : end - start], wanted[..., start:end], atol=5e-5)
            if given != "float":
                break
