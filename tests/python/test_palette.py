"""The even dial: `stationarity` and the palette."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge

from .conftest import QUICK, noise
from .test_quality import STAINS, reduced

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def stained() -> npt.NDArray[np.uint8]:
    """Return noise with stains of several sizes."""
    photo = noise(96, 128) // 2 + 100
    photo[10:40, 20:60] -= 80
    photo[60:70, 80:90] -= 60
    photo[80:84, 10:14] -= 100
    return photo


def test_a_palette_goes_from_hardly_to_wholly(stained: npt.NDArray[np.uint8]) -> None:
    palette = texforge.palette(stained, 4, **QUICK)
    assert palette.stationarities == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0])
    assert palette.sigmas == sorted(palette.sigmas, reverse=True)
    assert (palette.sigmas[0], palette.sigmas[-1]) == (0.5, 0.02)
    assert len(set(palette.sigmas)) == len(palette.tiles) == 4
    assert len(palette.differences) == 3
    assert min(palette.differences) > 0
    tried, changes = zip(*palette.curve, strict=True)
    assert list(tried) == sorted(tried, reverse=True)
    assert list(changes) == sorted(changes)
    assert changes[0] == 0
    # Each repeated two by two, side by side.
    height, width, channels = palette.picture.shape
    assert channels == 3
    assert height > 2 * 24
    assert width > 4 * 2 * 32
    first = palette.tiles[0].tiled(2, 2)
    assert any(
        np.array_equal(palette.picture[y : y + 48, x : x + 64], first)
        for y in range(height - 48)
        for x in range(40)
    )


def test_a_place_on_the_dial_is_that_of_the_palette(stained: npt.NDArray[np.uint8]) -> None:
    palette = texforge.palette(stained, 3, seed=7, **QUICK)
    for place, expected in zip(palette.stationarities, palette.tiles, strict=True):
        for threads in (1, 2, 5):
            made = texforge.tile(stained, stationarity=place, seed=7, threads=threads, **QUICK)
            assert made.image.tobytes() == expected.image.tobytes()
            assert made.params == expected.params
            assert made.report["stationarity"] == place
        again = texforge.tile(stained, seed=7, **expected.params)
        assert again.image.tobytes() == expected.image.tobytes()


def test_the_dial_is_the_photos_and_not_the_seeds(stained: npt.NDArray[np.uint8]) -> None:
    one, other = (
        texforge.tile_variants(stained, 2, stationarity=0.4, seed=s, **QUICK) for s in (0, 9)
    )
    assert len({tile.params["sigma"] for tile in [*one, *other]}) == 1
    assert one[0].image.tobytes() != one[1].image.tobytes()
    flat = noise(96, 128, seed=3)
    assert texforge.tile(flat, stationarity=0.4, **QUICK).params["sigma"] != one[0].params["sigma"]


def test_it_is_saved_as_pictures(stained: npt.NDArray[np.uint8], tmp_path: Path) -> None:
    palette = texforge.palette(stained, 2, **QUICK)
    files = palette.save(tmp_path / "wall.png")
    assert [file.name for file in files] == ["wall-1.png", "wall-2.png", "wall.palette.png"]
    assert np.array_equal(texforge.read_image(files[1]), palette.tiles[1].image)
    assert np.array_equal(texforge.read_image(files[2]), palette.picture)
    with pytest.raises(texforge.OutputExistsError):
        palette.save(tmp_path / "wall.png")
    assert palette._repr_png_().startswith(b"\x89PNG")
    assert "0.5" in repr(palette)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"stationarity": 1.5}, "0 to 1"),
        ({"stationarity": math.nan}, "0 to 1"),
        ({"stationarity": "much"}, "a number"),
        ({"stationarity": 0.5, "sigma": 0.2}, "with `sigma`"),
        ({"stationarity": 0.5, "sigma_map": np.full((24, 32), 0.1)}, "sigma map"),
        ({"stationarity": 0.5, "method": "wrap-only"}, "method"),
        ({"stationarity": 0.5, "measure": "none"}, "measure"),
    ],
)
def test_a_dial_that_turns_nothing_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(texforge.ParameterError, match="`stationarity`") as error:
        texforge.tile(noise(), **{**QUICK, **options})
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("steps", "options", "name"),
    [
        (1, {}, "steps"),
        (101, {}, "steps"),
        (3, {"sigma": 0.2}, "sigma"),
        (3, {"stationarity": 0.2}, "stationarity"),
        (3, {"sigma_map": np.full((24, 32), 0.1)}, "stationarity"),
        (3, {"method": "make-seamless"}, "stationarity"),
    ],
)
def test_a_palette_of_nothing_is_refused(steps: int, options: Any, name: str) -> None:
    with pytest.raises(texforge.ParameterError, match=f"`{name}`"):
        texforge.palette(noise(), steps, **{**QUICK, **options})


def test_a_palette_can_be_stopped() -> None:
    seen: list[float] = []

    def stop(fraction: float) -> bool:
        seen.append(fraction)
        return False

    with pytest.raises(texforge.Cancelled):
        texforge.palette(noise(), 2, progress=stop, **QUICK)
    assert seen


@pytest.mark.skipif(not STAINS.is_dir(), reason="needs the photographs in ../shared/exemplars")
def test_the_steps_look_even() -> None:
    """On real photographs, equal steps of the dial differ alike; even factors of sigma do not.

    The spread is the standard deviation of the steps' differences over their mean. A single step
    is left to chance: the look of one tile of one seed is measured.
    """

    def spread(differences: npt.NDArray[np.float64]) -> float:
        return float(np.std(differences) / np.mean(differences))

    dial, factors = [], []
    for path in sorted(STAINS.iterdir()):
        if path.suffix.lower() not in {".png", ".jpg"}:
            continue
        photo = reduced(texforge.read_image(path))
        palette = texforge.palette(photo, 5, size=256)
        dial.append(spread(np.array(palette.differences)))
        sigmas, changes = np.array(palette.curve).T
        even = np.geomspace(sigmas[0], sigmas[-1], 5)
        factors.append(spread(np.diff(np.interp(-np.log(even), -np.log(sigmas), changes))))
    print("spread, median:", statistics.median(dial), "even factors:", statistics.median(factors))
    assert len(dial) >= 10
    assert statistics.median(dial) <= 0.4, dial
    assert max(dial) <= 0.9, dial
    assert statistics.median(dial) < statistics.median(factors), factors
