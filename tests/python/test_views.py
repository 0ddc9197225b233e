"""Several photos mixed, patches mirrored and turned: what Python sees of it."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge

from .conftest import QUICK, noise, source_map_of

if TYPE_CHECKING:
    from pathlib import Path

Photos = list[npt.NDArray[np.uint8]]


@pytest.fixture
def photos() -> Photos:
    """Return photos of three sizes."""
    return [noise(48, 64), noise(40, 40, seed=1), noise(30, 70, seed=2)]


def origins_of(tile: texforge.Tile) -> npt.NDArray[np.int32]:
    assert tile.origins is not None
    return tile.origins


def picked(tile: texforge.Tile, pictures: list[Any]) -> npt.NDArray[Any]:
    """Return what the source map names, photo by photo."""
    y, x = np.moveaxis(source_map_of(tile), -1, 0)
    which = origins_of(tile)[..., 0]
    out = np.zeros((*which.shape, *pictures[0].shape[2:]), pictures[0].dtype)
    for i, picture in enumerate(pictures):
        out[which == i] = picture[y[which == i], x[which == i]]
    return out


@pytest.mark.parametrize("symmetry", ["none", "mirror", "rotate", "all"])
def test_every_pixel_is_named(photos: Photos, symmetry: Any) -> None:
    heights = [photo[..., 0].astype(np.float32) for photo in photos]
    first, *also = photos
    tile = texforge.tile(first, also=also, symmetry=symmetry, maps={"height": heights}, **QUICK)
    assert np.array_equal(tile.image, picked(tile, photos))
    assert np.array_equal(tile.maps["height"], picked(tile, heights))
    assert np.array_equal(tile.apply(heights[0], also=heights[1:]), tile.maps["height"])
    codes = {"none": {0}, "mirror": {0, 4}, "rotate": {0, 1, 2, 3}, "all": set(range(8))}
    assert set(np.unique(origins_of(tile)[..., 1])) <= codes[symmetry]
    assert set(np.unique(origins_of(tile)[..., 0])) == {0, 1, 2}
    assert tile.also_sizes == ((40, 40), (30, 70))
    assert tile.params["symmetry"] == symmetry
    threads = texforge.tile(first, also=also, symmetry=symmetry, threads=5, **QUICK)
    assert threads.image.tobytes() == tile.image.tobytes()


def test_the_symmetry_is_the_one_of_numpy(photos: Photos) -> None:
    """Codes are quarter turns like `numpy.rot90`, and 4 for `numpy.fliplr` before."""
    photo = photos[0]
    rows, columns = np.mgrid[:48, :64]
    tile = texforge.tile(photo, symmetry="all", **{**QUICK, "size": 40})
    y, x = np.moveaxis(source_map_of(tile), -1, 0)
    whole = {}
    for code in range(8):
        mirrored = np.fliplr if code >= 4 else np.asarray
        laid_y, laid_x = (np.rot90(mirrored(grid), code % 4) for grid in (rows, columns))
        place = np.zeros((48, 64, 2), int)
        place[laid_y, laid_x] = np.moveaxis(np.indices(laid_y.shape), 0, -1)
        here = origins_of(tile)[..., 1] == code
        pairs = here[:, 1:] & here[:, :-1]
        step = place[y[:, 1:], x[:, 1:]] - place[y[:, :-1], x[:, :-1]]
        whole[code] = (step[pairs] == (0, 1)).all(axis=1).mean() if pairs.any() else 1.0
    assert min(whole.values()) > 0.5, whole


def test_one_photo_as_it_lies_has_no_origins(photos: Photos) -> None:
    tile = texforge.tile(photos[0], **QUICK)
    assert tile.origins is None
    assert tile.also_sizes == ()


def test_the_source_map_comes_back_from_its_file(photos: Photos, tmp_path: Path) -> None:
    tile = texforge.tile(photos[0], also=photos[1:], symmetry="all", **QUICK)
    tile.save_source_map(tmp_path / "map.exr")
    loaded = texforge.load_source_map(tmp_path / "map.exr")
    assert np.array_equal(loaded.positions, source_map_of(tile))
    assert loaded.origins is not None
    assert np.array_equal(loaded.origins, origins_of(tile))
    assert (loaded.source_size, loaded.further_sizes) == ((48, 64), tile.also_sizes)
    copy = pickle.loads(pickle.dumps(loaded))  # noqa: S301 (our own)
    out = copy.apply(photos[0], also=photos[1:], kind="color")
    assert np.array_equal(out, tile.image)
    same = texforge.tile_variants(photos[0], 2, also=photos[1:], symmetry="all", **QUICK)
    assert np.array_equal(same[0].image, tile.image)


def test_normals_turn() -> None:
    """A map of one normal everywhere: what it becomes tells how each pixel lay."""
    photo = noise()
    right_up = np.array([0.6, 0.48, 0.64]) / 2 + 0.5
    flat = np.broadcast_to(right_up, (48, 64, 3))
    tile = texforge.tile(photo, symmetry="all", maps={"normal_gl": flat}, **QUICK)
    n = tile.maps["normal_gl"] * 2 - 1
    code = origins_of(tile)[..., 1]
    want = np.zeros((8, 2))
    for i in range(8):
        x, y = (-0.6 if i >= 4 else 0.6), 0.48
        for _ in range(i % 4):
            x, y = -y, x
        want[i] = x, y
    assert n[..., :2] == pytest.approx(want[code], abs=1e-6)
    dx = tile.apply(flat * (1, -1, 1) + (0, 1, 0), kind="normal_dx") * 2 - 1
    assert dx[..., 0] == pytest.approx(n[..., 0], abs=1e-6)
    assert dx[..., 1] == pytest.approx(-n[..., 1], abs=1e-6)


def test_what_cannot_be(photos: Photos) -> None:
    first, *also = photos
    with pytest.raises(texforge.PictureError, match="photo 2: it is uint16"):
        texforge.tile(first, also=[first.astype(np.uint16)], **QUICK)
    with pytest.raises(texforge.ParameterError, match="`also`"):
        texforge.tile(first, also=also, method="make-seamless", **QUICK)
    for maps in ([first], first, [first, first, first, first]):
        with pytest.raises(texforge.ParameterError, match="`maps` must be a list of 3"):
            texforge.tile(first, also=also, maps={"height": maps}, **QUICK)
    with pytest.raises(texforge.ParameterError, match="normal_gl"):
        texforge.tile(first, symmetry="rotate", maps={"normal": first}, **QUICK)
    texforge.tile(first, symmetry="mirror", maps={"normal": first}, **QUICK)
    with pytest.raises(texforge.PictureError, match="map 2 `height`"):
        texforge.tile(first, also=[also[0]], maps={"height": [first, also[1]]}, **QUICK)
    tile = texforge.tile(first, also=also, **QUICK)
    with pytest.raises(texforge.PictureError, match="1 given, 3 needed"):
        tile.apply(first)
    bad = texforge.SourceMap(source_map_of(tile), (48, 64), (), origins_of(tile) + 8)
    with pytest.raises(texforge.PictureError, match="origin"):
        bad.apply(first)
    short = texforge.SourceMap(source_map_of(tile), (48, 64), (), origins_of(tile)[:3])
    with pytest.raises(texforge.PictureError, match="origins of shape"):
        short.apply(first)
