"""Traces and the exact texture cost, through Python. Their numbers are tested in Rust."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge

from .conftest import QUICK, noise


def test_a_trace_changes_nothing_and_ends_with_the_costs(photo: npt.NDArray[np.uint8]) -> None:
    plain = texforge.tile(photo, **QUICK)
    traced = texforge.tile(photo, **QUICK, trace=True)
    assert plain.trace == []
    assert np.array_equal(plain.image, traced.image)
    assert plain.costs == traced.costs
    # 24 pixels are one level; its iterations, and then the seams.
    n = len(traced.trace)
    assert n > 5
    assert [(step.level, step.iteration) for step in traced.trace] == [
        (0, i) for i in range(1, n + 1)
    ]
    assert traced.trace[-1][2:] == (traced.costs.texture, traced.costs.stationarity)
    assert traced.trace[0].texture > traced.trace[-1].texture
    stages = [dict(made.report["seconds"]) for made in (plain, traced)]
    assert set(stages[1]) - set(stages[0]) == {"trace"}
    assert texforge.tile(photo, size=24, method="make-seamless", trace=True).trace == []


def naive_cost(tile: texforge.Tile, photo: npt.NDArray[np.float64], patch: int) -> float:
    """Return the mean distance of all patches of the torus to the nearest of the photo, of data."""
    patches = np.lib.stride_tricks.sliding_window_view(photo, (patch, patch), axis=(0, 1))
    candidates = patches.reshape(-1, 3 * patch * patch)
    grown = np.pad(tile.image, ((0, patch - 1), (0, patch - 1), (0, 0)), mode="wrap")
    own = np.lib.stride_tricks.sliding_window_view(grown, (patch, patch), axis=(0, 1))
    nearest = [
        np.min(np.sum((candidates - query) ** 2, axis=1))
        for query in own.reshape(-1, 3 * patch * patch)
    ]
    # Data: full scale counts as 100.
    return float(np.mean(nearest)) * 100**2 / patch**2


def test_the_texture_cost_is_the_definition() -> None:
    photo = noise(40, 44).astype(np.float64) / 255
    tile = texforge.tile(photo, **{**QUICK, "size": 18}, encoding="data")
    expected = naive_cost(tile, photo, 5)
    for texture in (tile, tile.image):
        cost = texforge.texture_cost(texture, photo, patch=5, samples=10_000, encoding="data")
        assert cost.mean == pytest.approx(expected, rel=1e-5)
        assert cost.margin == 0
    drawn = texforge.texture_cost(tile.image, photo, patch=5, samples=50, encoding="data")
    assert drawn.samples == 50
    assert drawn.margin > 0
    assert drawn == texforge.texture_cost(
        tile.image, photo, patch=5, samples=50, encoding="data", threads=1
    )
    other = texforge.texture_cost(tile.image, photo, patch=5, samples=50, encoding="data", seed=1)
    assert other.mean != drawn.mean
    assert tile.costs.texture is not None
    assert drawn.mean < tile.costs.texture + drawn.margin


def test_axis_and_mask_count(photo: npt.NDArray[np.uint8]) -> None:
    tile = texforge.tile(photo, **QUICK)
    usable = np.zeros(photo.shape[:2], dtype=bool)
    usable[:20, :20] = True
    options: dict[str, Any] = {"patch": 5, "samples": 10_000}
    plain = texforge.texture_cost(tile, photo, **options).mean
    assert texforge.texture_cost(tile, photo, mask=usable, **options).mean > plain
    assert texforge.texture_cost(tile, photo, axis="x", **options).mean != plain


@pytest.mark.parametrize(
    "wrong",
    [
        {"samples": 1},
        {"samples": "many"},
        {"patch": 4},
        {"axis": "z"},
        {"seed": -1},
        {"threads": 1.5},
    ],
)
def test_wrong_arguments_are_named(photo: npt.NDArray[np.uint8], wrong: dict[str, Any]) -> None:
    with pytest.raises(texforge.ParameterError, match=f"`{next(iter(wrong))}` must be"):
        texforge.texture_cost(photo, photo, **wrong)


def test_pictures_of_other_kinds_are_refused(photo: npt.NDArray[np.uint8]) -> None:
    for other in (photo[:, :, 0], photo.astype(np.float32), photo[:8]):
        with pytest.raises(texforge.PictureError):
            texforge.texture_cost(other, photo)
    with pytest.raises(texforge.PictureError, match="mask"):
        texforge.texture_cost(photo, photo, mask=np.ones((3, 3), dtype=bool))


def test_progress_can_cancel(photo: npt.NDArray[np.uint8]) -> None:
    seen: list[float] = []
    texforge.texture_cost(photo, photo, progress=seen.append)
    assert seen[0] == 0.0
    assert seen[-1] == 1.0
    with pytest.raises(texforge.Cancelled):
        texforge.texture_cost(photo, photo, progress=lambda _: False)
