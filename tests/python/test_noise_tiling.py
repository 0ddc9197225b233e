"""Procedural textures of tiles that are blended, through Python."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import hypothesis
import numpy as np
import numpy.typing as npt
import pytest
import texforge
from hypothesis import strategies as st

from .naive_tiling import Tiles
from .test_noise import changed, grain

if TYPE_CHECKING:
    from collections.abc import Callable


def stones(height: int = 120, width: int = 150, seed: int = 0) -> npt.NDArray[np.uint8]:
    """Return a photo with shapes: round stones of different colours, lit from one side."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    photo = np.full((height, width, 3), 40.0)
    for _ in range(height * width // 60):
        middle, radius = rng.uniform(0, (height, width)), rng.uniform(4, 9)
        down, right = (y - middle[0]) / radius, (x - middle[1]) / radius
        inside = down**2 + right**2 < 1
        color = rng.uniform(70, 190) + rng.normal(0, 12, 3)
        photo[inside] = color * (1 - 0.3 * (down + right)[inside, None] / 1.5)
    return np.clip(photo + rng.normal(0, 3, photo.shape), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def pebbles() -> texforge.NoiseTexture:
    """Return a tiled texture of one map of colours."""
    return texforge.fit_noise(stones(), model="tiling", seed=3)


@hypothesis.given(
    seed=st.integers(0, 2**32 - 1),
    sharpness=st.integers(1, 16),
    cell=st.sampled_from([0, 8, 17, 30]),
    channels=st.sampled_from([None, 3, 5]),
    histogram=st.sampled_from(["kept", "normal"]),
    far=st.sampled_from([100.0, 1e5]),
)
@hypothesis.settings(max_examples=12)
def test_values_are_those_of_the_naive_twin(
    seed: int, sharpness: int, cell: int, channels: int | None, histogram: Any, far: float
) -> None:
    texture = texforge.fit_noise(
        grain(80, 100, channels),
        model="tiling",
        sharpness=sharpness,
        cell=cell,
        histogram=histogram,
        seed=seed,
    )
    points = np.random.default_rng(seed).uniform(-far, far, (100, 2))
    expected = Tiles(texture.document).at(points)
    # At 1e5 a place between two pixels is known to 1e-5 of them.
    assert np.abs(texture.at(points) - expected).max() < 2e-5


def test_pixels_have_the_bits_of_points(pebbles: texforge.NoiseTexture) -> None:
    for scale in (0.5, 1.0, 3.0):
        picture = pebbles.render((40, 50), scale=scale, origin=(-70.0, 33.0), dtype="float32")
        y, x = np.mgrid[:40, :50] + 0.5
        points = np.stack([x * scale - 70, y * scale + 33], axis=-1)
        footprint = scale if scale > 1 else 0.0
        assert np.array_equal(pebbles.at(points, footprint=footprint), picture)


def test_vertices_show_the_photo(pebbles: texforge.NoiseTexture) -> None:
    """Where one tile alone counts, a pixel is a pixel of the photo, but for 16 bits."""
    photo = stones()
    tiles = Tiles(pebbles.document)
    height, width = tiles.input.shape[:2]
    top, left = (photo.shape[0] - height) // 2, (photo.shape[1] - width) // 2
    a, b = tiles.layout["cell"]
    for i, j in [(0, 0), (3, 5), (-7, 20), (100, -90)]:
        # The pixel below and to the right of the vertex has nearly all of its weight.
        middle = np.array([a * i + a // 2 * j, b * j]) + 0.5
        x, y = tiles.place(i, j)
        got = 255 * pebbles.at([middle])[0]
        # The histogram's curve ends at 3.2 deviations.
        assert np.abs(got - photo[top + y, left + x]).max() < 6


def test_the_same_bytes_for_any_number_of_threads(pebbles: texforge.NoiseTexture) -> None:
    for threads in (1, 2, 5):
        again = texforge.fit_noise(stones(), model="tiling", seed=3, threads=threads)
        assert again.to_json() == pebbles.to_json()
        options: dict[str, Any] = {"tileable": True, "threads": threads}
        assert np.array_equal(
            pebbles.render((70, 90), **options), again.render((70, 90), tileable=True)
        )


def test_documents_go_there_and_back_exactly(pebbles: texforge.NoiseTexture) -> None:
    text = pebbles.to_json()
    again = texforge.NoiseTexture.from_json(text)
    assert again.to_json() == text
    assert np.array_equal(again.render(50), pebbles.render(50))
    assert pebbles.maps == ("basecolor",)
    assert "tiling" in repr(pebbles)


def test_another_seed_is_another_choice_of_the_same_tiles(pebbles: texforge.NoiseTexture) -> None:
    other = texforge.fit_noise(stones(), model="tiling", seed=8)
    assert pebbles.edit(seed=8) == other
    assert not np.array_equal(pebbles.render(90), other.render(90))


@pytest.mark.parametrize(
    ("size", "scale"), [((90, 130), 1.0), ((33, 200), 1.0), ((64, 64), 0.7), ((3, 1), 1.0)]
)
def test_tileable_pictures_repeat(
    pebbles: texforge.NoiseTexture, size: tuple[int, int], scale: float
) -> None:
    """A picture that is moved by its origin is the same one rolled."""
    options: dict[str, Any] = {"scale": scale, "tileable": True, "dtype": "float32"}
    picture = np.asarray(pebbles.render(size, **options))
    moved = pebbles.render(size, origin=(16 * scale, -8 * scale), **options)
    assert np.allclose(np.roll(picture, (8, -16), (0, 1)), moved, atol=1e-4)


def test_tiles_go_on_into_each_other() -> None:
    """Neighbours that were chosen differ less where they overlap than those that are drawn."""
    texture = texforge.fit_noise(stones(), model="tiling")
    tiles = Tiles(texture.document)
    drawn = np.random.default_rng(0).permutation(tiles.table.reshape(-1, 5)).reshape(32, 32, 5)
    a, b = tiles.layout["cell"]
    deviations = np.array([channel["weights"][0] for channel in tiles.channels])

    def differences(table: npt.NDArray[np.int64]) -> float:
        tiles.table = table
        squares = []
        for i, j in np.ndindex(12, 12):
            half = np.array([a / 2, 0.0])
            way = np.array([a, 0])
            pair = (
                tiles.sample(tiles.place(i, j) + half),
                tiles.sample(tiles.place(i + 1, j) + half - way),
            )
            squares.append((((pair[0] - pair[1]) * deviations) ** 2).sum())
            del pair
        return float(np.mean(squares))

    chosen = differences(tiles.table)
    assert chosen < 0.7 * differences(drawn)
    assert b < a


def test_it_looks_as_colourful_as_the_photo() -> None:
    photo = stones(200, 200) / 255
    for sharpness in (1, 4):
        texture = texforge.fit_noise(photo, model="tiling", sharpness=sharpness)
        picture = np.asarray(texture.render(400, dtype="float32"), float)
        assert picture.mean((0, 1)) == pytest.approx(photo.mean((0, 1)), abs=0.03)
        assert picture.std((0, 1)) == pytest.approx(photo.std((0, 1)), rel=0.1)
        # Earth mover's distance of the brightness, by quantiles.
        ranks = np.linspace(0.01, 0.99, 99)
        off = np.quantile(picture.mean(2), ranks) - np.quantile(photo.mean(2), ranks)
        assert np.abs(off).mean() < 0.02


def test_smaller_pictures_are_filtered(pebbles: texforge.NoiseTexture) -> None:
    fine = np.asarray(pebbles.render((256, 256), dtype="float32"), float)
    for scale in (2, 4):
        small = np.asarray(pebbles.render(256 // scale, scale=scale, dtype="float32"), float)
        n = 256 // scale
        means = fine.reshape(n, scale, n, scale, 3).mean((1, 3))
        # The mean of values is not the value of means, but near it.
        assert np.abs(small - means).mean() < 0.25 * means.std()
    far = np.asarray(pebbles.render(20, scale=1000, dtype="float32"), float)
    assert far.std((0, 1)).max() < 1e-3
    assert far.mean((0, 1)) == pytest.approx(stones().mean((0, 1)) / 255, abs=0.02)
    kept = np.asarray(pebbles.render(128, scale=4, keep_contrast=True, dtype="float32"))
    assert kept.std() > 1.2 * np.asarray(pebbles.render(128, scale=4, dtype="float32")).std()


def test_what_is_masked_is_never_shown() -> None:
    photo = stones()
    mask = np.ones(photo.shape[:2], bool)
    mask[30:60, 100:140] = False
    photo[~mask] = (255, 0, 255)
    texture = texforge.fit_noise(photo, model="tiling", mask=mask)
    picture = np.asarray(texture.render(500)).astype(int)
    magenta = (picture[..., 0] > 150) & (picture[..., 2] > 150) & (picture[..., 1] < 80)
    assert not magenta.any()


def test_maps_stay_in_step() -> None:
    photo = stones()
    height = (photo.mean(2) * 256).astype(np.uint16)
    texture = texforge.fit_noise(photo, model="tiling", maps={"height": height})
    values = np.asarray(texture.render(200, map="height", dtype="float32"), float)
    color = np.asarray(texture.render(200, map="basecolor", dtype="float32"), float).mean(2)
    assert np.corrcoef(values.ravel(), color.ravel())[0, 1] > 0.99


def test_progress_and_cancelling(pebbles: texforge.NoiseTexture) -> None:
    seen: list[float] = []
    texforge.fit_noise(stones(), model="tiling", progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    assert len(seen) > 5
    with pytest.raises(texforge.Cancelled):
        texforge.fit_noise(stones(), model="tiling", progress=lambda _: False)
    seen.clear()
    pebbles.render(90, tileable=True, progress=seen.append)
    assert seen[-1] == 1


REFUSED: dict[str, tuple[type[Exception], Callable[[texforge.NoiseTexture], object]]] = {
    "sharpness 0": (
        texforge.ParameterError,
        lambda _: texforge.fit_noise(stones(), model="tiling", sharpness=0),
    ),
    "cells too large": (
        texforge.ParameterError,
        lambda _: texforge.fit_noise(stones(), model="tiling", cell=80),
    ),
    "an unknown model": (
        texforge.ParameterError,
        lambda _: texforge.fit_noise(stones(), model="quilt"),  # type: ignore[arg-type]
    ),
    "nothing without holes": (
        texforge.PictureError,
        lambda _: texforge.fit_noise(
            stones(), model="tiling", mask=np.indices((120, 150)).sum(0) % 20 > 0
        ),
    ),
    "a third axis": (texforge.ParameterError, lambda t: t.at([[0.0, 0.0, 0.0]])),
    "millions of tiles that go round": (
        texforge.ParameterError,
        lambda t: t.render(100, tileable=True, scale=1e4),
    ),
    "a solid": (texforge.ParameterError, lambda t: t.solid(4)),
    "gains": (texforge.ParameterError, lambda t: t.edit(gains=[0.5])),
    "a feature size": (texforge.ParameterError, lambda t: t.edit(feature_size=2.0)),
    "morphing": (texforge.ParameterError, lambda t: t.morph(t, 0.5)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_tiles_cannot_do_is_said(pebbles: texforge.NoiseTexture, case: str) -> None:
    kind, call = REFUSED[case]
    with pytest.raises(kind) as caught:
        call(pebbles)
    assert "\n" not in str(caught.value)


LAYOUT = ("model", "tiling", "layout")
DAMAGE: dict[str, Callable[[dict[str, Any]], object]] = {
    "sharpness": changed((*LAYOUT, "sharpness"), 17),
    "odd cells": changed((*LAYOUT, "cell", 0), 13),
    "huge cells": changed((*LAYOUT, "cell"), [2**31, 2**31]),
    "no cells": changed((*LAYOUT, "cell"), [0, 0]),
    "a cut table": changed((*LAYOUT, "table"), "AAAA"),
    "a garbled table": changed((*LAYOUT, "table"), "%&"),
    "a table of other places": changed((*LAYOUT, "table"), "/" * 6828),
    "no picture": changed((*LAYOUT, "input", "png"), []),
    "a garbled picture": changed((*LAYOUT, "input", "png", 0), "AAAA"),
    "another size": changed((*LAYOUT, "input", "size"), [64, 64]),
    "no size": changed((*LAYOUT, "input", "size"), [0, 0]),
    "a field more": changed((*LAYOUT, "colour"), 1),
    "two weights": changed(("model", "tiling", "channels", 0, "weights"), [0.1, 0.2]),
    "channels": lambda d: d["model"]["tiling"]["channels"].pop(),
}


@pytest.mark.parametrize("case", DAMAGE)
def test_damaged_documents(pebbles: texforge.NoiseTexture, case: str) -> None:
    document = pebbles.document
    DAMAGE[case](document)
    with pytest.raises(texforge.DocumentError, match="no procedural texture") as caught:
        texforge.NoiseTexture.from_json(json.dumps(document))
    assert "\n" not in str(caught.value)
