"""MaterialX exports: accepted by its library, rendered, compared with our own values."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

import numpy as np
import pytest

from .node_exports import textures
from .noise_exports import CONTRAST, SIZES, expected
from .shaders import generate_glsl, generate_text, render_materialx, validate_materialx

if TYPE_CHECKING:
    from pathlib import Path

    import texforge

    from .noise_exports import Values

NOISE = ["grey", "color", "square", "material", "oriented"]
TILED = ["tiled_grey", "tiled_color", "tiled_material"]


@pytest.fixture(scope="module")
def made() -> dict[str, texforge.NoiseTexture]:
    return textures()


def written(texture: texforge.NoiseTexture, name: str, folder: Path) -> Path:
    for file, content in texture.export("materialx", name=name).items():
        (folder / file).write_bytes(content)
    return folder / f"{name}.mtlx"


def shown(document: Path, name: str, size: tuple[int, int]) -> Values:
    """Render a map of the graph as `expected` has it."""
    # Row 0 is at v = 0, the bottom.
    values = render_materialx(document, f"NG_{document.stem}/{name}_out", size)[::-1, :, :3]
    if name == "basecolor":
        return encoded(values)
    return 2 * values - 1 if name == "normal_dx" else values


def encoded(light: Values) -> Values:
    """Return sRGB's encoding of linear light."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("name", NOISE + TILED)
def test_maps_are_ours(made: dict[str, texforge.NoiseTexture], name: str, tmp_path: Path) -> None:
    texture = made[name]
    document = written(texture, name, tmp_path)
    for map_name in texture.maps:
        for size in SIZES:
            wanted = expected(texture, map_name, size)
            read = shown(document, map_name, size)[..., : wanted.shape[-1]]
            error = np.abs(read - wanted)
            print(f"{name} {map_name}: {error.mean():.2g}, at most {error.max():.2g}")
            if name in TILED:
                # Half floats.
                assert error.mean() < 0.05 / 255, (map_name, size)
                assert error.max() < 1 / 255, (map_name, size)
            else:
                # Lookups along straight lines: most where the finest band is strong, at its pixels.
                assert error.mean() < 1 / 255, (map_name, size)
                assert error.max() < 8 / 255, (map_name, size)


@pytest.mark.parametrize("name", NOISE + TILED)
def test_hosts_can_use_it(
    made: dict[str, texforge.NoiseTexture], name: str, tmp_path: Path
) -> None:
    document = written(made[name], name, tmp_path)
    validate_materialx(document)
    generate_glsl(document, name)
    generate_glsl(document, name, "essl")
    node = "vertex0_tile" if name in TILED else "band0_noise"
    assert node in generate_text(document, name, "genosl")
    assert node in generate_text(document, name, "genmdl")


@pytest.mark.parametrize("name", ["color", "tiled_color"])
def test_the_graph_takes_a_scale_and_a_contrast(
    made: dict[str, texforge.NoiseTexture], name: str, tmp_path: Path
) -> None:
    texture = made[name]
    document = written(texture, name, tmp_path)
    text = document.read_text()
    document.write_text(given(text, "contrast", "float", "1", str(CONTRAST)))
    read = shown(document, "basecolor", SIZES[0])
    wanted = expected(texture, "basecolor", SIZES[0], CONTRAST)
    assert np.abs(read - wanted).mean() < 1 / 255
    # Of six photos the lower left one, as v begins at the bottom.
    rows, columns = SIZES[0][0] // 3, SIZES[0][1] // 2
    document.write_text(text)
    one = shown(document, "basecolor", (rows, columns))
    document.write_text(given(text, "scale", "vector2", "1, 1", "2, 3"))
    read = shown(document, "basecolor", SIZES[0])
    np.testing.assert_allclose(read[-rows:, :columns], one, atol=1e-3)


@pytest.mark.parametrize("name", ["tiled_grey", "tiled_material"])
def test_tiles_have_no_borders_where_hosts_make_mipmaps(
    made: dict[str, texforge.NoiseTexture], name: str, tmp_path: Path
) -> None:
    texture = made[name]
    document = written(texture, name, tmp_path)
    width, height = texture.document["size"]
    # At the photo's own pixels only coordinates that jump lead to smaller copies.
    output = f"NG_{name}/basecolor_out"
    plain, filtered = (
        render_materialx(document, output, (height, width), mipmaps=mipmaps)
        for mipmaps in (False, True)
    )
    assert np.abs(filtered - plain).max() < 1e-3


def given(text: str, name: str, kind: str, value: str, other: str) -> str:
    """Return a document whose graph is given another value."""
    start = f'<input name="{name}" type="{kind}" value='
    assert f'{start}"{value}"' in text
    return text.replace(f'{start}"{value}"', f'{start}"{other}"')


def test_the_material_uses_the_maps(made: dict[str, texforge.NoiseTexture], tmp_path: Path) -> None:
    document = written(made["material"], "material", tmp_path)
    surface = ET.parse(document).getroot().find("standard_surface")  # noqa: S314 - our own file
    assert surface is not None
    inputs = {port.get("name"): port.get("output") for port in surface}
    assert inputs["base_color"] == "basecolor_out"
    assert inputs["specular_roughness"] == "roughness_out"
    assert "normal" in inputs


def test_the_same_texture_gives_the_same_bytes(made: dict[str, texforge.NoiseTexture]) -> None:
    for name in ("oriented", "tiled_grey"):
        texture = made[name]
        assert texture.export("materialx", name="a") == texture.export("materialx", name="a")
