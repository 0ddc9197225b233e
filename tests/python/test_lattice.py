"""Lattices through Python, and on photographs if they are here. The finder is tested in Rust."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge

from .conftest import noise

ROOT = Path(__file__).parents[2]
EXEMPLARS = ROOT.parent / "shared" / "exemplars"


@pytest.fixture(scope="module")
def wall() -> npt.NDArray[np.uint8]:
    """Return bricks of 32 x 20 pixels in running bond, with grain."""
    y, x = np.mgrid[:160, :200]
    mortar = (y % 20 < 3) | ((x + y // 20 * 16) % 32 < 3)
    grain = np.random.default_rng(0).normal(0, 20, (160, 200, 3))
    grey = np.where(mortar, 200, 90)[..., None] + grain
    return np.clip(grey, 0, 255).astype(np.uint8)


def is_that_of_the_wall(lattice: texforge.Lattice) -> bool:
    whole = np.array([lattice.v1, lattice.v2]) @ np.linalg.inv([[32, 0], [16, 20]])
    return bool(
        np.abs(whole - np.rint(whole)).max() < 0.02
        and abs(abs(np.linalg.det(np.rint(whole))) - 1) < 0.5
    )


def test_a_lattice_is_found_drawn_and_snapped(wall: npt.NDArray[np.uint8]) -> None:
    lattice = texforge.detect_lattice(wall)
    assert lattice.found
    assert 0.5 <= lattice.confidence <= 1
    assert is_that_of_the_wall(lattice)
    assert lattice.autocorrelation is None
    drawn = lattice.overlay()
    assert drawn.shape == wall.shape
    assert drawn.dtype == np.uint8
    assert not np.array_equal(drawn, wall)
    assert np.array_equal(drawn, lattice.overlay(wall))
    assert lattice._repr_png_().startswith(b"\x89PNG")
    assert repr(lattice).startswith("Lattice((")
    snap = lattice.snap((82, 65))
    assert snap is not None
    assert snap.size == (82, 65)
    assert snap.scale == pytest.approx((82 / 80, 65 / 64), abs=0.01)
    displaced = np.array(snap.periods) @ np.array([lattice.v1, lattice.v2])
    assert displaced == pytest.approx(np.array([[0, 80], [64, 0]]), abs=1)
    assert lattice.snap(4) is None


def test_the_map_is_handed_out_on_request(wall: npt.NDArray[np.uint8]) -> None:
    lattice = texforge.detect_lattice(wall[..., 0], autocorrelation=True)
    gamma = lattice.autocorrelation
    assert gamma is not None
    assert gamma.shape == (319, 399)
    assert gamma.dtype == np.float32
    assert lattice.autocorrelation_scale == (1.0, 1.0)
    assert gamma[159, 199] == pytest.approx(1)
    assert gamma[159 + 20, 199 + 16] > 0.5
    assert np.array_equal(gamma, gamma[::-1, ::-1])


def test_what_has_none_is_no_error() -> None:
    lattice = texforge.detect_lattice(noise(96, 128))
    assert not lattice.found
    assert lattice.confidence < 0.5
    assert "not found" in repr(lattice)


def test_threads_progress_and_cancelling(wall: npt.NDArray[np.uint8]) -> None:
    shares: list[float] = []
    one = texforge.detect_lattice(wall, threads=1, progress=shares.append)
    two = texforge.detect_lattice(wall, threads=2)
    assert (one.v1, one.v2, one.confidence) == (two.v1, two.v2, two.confidence)
    assert (shares[0], shares[-1]) == (0, 1)
    with pytest.raises(texforge.Cancelled):
        texforge.detect_lattice(wall, progress=lambda _: False)


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.full((64, 64), 7, np.uint8), "alike"),
        (np.zeros((12, 64, 3), np.uint8), "at least 16"),
        (np.full((64, 64), np.nan, np.float32), "NaN"),
        (np.full((64, 64), np.inf), "infinite"),
    ],
)
def test_bad_pictures_are_refused(image: npt.NDArray[Any], words: str) -> None:
    with pytest.raises(texforge.PictureError, match=words) as caught:
        texforge.detect_lattice(image)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "options", [{"min_confidence": 2}, {"min_period": -1}, {"min_period": "long"}, {"threads": -1}]
)
def test_bad_arguments_are_refused(wall: npt.NDArray[np.uint8], options: dict[str, Any]) -> None:
    with pytest.raises(texforge.ParameterError, match=next(iter(options))):
        texforge.detect_lattice(wall, **options)
    with pytest.raises(texforge.ParameterError, match="size"):
        texforge.detect_lattice(wall).snap((1, 2, 3))  # type: ignore[arg-type]


def test_bricks_in_perspective_are_refused() -> None:
    # The rows fan out: no displacement repeats the picture as a whole.
    brick = pytest.importorskip("skimage.data").brick()
    assert texforge.detect_lattice(brick).confidence < 0.3


@pytest.mark.timeout(600)
def test_photographs_have_the_lattices_measured_by_hand() -> None:
    if not (EXEMPLARS / "MANIFEST.json").is_file():
        pytest.skip("the photographs are not here: ../shared/exemplars")
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        import lattices
    finally:
        sys.path.pop(0)
    right, total, taken = 0, 0, []
    for entry in lattices.entries(EXEMPLARS, (*lattices.KNOWN, lattices.REFUSED)):
        lattice = texforge.detect_lattice(texforge.read_image(EXEMPLARS / entry["file"]))
        if entry["class"] == lattices.REFUSED:
            taken += [entry["file"]] if lattice.found else []
        else:
            total += 1
            right += lattice.found and lattices.same(lattice, entry["lattice"])
    assert right >= 0.9 * total, f"{right} of {total}"
    assert taken == []
