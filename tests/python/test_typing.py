"""Uses of the package as a caller writes them; `mypy --strict` reads this, pytest runs it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, assert_type

import numpy as np
import numpy.typing as npt
import texforge
from PIL import Image
from tqdm import tqdm

if TYPE_CHECKING:
    from collections.abc import Callable


def test_a_tile_from_everything(tmp_path: Path) -> None:
    photo: npt.NDArray[np.uint8] = np.random.default_rng(0).integers(
        0, 256, (48, 64, 3), dtype=np.uint8
    )
    tile = texforge.tile(photo, size=(24, 32), patch=5, quality="draft", seed=1, threads=1)
    assert_type(tile, texforge.Tile)
    assert_type(tile.image, npt.NDArray[Any])
    assert_type(tile.source_map, npt.NDArray[np.int32] | None)
    assert_type(tile.costs.texture, float | None)
    assert_type(tile.apply(photo, kind="color"), npt.NDArray[Any])
    assert_type(tile.maps, dict[str, npt.NDArray[Any]])
    texforge.tile(Image.fromarray(photo), size=24, patch=5, mask=photo[..., 0] >= 0)
    texforge.tile(photo, size=24, patch=5, maps={"height": photo[..., 0]}, progress=print)
    with tqdm(total=1.0, disable=True) as bar:
        texforge.tile(photo, size=24, patch=5, progress=bar)
    assert_type(texforge.tile_variants(photo, 2, size=24, patch=5), list[texforge.Tile])
    assert_type(texforge.tile(photo, redo=(0, 0, 8, 8), redo_of=tile, patch=5), texforge.Tile)
    tile.save(tmp_path / "tile.png")
    tile.save_source_map(str(tmp_path / "map.exr"))
    assert_type(texforge.read_image(tmp_path / "tile.png"), texforge.Image)
    loaded = texforge.load_source_map(tmp_path / "map.exr")
    assert_type(loaded, texforge.SourceMap)
    assert_type(texforge.apply(loaded, photo), npt.NDArray[Any])


def test_a_near_regular_texture(tmp_path: Path) -> None:
    y, x = np.mgrid[:64, :80]
    photo = np.where((y % 16 < 3) | (x % 20 < 3), 200, 90).astype(np.uint8)
    found = texforge.detect_lattice(photo)
    for lattice in (found, ((20, 0), (0, 16.0))):
        texture = texforge.regular(photo, size=(32, 40), lattice=lattice, tileable="both")
        assert_type(texture, texforge.Regular)
        assert_type(texture.source_map, npt.NDArray[np.int32])
        assert_type(texture.apply(photo), npt.NDArray[Any])
        assert_type(texforge.apply(texture, photo), npt.NDArray[Any])
    texforge.regular(photo, lattice="none", seam="cut", maps={"height": photo}, straighten="off")
    texforge.regular(photo, lattice=((20, 0), (0, 16)), subpixel="on")
    file = texforge.regular_to_file(photo, tmp_path / "a.png", lattice="none", size=(32, 40))
    assert_type(file, texforge.RegularFile)
    assert_type(file.maps, dict[str, Path])


def test_a_procedural_texture(tmp_path: Path) -> None:
    photo = np.random.default_rng(0).integers(0, 256, (32, 40, 3), dtype=np.uint8)
    texture = texforge.fit_noise(photo, bands="square", maps={"height": photo[..., 0]})
    assert_type(texture, texforge.NoiseTexture)
    assert_type(texture.at([[1, 2]]), npt.NDArray[np.float32])
    assert_type(
        texture.at(np.zeros((4, 3), np.float32), normals=(0, 0, 1)), npt.NDArray[np.float32]
    )
    assert_type(texture.render(16), texforge.Image)
    assert_type(texture.render((16, 8), dtype="float32", map="height"), texforge.Image)
    assert_type(texture.render_maps(16, tileable=True), dict[str, texforge.Image])
    assert_type(texture.solid((1, 2, 3)), npt.NDArray[np.float32])
    assert_type(texture.channels, dict[str, slice])
    assert_type(texture.size, tuple[int, int])
    texture.save(tmp_path / "texture.json")
    assert_type(texforge.NoiseTexture.load(tmp_path / "texture.json"), texforge.NoiseTexture)
    assert_type(texture.export("glsl"), dict[str, bytes])
    assert_type(texture.export_to(tmp_path, "osl", name="sand"), list[Path])
    edited = texture.edit(contrast=0.5, gains=[0, 1.5], means={"height": 0.5}, seed=3)
    assert_type(edited.morph(texture, 0.25), texforge.NoiseTexture)


def test_wrong_words_are_type_errors(photo: npt.NDArray[np.uint8]) -> None:
    # mypy complains about an ignore that is not needed: each line proves that it objects.
    wrong: list[texforge.TexforgeError] = []
    calls: tuple[Callable[[], object], ...] = (
        lambda: texforge.tile(photo, axis="z"),  # type: ignore[arg-type]
        lambda: texforge.tile(photo, quality="fast"),  # type: ignore[arg-type]
        lambda: texforge.tile(photo, size="64"),  # type: ignore[arg-type]
        lambda: texforge.tile(photo, progress=3),  # type: ignore[arg-type]
        lambda: texforge.regular_to_file(photo, "a.png", seam="glue"),  # type: ignore[arg-type]
        lambda: texforge.fit_noise(photo, bands="hexagonal"),  # type: ignore[arg-type]
        lambda: texforge.fit_noise(photo).render(8, dtype="int8"),  # type: ignore[arg-type]
    )
    for call in calls:
        try:
            call()
        except texforge.ParameterError as error:
            wrong.append(error)
    assert len(wrong) == 7
