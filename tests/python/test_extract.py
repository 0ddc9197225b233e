"""The representative tile through Python. The search is compared with its definition in Rust."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import hypothesis
import numpy as np
import numpy.typing as npt
import pytest
import texforge
from hypothesis import strategies as st

from .conftest import noise

if TYPE_CHECKING:
    from pathlib import Path


def cloth(
    height: int = 20, width: int = 28, times: tuple[int, int] = (5, 5), seed: int = 0
) -> npt.NDArray[np.uint8]:
    """Return a picture that repeats, with a little noise."""
    rng = np.random.default_rng(seed)
    whole = np.tile(rng.integers(0, 200, (height, width, 3)), (*times, 1))
    return (whole + rng.integers(0, 30, whole.shape)).astype(np.uint8)


def test_a_tile_is_a_piece_of_the_photo() -> None:
    photo = cloth()
    found = texforge.extract(photo, count=3)
    assert found.confidence is not None
    assert found.confidence > 0.5
    assert np.array(found.period) == pytest.approx(np.array([[20, 0], [0, 28]]), abs=0.1)
    assert len(found.tiles) == 3
    given = texforge.extract(photo, period=(20, 28), count=3)
    assert (given.found_by, given.confidence, given.scale) == ("given", None, (1.0, 1.0))
    for tile in given.tiles:
        y, x = tile.place
        assert np.array_equal(tile.image, photo[y : y + 20, x : x + 28])
        assert tile.photo_place == pytest.approx((y, x))
        assert tile.source_map is not None
        rows, columns = tile.source_map[..., 0], tile.source_map[..., 1]
        assert np.array_equal(tile.image, photo[rows, columns])
        tiling = tile.tiling()
        assert tiling.shape == photo.shape
        assert np.array_equal(tiling[y : y + 20, x : x + 28], tile.image)
        assert np.array_equal(tiling[:80], tiling[20:])
        assert tile.score == pytest.approx(given.alpha * tile.continuity + tile.resemblance)
        png = tile._repr_png_()
        assert png is not None
        assert png.startswith(b"\x89PNG")
    assert [t.score for t in given.tiles] == sorted(t.score for t in given.tiles)
    assert given._repr_png_().startswith(b"\x89PNG")
    assert repr(given).startswith("Extraction(3 tiles, period 20.00 x 28.00)")
    assert repr(given.tiles[0]).startswith("ExtractedTile(20 x 28 at ")


@hypothesis.given(
    dtype=st.sampled_from(["uint8", "uint16", "float16", "float32", "float64"]),
    channels=st.sampled_from([None, 1, 2, 3, 4, 5]),
    period=st.tuples(st.floats(4, 12), st.floats(4, 12)),
    scale=st.sampled_from(["down", "off"]),
    seed=st.integers(0, 2**16),
)
def test_what_comes_out_is_what_went_in(
    dtype: str, channels: int | None, period: tuple[float, float], scale: Any, seed: int
) -> None:
    shape = (30, 34) if channels is None else (30, 34, channels)
    unit = np.random.default_rng(seed).random(shape)
    photo = (unit * (np.iinfo(dtype).max if dtype[0] == "u" else 1)).astype(dtype)
    if channels in (2, 4):
        photo[..., -1] = photo.dtype.type(np.iinfo(dtype).max if dtype[0] == "u" else 1)
    found = texforge.extract(photo, period=period, scale=scale, count=2)
    again = texforge.extract(photo, period=period, scale=scale, count=2, threads=1)
    for tile, same in zip(found.tiles, again.tiles, strict=True):
        assert tile.image.dtype == photo.dtype
        assert tile.image.ndim == photo.ndim
        assert tile.image.shape[2:] == photo.shape[2:]
        assert tile.image.tobytes() == same.image.tobytes()
        assert np.isfinite(tile.image.astype(np.float64)).all()
        assert (tile.source_map is not None) == (found.scale == (1.0, 1.0))


def test_maps_are_cut_at_the_same_place() -> None:
    photo = cloth()
    height = np.random.default_rng(1).integers(0, 65536, photo.shape[:2], dtype=np.uint16)
    cases: list[dict[str, Any]] = [
        {"period": (20, 28)},
        {"period": (20.4, 28.6), "scale": "off"},
    ]
    for options in cases:
        (tile,) = texforge.extract(photo, count=1, maps={"height": height}, **options).tiles
        assert tile.source_map is not None
        rows, columns = tile.source_map[..., 0], tile.source_map[..., 1]
        assert np.array_equal(tile.maps["height"], height[rows, columns])
    # Scaled, the photo's own green is where the photo's green is.
    data = photo[..., 1].astype(np.float32)
    (tile,) = texforge.extract(
        data, period=(20.7, 28.6), count=1, maps={"height": data}, encoding="data"
    ).tiles
    assert tile.source_map is None
    assert np.array_equal(tile.maps["height"], tile.image)


def test_a_mask_keeps_what_it_hides_out_of_tile_and_comparison() -> None:
    photo = cloth()
    mask = np.ones(photo.shape[:2], bool)
    mask[30:50, 40:70] = False
    spoilt = photo.copy()
    spoilt[~mask] = noise(*photo.shape[:2])[~mask]
    clean, dirty = (
        texforge.extract(p, period=(20, 28), mask=mask, count=2) for p in (photo, spoilt)
    )
    for a, b in zip(clean.tiles, dirty.tiles, strict=True):
        assert (a.place, a.score) == (b.place, b.score)
        y, x = a.place
        assert mask[y : y + 20, x : x + 28].all()


def test_a_band_is_made_of_the_photos_other_periods() -> None:
    photo = cloth(40, 48, (4, 4))
    plain, banded = (
        texforge.extract(photo, period=(40, 48), count=1, band=band).tiles[0] for band in (0, 6)
    )
    assert np.array_equal(plain.image[6:-6, 6:-6], banded.image[6:-6, 6:-6])
    assert not np.array_equal(plain.image, banded.image)
    assert banded.source_map is not None
    rows, columns = banded.source_map[..., 0], banded.source_map[..., 1]
    assert np.array_equal(banded.image, photo[rows, columns])


def test_files_are_those_of_the_command_line(tmp_path: Path) -> None:
    found = texforge.extract(cloth(), count=2, maps={"height": cloth()[..., 0]})
    files = found.save(tmp_path / "out")
    names = ["tile_01.png", "tile_01_height.png", "tiling_01.png"]
    names += ["tile_02.png", "tile_02_height.png", "tiling_02.png", "sheet.png"]
    assert [file.name for file in files] == names
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted(names)
    assert np.array_equal(texforge.read_image(files[0]), found.tiles[0].image)
    with pytest.raises(texforge.OutputExistsError):
        found.save(tmp_path / "out")
    found.save(tmp_path / "out", overwrite=True)


def test_saved_files_are_the_command_lines_to_the_byte(tmp_path: Path) -> None:
    texforge.write_image(tmp_path / "cloth.png", cloth())
    options: dict[str, Any] = {"count": 2, "period": (20.3, 28), "similarity": "absolute"}
    found = texforge.extract(texforge.read_image(tmp_path / "cloth.png"), **options)
    files = found.save(tmp_path / "saved")
    command = [sys.executable, "-m", "texforge", "extract", "cloth.png", "-o", "run", "--count=2"]
    command += ["--period=28x20.3", "--similarity=absolute"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert contents(tmp_path / "saved") == contents(tmp_path / "run")
    record = json.loads(found.tiles[1].record)
    assert (record["verb"], record["params"]["similarity"]) == ("extract", "absolute")
    assert found.tiles[1].record.encode() in files[2].read_bytes()


def contents(folder: Path) -> dict[str, bytes | None]:
    """Return the bytes of every file; None for a folder."""
    return {p.name: None if p.is_dir() else p.read_bytes() for p in folder.iterdir()}


def test_all_files_are_saved_or_none(tmp_path: Path) -> None:
    photo = cloth()
    found = texforge.extract(photo, count=2, maps={"height": photo[..., 0]})
    # A file that is there is the last but two.
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "tile_02_height.png").write_bytes(b"old")
    with pytest.raises(texforge.OutputExistsError, match="tile_02_height"):
        found.save(folder)
    assert contents(folder) == {"tile_02_height.png": b"old"}
    # A place that cannot be written to.
    (folder / "tiling_02.png").mkdir()
    with pytest.raises(texforge.FileError, match="tiling_02"):
        found.save(folder, overwrite=True)
    assert contents(folder) == {"tile_02_height.png": b"old", "tiling_02.png": None}
    # A picture that the format cannot hold, found while the files are written.
    (folder / "tiling_02.png").rmdir()
    wide = np.zeros((*photo.shape[:2], 5), np.uint8)
    odd = texforge.extract(photo, count=2, maps={"height": wide})
    with pytest.raises(texforge.FormatError, match="tile_01_height"):
        odd.save(folder, overwrite=True)
    assert contents(folder) == {"tile_02_height.png": b"old"}
    # A folder that was made for nothing goes away.
    with pytest.raises(texforge.FormatError):
        odd.save(tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert len(found.save(folder, overwrite=True)) == len(contents(folder)) == 7
    assert texforge.read_image(folder / "tile_02_height.png").shape == (20, 28)


def test_folders_that_cannot_be_made(tmp_path: Path) -> None:
    found = texforge.extract(cloth(), count=1)
    (tmp_path / "file").write_bytes(b"old")
    for name, kind in {
        "file": texforge.OutputExistsError,
        "file/out": texforge.FileError,
        "no/out": texforge.MissingFileError,
    }.items():
        with pytest.raises(kind, match=name):
            found.save(tmp_path / name)
    assert contents(tmp_path) == {"file": b"old"}


BAD: dict[str, dict[str, Any]] = {
    "a period of one number": {"period": 20},
    "a period of three": {"period": (1, 2, 3)},
    "a period of text": {"period": ("a", "b")},
    "an unknown word": {"period": "fast"},
    "a period of nothing": {"period": (0, 20)},
    "a negative period": {"period": (20, -3)},
    "a period of nan": {"period": (20, float("nan"))},
    "an endless period": {"period": (20, float("inf"))},
    "longer than half the photo": {"period": (51, 20)},
    "no tile": {"count": 0},
    "too many tiles": {"count": 101},
    "no period": {"periods": 0},
    "more periods than there are": {"period": (20, 28), "periods": 6},
    "alpha negative": {"alpha": -1},
    "alpha infinite": {"alpha": float("inf")},
    "beta": {"beta": -1},
    "keep": {"keep": 1.5},
    "overlap": {"overlap": float("nan")},
    "min_confidence": {"min_confidence": 2},
    "flatten": {"flatten": 0.001},
    "scale": {"scale": "up"},
    "similarity": {"similarity": "median"},
    "a band that is thinner than a patch": {"period": (20, 28), "band": 4},
    "a band that leaves no middle": {"period": (20, 28), "band": 10},
    "seed": {"seed": -1},
    "threads": {"threads": 1025},
    "maps": {"maps": {3: noise()}},
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arguments(case: str) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        texforge.extract(cloth(), **BAD[case])
    assert "\n" not in str(caught.value)


def test_what_does_not_repeat_is_refused() -> None:
    ways: list[Any] = ["auto", "ssd", "lattice"]
    for period in ways:
        with pytest.raises(texforge.NoStructureError, match="no clear period") as caught:
            texforge.extract(noise(96, 128), period=period)
        assert caught.value.kind == "no_structure"
        assert isinstance(caught.value, ValueError)
        assert caught.value.fields["confidence"] < caught.value.fields["least"] == 0.5


@pytest.mark.parametrize(
    ("photo", "kind"),
    [
        (np.full((64, 64, 3), 7, np.uint8), "bad_picture"),
        (noise(8, 100), "too_small"),
        (noise(1, 1), "too_small"),
        (np.full((64, 64), np.nan), "not_finite"),
        (np.zeros((64, 64, 4), np.uint8), "bad_picture"),
    ],
)
def test_photos_that_cannot_be_used(photo: npt.NDArray[Any], kind: str) -> None:
    with pytest.raises(texforge.PictureError) as caught:
        texforge.extract(photo)
    assert caught.value.kind == kind
    assert "\n" not in str(caught.value)


def test_masks_and_maps_that_do_not_fit() -> None:
    photo = cloth()
    with pytest.raises(texforge.PictureError, match="mask") as caught:
        texforge.extract(photo, mask=np.ones((3, 4), bool))
    assert caught.value.kind == "size_mismatch"
    holes = np.ones(photo.shape[:2], bool)
    holes[::10, ::10] = False
    with pytest.raises(texforge.PictureError, match="no piece of 28x20"):
        texforge.extract(photo, period=(20, 28), mask=holes)
    with pytest.raises(texforge.PictureError, match="height"):
        texforge.extract(photo, maps={"height": noise(10, 100)})


def test_progress_can_cancel() -> None:
    with pytest.raises(texforge.Cancelled):
        texforge.extract(cloth(60, 60, (8, 8)), progress=lambda _: False)
