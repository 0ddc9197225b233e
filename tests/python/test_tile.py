"""What `tile` and `Tile` promise."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge
from hypothesis import given
from hypothesis import strategies as st

from .conftest import QUICK, noise, source_map_of

Photo = npt.NDArray[np.uint8]


def test_same_bytes_for_any_number_of_threads_and_every_run(photo: Photo) -> None:
    tiles = [
        texforge.tile(photo, threads=threads, seed=7, **QUICK) for threads in (1, 2, 5, 5, None, 0)
    ]
    assert len({tile.image.tobytes() for tile in tiles}) == 1
    assert len({source_map_of(tile).tobytes() for tile in tiles}) == 1
    assert len({tile.costs for tile in tiles}) == 1


def test_another_seed_gives_another_tile(photo: Photo) -> None:
    one, two = (texforge.tile(photo, seed=seed, **QUICK) for seed in (0, 2**64 - 1))
    assert one.image.tobytes() != two.image.tobytes()
    assert (one.seed, two.seed) == (0, 2**64 - 1)


@pytest.mark.parametrize(
    ("size", "shape"),
    [(16, (16, 16)), ((24, 32), (24, 32)), ([20, 18], (20, 18)), (np.int32(16), (16, 16))],
)
def test_size_is_height_and_width(photo: Photo, size: Any, shape: tuple[int, int]) -> None:
    tile = texforge.tile(photo, size=size, patch=5, quality="draft")
    assert tile.image.shape[:2] == shape
    assert tile.params["size"] == shape


def test_the_default_size_is_the_largest_power_of_two_in_the_photo(photo: Photo) -> None:
    assert texforge.tile(photo, patch=5, quality="draft").image.shape == (32, 32, 3)


def test_params_can_be_given_again(photo: Photo) -> None:
    one = texforge.tile(photo, sigma=0.2, uniformity=0.5, axis="x", **QUICK)
    assert one.params["sigma"] == pytest.approx(0.2)
    assert one.params["axis"] == "x"
    assert texforge.tile(photo, **one.params).image.tobytes() == one.image.tobytes()


@pytest.mark.parametrize("method", ["stationary", "wrap-only", "no-wrap", "make-seamless"])
@pytest.mark.parametrize("axis", ["both", "x", "y"])
def test_every_method_and_axis(photo: Photo, method: Any, axis: Any) -> None:
    tile = texforge.tile(photo, method=method, axis=axis, **QUICK)
    assert tile.image.shape == (24, 32, 3)
    assert (tile.source_map is None) == (method == "make-seamless")
    assert tile.params["method"] == method


def test_costs_are_finite_and_not_negative(photo: Photo) -> None:
    costs = texforge.tile(photo, **QUICK).costs
    assert costs.texture is not None
    assert 0 <= costs.texture < 1e6
    assert 0 <= costs.stationarity < 1e6
    assert texforge.tile(photo, method="make-seamless", **QUICK).costs.texture is None


@pytest.mark.parametrize("measure", ["histogram", "moments", "steerable"])
def test_each_measure_has_its_cost(photo: Photo, measure: texforge.Measure) -> None:
    costs = texforge.tile(photo, measure=measure, **QUICK).costs
    assert costs.stationarity_by_measure is not None
    assert (costs.stationarity_by_measure == costs.stationarity) == (measure == "histogram")
    assert texforge.tile(photo, measure="none", **QUICK).costs.stationarity_by_measure is None


def test_a_sigma_map_is_heeded_and_must_fit(photo: Photo) -> None:
    ramp = np.tile(np.linspace(0.02, 0.5, 32, dtype=np.float32), (24, 1))
    tile = texforge.tile(photo, sigma_map=ramp, **QUICK)
    assert not np.array_equal(tile.image, texforge.tile(photo, **QUICK).image)
    with pytest.raises(texforge.PictureError, match="the sigma map is 24x32 pixels"):
        texforge.tile(photo, sigma_map=ramp.T, **QUICK)
    ramp[3, 5] = np.nan
    with pytest.raises(texforge.PictureError, match="the sigma map holds 1 NaN"):
        texforge.tile(photo, sigma_map=ramp, **QUICK)


@given(seed=st.integers(0, 1000), share=st.floats(0.2, 0.9))
def test_no_masked_pixel_is_used(seed: int, share: float) -> None:
    photo = noise(40, 50)
    usable = np.zeros((40, 50), bool)
    rng = np.random.default_rng(seed)
    height, width = max(12, int(40 * share)), max(12, int(50 * share))
    top, left = rng.integers(0, 41 - height), rng.integers(0, 51 - width)
    usable[top : top + height, left : left + width] = True
    tile = texforge.tile(photo, mask=usable, seed=seed, **QUICK)
    assert usable[tuple(np.moveaxis(source_map_of(tile), -1, 0))].all()


def test_nothing_near_an_avoided_pixel_is_used(photo: Photo) -> None:
    marks = np.zeros((48, 64), bool)
    marks[10:14, 20:30] = True
    rows, columns = np.mgrid[:48, :64]
    marked = np.argwhere(marks)
    far = np.hypot(rows[..., None] - marked[:, 0], columns[..., None] - marked[:, 1]).min(axis=2)
    plain = texforge.tile(photo, **QUICK)
    assert (far[tuple(np.moveaxis(source_map_of(plain), -1, 0))] <= 4).any()
    for usable in (None, np.arange(48)[:, np.newaxis].repeat(64, axis=1) < 40):
        tile = texforge.tile(photo, avoid=marks, avoid_grow=4, mask=usable, **QUICK)
        y, x = np.moveaxis(source_map_of(tile), -1, 0)
        assert (far[y, x] > 4).all()
        assert usable is None or usable[y, x].all()


def test_variants_are_the_tiles_of_the_seeds_that_follow(photo: Photo) -> None:
    height = photo[..., 0]
    tiles = texforge.tile_variants(photo, 3, seed=5, maps={"height": height}, **QUICK)
    assert [tile.seed for tile in tiles] == [5, 6, 7]
    for tile in tiles:
        alone = texforge.tile(photo, seed=tile.seed, maps={"height": height}, **QUICK)
        assert tile.image.tobytes() == alone.image.tobytes()
        assert tile.costs == alone.costs
        assert np.array_equal(tile.maps["height"], alone.maps["height"])
    assert len({tile.image.tobytes() for tile in tiles}) == 3
    fractions: list[float] = []
    texforge.tile_variants(photo, 2, progress=fractions.append, **QUICK)
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_variants_that_cannot_be(photo: Photo) -> None:
    for count in (0, -1, 1001, 2.5, True):
        with pytest.raises(texforge.ParameterError, match="`count`"):
            texforge.tile_variants(photo, count, **QUICK)  # type: ignore[arg-type]
    with pytest.raises(texforge.ParameterError, match="`seed`"):
        texforge.tile_variants(photo, 2, seed=2**64 - 1, **QUICK)
    with pytest.raises(texforge.ParameterError, match="`variants`"):
        texforge.tile_variants(photo, 2, method="make-seamless", **QUICK)
    with pytest.raises(TypeError, match="blorb"):
        texforge.tile_variants(photo, 2, blorb=1)  # type: ignore[call-arg]


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32"])
def test_flatten_takes_a_slope_of_light_out(dtype: str) -> None:
    grain = noise(64, 96, None) / 255.0 * 0.3 + 0.35
    light = np.linspace(0.3, 1.2, 96) * np.linspace(1.2, 0.7, 64)[:, np.newaxis]
    full = {"uint8": 255, "uint16": 65535}.get(dtype, 1)
    photo = ((grain * light) ** (1 / 2.2) * full).astype(dtype)
    kinds = {"height": noise(64, 96, None, seed=3)}

    def left(tile: texforge.Tile) -> float:
        """Return by how much the light over the tile's pixels still differs."""
        y, x = np.moveaxis(source_map_of(tile), -1, 0)
        value = np.maximum(tile.image.astype(float) / full, 1e-3) ** 2.2
        return float(np.std(np.log(value / grain[y, x])))

    plain = texforge.tile(photo, method="wrap-only", **QUICK)
    flat = texforge.tile(photo, method="wrap-only", flatten=0.3, maps=kinds, **QUICK)
    assert flat.image.dtype == photo.dtype
    assert left(plain) > 0.25
    assert left(flat) < 0.1
    assert any("flattened" in note for note in flat.report["notes"])
    y, x = np.moveaxis(source_map_of(flat), -1, 0)
    assert np.array_equal(flat.maps["height"], kinds["height"][y, x])


@pytest.mark.parametrize("dtype", ["bool", "uint8", "uint16", "float32"])
def test_masks_of_every_type_mean_the_same(photo: Photo, dtype: str) -> None:
    usable = np.zeros((48, 64), bool)
    usable[5:40, 7:50] = True
    full = {"bool": True, "uint8": 255, "uint16": 65535, "float32": 1.0}[dtype]
    tile = texforge.tile(photo, mask=usable.astype(dtype) * np.dtype(dtype).type(full), **QUICK)
    expected = texforge.tile(photo, mask=usable[:, :, np.newaxis], **QUICK)
    assert np.array_equal(source_map_of(tile), source_map_of(expected))


def test_transparent_pixels_are_never_used(photo: Photo) -> None:
    alpha = np.full((48, 64, 1), 255, np.uint8)
    alpha[20:, :30] = 128
    tile = texforge.tile(np.concatenate([photo, alpha], axis=2), **QUICK)
    assert (tile.image[..., 3] == 255).all()
    # As data the fourth channel is a number like the others.
    as_data = np.concatenate([photo, alpha], axis=2)
    assert texforge.tile(as_data, encoding="data", **QUICK).encoding == "data"


def test_maps_follow_the_tile(photo: Photo) -> None:
    rng = np.random.default_rng(1)
    height = rng.random((48, 64))
    rough = rng.integers(0, 65536, (48, 64, 1)).astype(np.uint16)
    tile = texforge.tile(photo, maps={"height": height, "roughness": rough}, **QUICK)
    y, x = np.moveaxis(source_map_of(tile), -1, 0)
    assert np.array_equal(tile.maps["height"], height[y, x])
    assert np.array_equal(tile.maps["roughness"], rough[y, x])
    assert np.array_equal(tile.apply(height), height[y, x])
    assert list(tile.maps) == ["height", "roughness"]


def test_normal_maps_come_out_with_unit_length(photo: Photo) -> None:
    normals = np.random.default_rng(2).normal((0, 0, 3), size=(48, 64, 3))
    tile = texforge.tile(photo, maps={"normal": normals * 0.1 + 0.5}, **QUICK)
    for out in (tile.maps["normal"], tile.apply(normals * 0.1 + 0.5, kind="normal")):
        assert np.linalg.norm(out * 2 - 1, axis=-1) == pytest.approx(1, abs=1e-5)


def test_a_map_of_another_shape_fails_before_the_work(photo: Photo) -> None:
    calls: list[float] = []
    with pytest.raises(texforge.PictureError, match="the map `height`") as caught:
        texforge.tile(photo, maps={"height": np.zeros((48, 90))}, progress=calls.append, **QUICK)
    assert caught.value.kind == "size_mismatch"
    assert not calls


def test_a_map_at_another_resolution_is_read_in_between() -> None:
    ramp = np.arange(8, dtype=np.float64)[np.newaxis].repeat(4, axis=0)
    half = ramp[::2, :].reshape(2, 4, 2).mean(axis=2)
    positions = np.moveaxis(np.mgrid[0:4, 1:7], 0, -1)
    out = texforge.apply(positions, half, source_size=(4, 8))
    assert out == pytest.approx(ramp[:, 1:7])


def test_apply_copies_bit_for_bit(photo: Photo) -> None:
    tile = texforge.tile(photo, **QUICK)
    other = np.random.default_rng(3).normal(size=(48, 64, 2)).astype(np.float16)
    other[0, 0] = np.nan
    y, x = np.moveaxis(source_map_of(tile), -1, 0)
    positions = source_map_of(tile)
    for source_map in (tile, positions, positions.astype(np.uint64)):
        assert texforge.apply(source_map, other).tobytes() == other[y, x].tobytes()
    as_class = texforge.SourceMap(positions, tile.photo_size)
    assert np.array_equal(texforge.apply(as_class, photo, kind="color"), tile.image)
    assert np.array_equal(np.asarray(as_class), positions)


def test_tiled_repeats(photo: Photo) -> None:
    for picture in (photo, photo[..., 0]):
        tile = texforge.tile(picture, **QUICK)
        repeated = tile.tiled(2, 3)
        assert repeated.shape == (48, 96, *picture.shape[2:])
        assert np.array_equal(repeated[24:, 64:], tile.image)


def test_pickle_and_copy(photo: Photo) -> None:
    light = texforge.Image.tagged((photo / 255).astype(np.float32), "linear")
    tile = texforge.tile(light, maps={"height": photo[..., 0]}, **QUICK)
    copies: list[texforge.Tile] = [
        pickle.loads(pickle.dumps(tile)),  # noqa: S301 (our own)
        copy.copy(tile),
        copy.deepcopy(tile),
    ]
    for same in copies:
        assert np.array_equal(same.image, tile.image)
        assert isinstance(same.image, texforge.Image)
        assert same.image.encoding == "linear"
        assert np.array_equal(source_map_of(same), source_map_of(tile))
        assert np.array_equal(same.maps["height"], tile.maps["height"])
        assert (same.costs, same.seed, same.params) == (tile.costs, tile.seed, tile.params)


def test_a_tile_cannot_be_changed_by_mistake(photo: Photo) -> None:
    tile = texforge.tile(photo, **QUICK)
    with pytest.raises(AttributeError):
        tile.seed = 3  # type: ignore[misc]
    assert "24 x 32 uint8" in repr(tile)


def test_a_band_keeps_the_middle() -> None:
    photo = np.random.default_rng(4).integers(0, 65536, (48, 64, 3), dtype=np.uint16)
    tile = texforge.tile(photo, band=9, patch=5, quality="draft")
    assert tile.image.shape == photo.shape
    assert np.array_equal(tile.image[9:-9, 9:-9], photo[9:-9, 9:-9])
    assert not np.array_equal(tile.image, photo)
    assert not np.array_equal(
        texforge.tile(photo, size=(48, 64), patch=5, quality="draft").image[9:-9, 9:-9],
        photo[9:-9, 9:-9],
    )


def test_rarity_changes_what_is_copied() -> None:
    photo = np.full((64, 64), 120, dtype=np.uint8)
    photo += np.random.default_rng(5).integers(0, 40, photo.shape, dtype=np.uint8)
    photo[20:32, 20:32] = np.arange(12, dtype=np.uint8) * 6 + 90
    plain, rare = (texforge.tile(photo, size=48, patch=7, rarity=rarity).image for rarity in (0, 4))
    assert not np.array_equal(plain, rare)
