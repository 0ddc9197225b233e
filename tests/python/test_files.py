"""Pictures and source maps as files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
import pytest
import texforge
from PIL import Image

from .conftest import QUICK, noise, source_map_of

if TYPE_CHECKING:
    from pathlib import Path

ROUND_TRIPS = [
    ("png", "uint8", None),
    ("png", "uint8", 3),
    ("png", "uint8", 4),
    ("png", "uint16", 3),
    ("tif", "uint16", 3),
    ("tif", "float32", 3),
    ("webp", "uint8", 3),
    ("exr", "float16", 3),
    ("exr", "float32", None),
]


@pytest.mark.parametrize(("suffix", "dtype", "channels"), ROUND_TRIPS)
def test_round_trip(tmp_path: Path, suffix: str, dtype: str, channels: int | None) -> None:
    image = noise(20, 30, channels).astype(dtype)
    if dtype == "uint16":
        image = image * 257 + 1
    encoding: texforge.Encoding = "linear" if image.dtype.kind == "f" else "srgb"
    path = tmp_path / f"ünïcode name.{suffix}"
    texforge.write_image(path, image, encoding=encoding)
    again = texforge.read_image(path)
    assert again.dtype == image.dtype
    assert again.encoding == encoding
    assert np.array_equal(again, image)


def test_data_keeps_its_bits(tmp_path: Path) -> None:
    height = np.arange(600, dtype=np.uint16).reshape(20, 30) * 100
    texforge.write_image(tmp_path / "height.png", height, kind="data")
    again = texforge.read_image(tmp_path / "height.png", kind="data")
    assert np.array_equal(again, height)
    assert again.encoding == "data"


def test_orientation_is_applied(tmp_path: Path) -> None:
    image = Image.fromarray(np.repeat(np.repeat(noise(2, 4), 16, axis=0), 16, axis=1))
    exif = image.getexif()
    exif[0x0112] = 6
    image.save(tmp_path / "turned.jpg", exif=exif, quality=95)
    assert texforge.read_image(tmp_path / "turned.jpg").shape == (64, 32, 3)


def test_a_tile_records_how_it_was_made(tmp_path: Path) -> None:
    tile = texforge.tile(noise(), seed=5, **QUICK)
    path = tmp_path / "tile.png"
    tile.save(path)
    with Image.open(path) as image:
        assert np.array_equal(np.asarray(image), tile.image)
        texts = [str(value) for value in image.info.values()]
    record = next(text for text in texts if '"seed":5' in text)
    assert '"verb":"tile"' in record
    assert '"size":"32x24"' in record
    again = tmp_path / "again.png"
    tile.save(again)
    assert again.read_bytes() == path.read_bytes()
    with pytest.raises(FileExistsError):
        tile.save(path)
    tile.save(path, overwrite=True)


def test_high_dynamic_range_survives(tmp_path: Path) -> None:
    light = noise().astype(np.float32) / 16
    texforge.write_image(tmp_path / "light.exr", light, encoding="linear")
    tile = texforge.tile(texforge.read_image(tmp_path / "light.exr"), **QUICK)
    assert tile.encoding == "linear"
    tile.save(tmp_path / "tile.exr")
    again = texforge.read_image(tmp_path / "tile.exr")
    assert again.max() > 4
    assert np.array_equal(again, tile.image)


def test_source_maps_are_kept(tmp_path: Path) -> None:
    tile = texforge.tile(noise(), **QUICK)
    path = tmp_path / "map.exr"
    tile.save_source_map(path)
    loaded = texforge.load_source_map(path)
    assert np.array_equal(loaded.positions, source_map_of(tile))
    assert loaded.source_size == (48, 64)
    height = np.random.default_rng(0).random((48, 64))
    assert np.array_equal(loaded.apply(height), tile.apply(height))
    with pytest.raises(FileExistsError):
        tile.save_source_map(path)
    tile.save_source_map(path, overwrite=True)


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float64"])
@pytest.mark.parametrize("channels", [None, 1, 2, 3, 4])
def test_notebooks_show_the_tile_two_by_two(dtype: str, channels: int | None) -> None:
    photo = noise(48, 64, channels)
    if channels in (2, 4):
        photo[..., -1] = 255
    scale = {"uint8": 1, "uint16": 257}.get(dtype, 1 / 255)
    png = texforge.tile((photo * np.float64(scale)).astype(dtype), **QUICK)._repr_png_()
    assert png is not None
    with Image.open(io.BytesIO(png)) as image:
        assert image.size == (64, 48)


def test_notebooks_are_spared_large_pictures_and_numbers() -> None:
    tile = texforge.tile(noise(100, 90), size=(600, 520), patch=5, quality="draft")
    png = tile._repr_png_()
    assert png is not None
    with Image.open(io.BytesIO(png)) as image:
        assert max(image.size) <= 1024
    assert texforge.tile(noise(channels=7), **QUICK)._repr_png_() is None
