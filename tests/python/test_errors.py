"""Every kind of error: its class, its builtin, one sentence; nothing is written."""

from __future__ import annotations

import errno
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge
from texforge import _errors, _texforge

from .conftest import QUICK, noise

CLASSES: dict[str, tuple[type[texforge.TexforgeError], type[Exception]]] = {
    "parameter": (texforge.ParameterError, ValueError),
    "too_small": (texforge.PictureError, ValueError),
    "empty_mask": (texforge.PictureError, ValueError),
    "not_finite": (texforge.PictureError, ValueError),
    "size_mismatch": (texforge.PictureError, ValueError),
    "bad_picture": (texforge.PictureError, ValueError),
    "no_structure": (texforge.NoStructureError, ValueError),
    "document": (texforge.DocumentError, ValueError),
    "memory": (texforge.OutOfMemory, MemoryError),
    "decode": (texforge.ReadError, OSError),
    "format": (texforge.FormatError, OSError),
    "io": (texforge.MissingFileError, FileNotFoundError),
    "exists": (texforge.OutputExistsError, FileExistsError),
    "same_file": (texforge.SameFileError, OSError),
    "cancelled": (texforge.Cancelled, Exception),
    "internal": (texforge.InternalError, RuntimeError),
}


def test_every_kind_is_tested() -> None:
    assert set(_texforge.error_kinds()) == set(CLASSES)


@pytest.mark.parametrize("kind", CLASSES)
def test_every_kind_crosses_the_doorway(kind: str) -> None:
    cls, builtin = CLASSES[kind]
    with pytest.raises(cls) as caught:
        _texforge.fail(kind)
    error = caught.value
    assert type(error) is cls
    assert isinstance(error, builtin)
    assert error.kind == kind
    assert str(error) == error.message
    assert "\n" not in error.message
    if isinstance(error, OSError):
        assert error.filename == "example.png"


def test_errors_can_be_pickled() -> None:
    with pytest.raises(texforge.MissingFileError) as caught:
        texforge.read_image("nowhere.png")
    again = pickle.loads(pickle.dumps(caught.value))  # noqa: S301 (our own)
    assert type(again) is type(caught.value)
    assert (again.kind, str(again), again.errno, again.filename) == (
        "io",
        str(caught.value),
        2,
        "nowhere.png",
    )


PARAMETERS: dict[str, dict[str, Any]] = {
    "patch": {"patch": 99},
    "an even patch": {"patch": 4},
    "no integer": {"patch": 5.5},
    "sigma": {"sigma": 0.0},
    "sigma nan": {"sigma": float("nan")},
    "sigma infinite": {"sigma": float("inf")},
    "sigma text": {"sigma": "wide"},
    "uniformity": {"uniformity": -1},
    "rarity": {"rarity": 5},
    "band": {"band": 3},
    "method": {"method": "magic"},
    "measure": {"measure": 3},
    "order zero": {"measure": "moments", "order": 0},
    "order five": {"measure": "moments", "order": 5},
    "order of nothing": {"order": 3},
    "axis": {"axis": "z"},
    "quality": {"quality": None},
    "size zero": {"size": 0},
    "size negative": {"size": (-3, 5)},
    "size of three": {"size": (1, 2, 3)},
    "size text": {"size": "64x64"},
    "size float": {"size": 64.0},
    "avoid_grow without avoid": {"avoid_grow": 3},
    "avoid_grow negative": {"avoid": noise(), "avoid_grow": -1},
    "avoid_grow too much": {"avoid": noise(), "avoid_grow": 10001},
    "flatten": {"flatten": 1.5},
    "flatten too little": {"flatten": 0.001},
    "flatten of data": {"flatten": 0.2, "encoding": "data"},
    "symmetry": {"symmetry": "some"},
    "seed negative": {"seed": -1},
    "seed too large": {"seed": 2**64},
    "seed bool": {"seed": True},
    "threads negative": {"threads": -1},
    "threads too many": {"threads": 1025},
    "encoding": {"encoding": "gamma"},
    "progress": {"progress": 3},
    "order as text": {"measure": "moments", "order": "2"},
    "redo of nothing": {"redo": (0, 0, 4, 4)},
    "nothing of a tile redone": {"redo_of": np.zeros((24, 32, 2), int)},
    "redo of three": {"redo": (0, 0, 4), "redo_of": np.zeros((24, 32, 2), int)},
    "redo outside": {"redo": (24, 0, 4, 4), "redo_of": np.zeros((24, 32, 2), int)},
    "redo of no pixel": {"redo": (0, 0, 0, 4), "redo_of": np.zeros((24, 32, 2), int)},
    "redo of all": {"redo": (0, 0, 24, 32), "redo_of": np.zeros((24, 32, 2), int)},
    "map's name": {"maps": {3: noise()}},
    "maps with nothing to follow": {
        "maps": {"height": noise()},
        "method": "make-seamless",
    },
}


@pytest.mark.parametrize("case", PARAMETERS)
def test_bad_arguments(photo: npt.NDArray[np.uint8], case: str) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        texforge.tile(photo, **{**QUICK, **PARAMETERS[case]})
    assert caught.value.kind == "parameter"
    assert caught.value.fields["name"]
    assert "\n" not in str(caught.value)


def test_a_size_that_overflows_or_exceeds_memory_is_refused_at_once(
    photo: npt.NDArray[np.uint8],
) -> None:
    for size in (2**63, (2**62, 2**62), 60000):
        with pytest.raises((texforge.OutOfMemory, texforge.ParameterError, texforge.PictureError)):
            texforge.tile(photo, size=size, patch=5)


def test_too_small() -> None:
    for photo in (noise(1, 1), noise(4, 100), noise(100, 4)):
        with pytest.raises(texforge.PictureError) as caught:
            texforge.tile(photo, size=32)
        assert caught.value.kind == "too_small"


def test_empty_mask(photo: npt.NDArray[np.uint8]) -> None:
    single = np.zeros(photo.shape[:2], bool)
    single[3, 4] = True
    for mask in (np.zeros(photo.shape[:2], bool), single):
        with pytest.raises(texforge.PictureError) as caught:
            texforge.tile(photo, mask=mask, **QUICK)
        assert caught.value.kind == "empty_mask"


def test_size_mismatch(photo: npt.NDArray[np.uint8]) -> None:
    with pytest.raises(texforge.PictureError) as caught:
        texforge.tile(photo, mask=np.ones((64, 48), bool), **QUICK)
    assert caught.value.kind == "size_mismatch"
    assert caught.value.fields["expected"] == (48, 64)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", ["float16", "float32", "float64"])
def test_not_finite(dtype: str, value: float) -> None:
    photo = (noise() / 255).astype(dtype)
    photo[7, 9, 1] = value
    with pytest.raises(texforge.PictureError) as caught:
        texforge.tile(photo, **QUICK)
    assert caught.value.kind == "not_finite"
    assert caught.value.fields["first"] == (7, 9)
    mask = np.ones(photo.shape[:2])
    mask[0, 0] = np.nan
    with pytest.raises(texforge.PictureError, match="mask"):
        texforge.tile(noise(), mask=mask, **QUICK)


def test_a_source_map_that_points_outside(photo: npt.NDArray[np.uint8]) -> None:
    for positions in ([[[48, 0]]], [[[0, 64]]], [[[-1, 0]]], [[[2**31, 0]]]):
        with pytest.raises(texforge.PictureError) as caught:
            texforge.apply(positions, photo)
        assert caught.value.kind == "bad_picture"
    for what in (np.zeros((4, 4)), np.zeros((4, 4, 2)), np.zeros((4, 4, 3), int), "map.exr"):
        with pytest.raises(texforge.PictureError, match="height x width x 2"):
            texforge.apply(what, photo)
    with pytest.raises(texforge.ParameterError, match="kind"):
        texforge.apply([[[0, 0]]], photo, kind="height")  # type: ignore[arg-type]
    with pytest.raises(texforge.ParameterError, match="source_size"):
        texforge.apply([[[0, 0]]], photo, source_size=(0, 3))


def test_reading(tmp_path: Path) -> None:
    broken = tmp_path / "broken.png"
    texforge.write_image(broken, noise())
    broken.write_bytes(broken.read_bytes()[:200])
    with pytest.raises(texforge.ReadError) as caught:
        texforge.read_image(broken)
    assert caught.value.kind == "decode"
    assert str(broken) in str(caught.value)
    text = tmp_path / "text.png"
    text.write_text("no picture")
    with pytest.raises(texforge.FileError):
        texforge.read_image(text)
    with pytest.raises(FileNotFoundError):
        texforge.load_source_map(tmp_path / "nowhere.exr")
    with pytest.raises(texforge.ReadError):
        texforge.load_source_map(broken)
    with pytest.raises(texforge.ParameterError):
        texforge.read_image(3)  # type: ignore[arg-type]
    with pytest.raises(texforge.FileError):
        texforge.read_image(tmp_path)


@pytest.mark.parametrize(
    ("number", "builtin"),
    [
        (errno.EACCES, PermissionError),
        (errno.EROFS, PermissionError),
        (errno.ENOENT, FileNotFoundError),
        (errno.EEXIST, FileExistsError),
        (errno.EIO, OSError),
        (None, OSError),
    ],
)
def test_what_the_system_refuses_is_the_builtin_error(
    number: int | None, builtin: type[OSError]
) -> None:
    error = _errors.from_core("io", "cannot", {"errno": number, "path": Path("a.png")})
    assert issubclass(type(error), builtin)
    assert isinstance(error, texforge.FileError)
    assert (error.kind, error.errno, error.filename) == ("io", number, "a.png")


def test_writing(tmp_path: Path) -> None:
    path = tmp_path / "tile.png"
    texforge.write_image(path, noise())
    before = path.read_bytes()
    with pytest.raises(FileExistsError) as caught:
        texforge.write_image(path, noise(seed=1))
    assert isinstance(caught.value, texforge.OutputExistsError)
    assert caught.value.kind == "exists"
    with pytest.raises(texforge.FormatError):
        texforge.write_image(tmp_path / "tile.xyz", noise())
    with pytest.raises(texforge.FormatError):
        texforge.write_image(tmp_path / "tile.jpg", noise().astype(np.uint16))
    with pytest.raises(texforge.FileError):
        texforge.write_image(tmp_path / "nowhere" / "tile.png", noise())
    assert [p.name for p in tmp_path.iterdir()] == ["tile.png"]
    assert path.read_bytes() == before
    texforge.write_image(path, noise(seed=1), overwrite=True)
    assert path.read_bytes() != before


def test_a_blended_tile_has_no_source_map(photo: npt.NDArray[np.uint8], tmp_path: Path) -> None:
    tile = texforge.tile(photo, method="make-seamless", **QUICK)
    with pytest.raises(texforge.ParameterError, match="make-seamless"):
        tile.apply(photo)
    with pytest.raises(texforge.ParameterError, match="make-seamless"):
        tile.save_source_map(tmp_path / "map.exr")
