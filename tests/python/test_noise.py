"""Procedural textures through Python. What they look like is judged in `test_noise_fidelity.py`."""

from __future__ import annotations

import copy
import itertools
import json
import pickle
import statistics
import typing
from typing import TYPE_CHECKING, Any

import hypothesis
import numpy as np
import numpy.typing as npt
import pytest
import texforge
from hypothesis import strategies as st
from texforge import _texforge

from . import naive_noise
from .conftest import noise

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def grain(
    height: int = 64, width: int = 80, channels: int | None = 3, dtype: str = "uint8", seed: int = 0
) -> npt.NDArray[Any]:
    """Return sand: correlated channels with a skewed histogram and more than one octave."""
    rng = np.random.default_rng(seed)
    count = channels or 1
    fine = rng.gamma(2, 0.06, (height, width, 1)) + rng.normal(0, 0.02, (height, width, count))
    coarse = np.repeat(np.repeat(rng.random((height // 4 + 1, width // 4 + 1, 1)), 4, 0), 4, 1)
    unit = np.clip(0.2 + fine + 0.2 * coarse[:height, :width], 0, 1)
    if channels in (2, 4):
        unit[..., -1] = 1
    full = np.iinfo(dtype).max if dtype[0] == "u" else 1
    photo: npt.NDArray[Any] = (unit * full).astype(dtype)
    return photo[..., 0] if channels is None else photo


@pytest.fixture(scope="module")
def sand() -> texforge.NoiseTexture:
    """Return a texture of one map of colours."""
    return texforge.fit_noise(grain(), seed=3)


@pytest.fixture(scope="module")
def material() -> texforge.NoiseTexture:
    """Return a texture of colours, a height and normals: seven channels."""
    photo = grain()
    height = photo[..., 0].astype(np.uint16) * 257
    normal = np.concatenate([photo[..., :2] // 4 + 96, np.full((64, 80, 1), 250, np.uint8)], 2)
    return texforge.fit_noise(photo, maps={"height": height, "normal_gl": normal})


def oriented(texture: texforge.NoiseTexture, angle: float) -> texforge.NoiseTexture:
    """Return a texture of one channel with directions."""
    document = texture.document
    bands = [
        {"levels": [0, 3], "parts": ["fine", "band"]},
        {"levels": [2, 1], "parts": ["band", "low"]},
        {"levels": [1, 4], "parts": ["low", "band"]},
    ]
    channel = {"weights": [0.05, 0.08, 0.02], "histogram": list(0.1 * naive_noise.KNOTS)}
    document["model"] = {"oriented": {"angle": angle, "bands": bands, "channels": [channel]}}
    document["matrix"] = [[row[0]] for row in document["matrix"]]
    return texforge.NoiseTexture.from_json(json.dumps(document))


def middles(
    size: tuple[int, ...], scale: float, origin: tuple[float, ...]
) -> npt.NDArray[np.float64]:
    """Return where the middles of pixels, or voxels, lie: x first."""
    axes = [
        start + (np.arange(n) + 0.5) * scale
        for n, start in zip(size, reversed(origin), strict=True)
    ]
    return np.stack(list(reversed(np.meshgrid(*axes, indexing="ij"))), axis=-1)


def test_it_knows_what_it_is(material: texforge.NoiseTexture) -> None:
    assert material.size == (64, 80)
    assert material.maps == ("basecolor", "height", "normal_gl")
    assert material.channels == {
        "basecolor": slice(0, 3),
        "height": slice(3, 4),
        "normal_gl": slice(4, 7),
    }
    assert material.seed == 0
    assert 0 <= material.score <= 1
    assert material.recommended in ("wavelet", "oriented", "none")
    assert material.document["maps"][1] == {
        "name": "height",
        "kind": "data",
        "encoding": "data",
        "channels": 1,
    }
    assert material.document["size"] == [80, 64]
    assert material.report["photo_size"] == [80, 64]
    assert len(repr(material)) < 120
    assert "64 x 80" in repr(material)
    picture = material._repr_png_()
    assert picture is not None
    assert picture.startswith(b"\x89PNG")
    assert int.from_bytes(picture[16:20], "big") == int.from_bytes(picture[20:24], "big") == 256
    with pytest.raises(AttributeError):
        material.report = {}  # type: ignore[misc]


def test_the_document_is_small(sand: texforge.NoiseTexture) -> None:
    assert len(sand.to_json()) < 2000
    assert sand.report["bytes"] == len(sand.to_json())


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32", "float64"])
@pytest.mark.parametrize("channels", [None, 1, 2, 3, 4, 5])
def test_every_kind_of_photo(dtype: str, channels: int | None) -> None:
    texture = texforge.fit_noise(grain(48, 40, channels, dtype))
    colours = {None: 1, 2: 1, 4: 3}.get(channels, channels)
    values = texture.at([[0.5, 0.5], [1000.25, -77.5]])
    assert values.shape == (2, colours)
    assert values.dtype == np.float32
    assert values.flags.c_contiguous
    image = texture.render((20, 30), dtype="uint16")
    assert image.shape == ((20, 30) if colours == 1 else (20, 30, colours))
    assert image.dtype == np.uint16


def test_a_linear_photo_makes_a_linear_texture() -> None:
    photo = texforge.Image.tagged(grain(dtype="float32"), "linear")
    texture = texforge.fit_noise(photo)
    image = texture.render(64, dtype="float32")
    assert isinstance(image, texforge.Image)
    assert image.encoding == "linear"
    assert np.asarray(image).mean() == pytest.approx(photo.mean(), rel=0.05)
    data = texforge.fit_noise(grain(channels=1), encoding="data")
    assert data.document["maps"][0]["kind"] == "data"
    assert data.render(16).encoding == "data"


def test_the_texture_has_the_photos_statistics(sand: texforge.NoiseTexture) -> None:
    unit = grain() / 255
    values = sand.render(512, dtype="float32").reshape(-1, 3)
    assert values.mean(0) == pytest.approx(unit.mean((0, 1)), abs=0.01)
    measured, expected = np.cov(values.T), np.cov(unit.reshape(-1, 3).T)
    assert np.linalg.norm(measured - expected) < 0.1 * np.linalg.norm(expected)


@hypothesis.given(
    size=st.tuples(st.integers(1, 70), st.integers(1, 70)),
    scale=st.one_of(st.just(1.0), st.floats(1e-3, 100)),
    origin=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)),
    keep_contrast=st.booleans(),
    bands=st.sampled_from(["round", "square"]),
    angle=st.sampled_from([None, 0.0, 30.0]),
)
def test_pixels_have_the_bits_of_points(
    size: tuple[int, int],
    scale: float,
    origin: tuple[float, float],
    keep_contrast: bool,
    bands: Any,
    angle: float | None,
) -> None:
    texture = texforge.fit_noise(grain(), bands=bands)
    if angle is not None:
        texture = oriented(texture, angle)
    given: dict[str, Any] = {"keep_contrast": keep_contrast}
    picture = texture.render(size, scale=scale, origin=origin, dtype="float32", **given)
    footprint = scale if scale > 1 else 0
    values = texture.at(middles(size, scale, origin), footprint=footprint, **given)
    assert values.shape == (*size, 3)
    assert np.array_equal(np.asarray(picture), values)


def test_voxels_have_the_bits_of_points(sand: texforge.NoiseTexture) -> None:
    for scale, origin in ((1.0, (0.0, 0.0, 0.0)), (0.37, (-5.5, 1e5, 3.3)), (2.5, (1.0, 2.0, 3.0))):
        block = sand.solid((3, 14, 15), scale=scale, origin=origin)
        footprint = scale if scale > 1 else 0
        values = sand.at(middles((3, 14, 15), scale, origin), footprint=footprint)
        assert block.shape == (3, 14, 15, 3)
        assert np.array_equal(block, values)
        part = sand.solid((1, 14, 15), scale=scale, origin=(*origin[:2], origin[2] + 2 * scale))
        assert np.allclose(part[0], block[2], atol=1e-5)


def test_integers_are_the_clipped_floats(material: texforge.NoiseTexture) -> None:
    # Contrast until values leave the range.
    document = material.document
    document["matrix"] = [[4 * v for v in row] for row in document["matrix"]]
    wild = texforge.NoiseTexture.from_json(json.dumps(document))
    floats = wild.render_maps(100, dtype="float32")
    assert floats["basecolor"].max() > 1
    assert floats["basecolor"].min() < 0
    dtypes: tuple[texforge.SampleType, ...] = ("uint8", "uint16")
    for dtype in dtypes:
        full = np.iinfo(dtype).max
        pictures = wild.render_maps(100, dtype=dtype)
        assert list(pictures) == ["basecolor", "height", "normal_gl"]
        for name, picture in pictures.items():
            assert picture.dtype == dtype
            expected = np.clip(np.asarray(floats[name], float), 0, 1) * full
            assert np.abs(np.asarray(picture, float) - expected).max() <= 0.5 + 1e-6 * full
            again = wild.render(100, map=name, dtype=dtype)
            assert np.array_equal(picture, again)


def test_maps_are_what_they_are_called(material: texforge.NoiseTexture) -> None:
    maps = material.render_maps((40, 50), dtype="float32")
    assert maps["basecolor"].encoding == "srgb"
    assert maps["height"].encoding == maps["normal_gl"].encoding == "data"
    assert maps["height"].shape == (40, 50)
    lengths = np.linalg.norm(2 * np.asarray(maps["normal_gl"], float) - 1, axis=-1)
    assert lengths == pytest.approx(1, abs=1e-5)
    values = material.at(middles((40, 50), 1.0, (0.0, 0.0)))
    assert np.array_equal(values[..., material.channels["height"]][..., 0], maps["height"])
    # The height is the red of the photo, and stays so.
    red, height = maps["basecolor"][..., 0], maps["height"]
    assert np.corrcoef(np.ravel(red), np.ravel(height))[0, 1] > 0.999


@hypothesis.given(seed=st.integers(0, 2**32), axes=st.sampled_from([2, 3]), normals=st.booleans())
def test_points_do_not_know_each_other(
    sand: texforge.NoiseTexture, seed: int, axes: int, normals: bool
) -> None:
    rng = np.random.default_rng(seed)
    # More than are computed at a time.
    points = rng.uniform(-300, 300, (9000 if axes == 2 else 4200, axes))
    directions = rng.normal(size=points.shape) if axes == 3 and normals else None
    points = points[:300] if directions is not None else points

    def at(chosen: Any) -> npt.NDArray[np.float32]:
        some = None if directions is None else directions[: len(points)][chosen]
        return sand.at(points[chosen], normals=some, threads=1)

    everything = sand.at(
        points, normals=None if directions is None else directions[: len(points)], threads=2
    )
    order = rng.permutation(len(points))
    assert np.array_equal(at(order), everything[order])
    assert np.array_equal(at(slice(17, 50)), everything[17:50])
    for i in rng.integers(0, len(points), 3):
        assert np.array_equal(at(slice(i, i + 1)), everything[i : i + 1])


def test_points_of_every_shape_and_type(sand: texforge.NoiseTexture) -> None:
    points = np.arange(48.0).reshape(2, 3, 4, 2)
    expected = sand.at(points)
    assert expected.shape == (2, 3, 4, 3)
    for same in (
        points.astype(np.float32),
        points.astype(np.int64),
        points.astype(">f8"),
        points.tolist(),
        np.asfortranarray(points),
        np.repeat(points, 2, axis=1)[:, ::2],
    ):
        assert np.array_equal(sand.at(same), expected)
    assert np.array_equal(sand.at(points[0, 0, 0]), expected[0, 0, 0])
    assert sand.at(np.zeros((0, 2))).shape == (0, 3)
    assert sand.at(np.zeros((5, 0, 3))).shape == (5, 0, 3)
    # Single floats are what they are, not what they were rounded from.
    near = np.array([[0.1, 0.7]])
    assert np.array_equal(sand.at(near.astype(np.float32)), sand.at(near.astype("f4").astype("f8")))


def test_one_normal_for_all_points(sand: texforge.NoiseTexture) -> None:
    points = np.random.default_rng(0).uniform(-50, 50, (40, 3))
    one = sand.at(points, normals=(0, 0, 2))
    assert np.array_equal(one, sand.at(points, normals=np.tile([0.0, 0.0, 1.0], (40, 1))))
    assert not np.allclose(one, sand.at(points, normals=(0, 1, 1)), atol=0.1 * one.std())
    assert not np.allclose(one, sand.at(points), atol=0.1 * one.std())


@pytest.mark.parametrize("threads", [1, 2, 8])
def test_the_same_bytes_for_any_number_of_threads(
    material: texforge.NoiseTexture, threads: int
) -> None:
    photo = grain(90, 130)
    fitted = texforge.fit_noise(photo, threads=threads)
    assert fitted == texforge.fit_noise(photo)
    points = np.random.default_rng(0).uniform(-1e4, 1e4, (10000, 2))
    space = np.random.default_rng(1).uniform(-100, 100, (5000, 3))
    results: list[Callable[[int | None], Any]] = [
        lambda n: material.at(points, threads=n),
        lambda n: material.at(space, threads=n),
        lambda n: material.at(space[:200], normals=space[200:400], threads=n),
        lambda n: material.solid((2, 20, 30), threads=n),
        lambda n: material.render((70, 60), scale=1.7, dtype="float32", threads=n),
        lambda n: material.render((70, 60), tileable=True, threads=n),
    ]
    for result in results:
        assert np.array_equal(result(threads), result(None))


@hypothesis.given(
    shape=st.tuples(st.integers(16, 70), st.integers(16, 70)),
    channels=st.sampled_from([None, 1, 2, 3, 4, 5]),
    dtype=st.sampled_from(["uint8", "uint16", "float32"]),
    seed=st.integers(0, 2**32 - 1),
    bands=st.sampled_from(["round", "square"]),
    histogram=st.sampled_from(["kept", "normal"]),
)
def test_documents_go_there_and_back_exactly(
    shape: tuple[int, int], channels: int | None, dtype: str, seed: int, bands: Any, histogram: Any
) -> None:
    photo = grain(*shape, channels, dtype, seed)
    texture = texforge.fit_noise(photo, seed=seed, bands=bands, histogram=histogram)
    text = texture.to_json()
    again = texforge.NoiseTexture.from_json(text)
    assert again == texture
    assert again.to_json() == text
    # Through Python's numbers, which are the same doubles.
    assert texforge.NoiseTexture.from_json(json.dumps(texture.document)) == texture
    assert hash(again) == hash(texture)
    points = np.random.default_rng(seed).uniform(-1e5, 1e5, (50, 2))
    assert np.array_equal(again.at(points), texture.at(points))


@hypothesis.given(
    numbers=st.lists(
        st.floats(-1e6, 1e6, allow_subnormal=True), min_size=3, max_size=3, unique=True
    )
)
def test_any_number_in_a_document_is_kept(
    sand: texforge.NoiseTexture, numbers: list[float]
) -> None:
    document = sand.document
    document["mean"] = numbers
    texture = texforge.NoiseTexture.from_json(json.dumps(document))
    assert texture.document["mean"] == numbers
    assert texforge.NoiseTexture.from_json(texture.to_json()) == texture


def test_pickles_copies_and_equality(sand: texforge.NoiseTexture) -> None:
    for again in (
        pickle.loads(pickle.dumps(sand)),  # noqa: S301 (our own)
        copy.copy(sand),
        copy.deepcopy(sand),
    ):
        assert again == sand
        assert hash(again) == hash(sand)
        assert again.report == sand.report
        assert np.array_equal(again.at([[1, 2]]), sand.at([[1, 2]]))
    other = texforge.fit_noise(grain(), seed=4)
    assert other != sand
    assert not np.array_equal(other.at([[1, 2]]), sand.at([[1, 2]]))
    assert sand != sand.to_json()


def test_saving_and_loading(sand: texforge.NoiseTexture, tmp_path: Path) -> None:
    path = tmp_path / "sand.json"
    sand.save(path)
    assert path.read_text(encoding="utf-8") == sand.to_json() + "\n"
    loaded = texforge.NoiseTexture.load(str(path))
    assert loaded == sand
    assert loaded.report == {}
    other = texforge.fit_noise(grain(seed=1))
    with pytest.raises(texforge.OutputExistsError):
        other.save(path)
    assert texforge.NoiseTexture.load(path) == sand
    other.save(path, overwrite=True)
    assert texforge.NoiseTexture.load(path) == other
    assert [p.name for p in tmp_path.iterdir()] == ["sand.json"]
    with pytest.raises(FileNotFoundError):
        texforge.NoiseTexture.load(tmp_path / "nowhere.json")
    with pytest.raises(texforge.FileError):
        texforge.NoiseTexture.load(tmp_path)
    with pytest.raises(texforge.FileError):
        sand.save(tmp_path / "nowhere" / "sand.json")
    with pytest.raises(texforge.ParameterError, match="path"):
        sand.save(3)  # type: ignore[arg-type]
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(texforge.ReadError, match=r"sand\.json.*text"):
        texforge.NoiseTexture.load(path)
    path.write_text(sand.to_json()[:-9], encoding="utf-8")
    with pytest.raises(texforge.DocumentError, match=r"sand\.json"):
        texforge.NoiseTexture.load(path)


@pytest.mark.parametrize("bands", ["round", "square"])
@pytest.mark.parametrize("size", [(64, 64), (100, 257), (33, 600)])
def test_tileable_pictures_go_round(bands: Any, size: tuple[int, int]) -> None:
    texture = texforge.fit_noise(grain(), bands=bands)
    picture = np.asarray(texture.render(size, tileable=True, dtype="float32"), float)
    for axis in (0, 1):
        steps = np.abs(np.diff(picture, axis=axis)).mean(axis=(1 - axis, 2))
        border = np.abs(np.roll(picture, 1, axis) - picture)
        border = border.take(0, axis).mean()
        # As large as the steps inside, which differ by chance.
        assert steps.min() * 0.8 < border < steps.max() * 1.25
        plain = np.asarray(texture.render(size, dtype="float32"), float)
        assert plain.std() == pytest.approx(picture.std(), rel=0.2)


@pytest.mark.parametrize("scale", [1.0, 0.5, 2.0])
def test_tileable_pictures_repeat(sand: texforge.NoiseTexture, scale: float) -> None:
    """A picture that is moved by its origin is the same one rolled."""
    options: dict[str, Any] = {"scale": scale, "tileable": True, "dtype": "float32"}
    height, width = 64, 96
    picture = np.asarray(sand.render((height, width), **options))
    moved = sand.render((height, width), origin=(16 * scale, -8 * scale), **options)
    assert np.allclose(np.roll(picture, (8, -16), (0, 1)), moved, atol=1e-5)
    whole = sand.render((height, width), origin=(3 * width * scale, -height * scale), **options)
    assert np.allclose(picture, whole, atol=1e-5)


@hypothesis.given(
    seed=st.integers(0, 2**32 - 1),
    bands=st.sampled_from(["round", "square"]),
    histogram=st.sampled_from(["kept", "normal"]),
    footprint=st.one_of(st.just(0.0), st.floats(0.5, 40)),
    keep_contrast=st.booleans(),
    far=st.sampled_from([100.0, 1e6]),
)
def test_values_are_those_of_the_naive_twin(
    seed: int, bands: Any, histogram: Any, footprint: float, keep_contrast: bool, far: float
) -> None:
    texture = texforge.fit_noise(grain(seed=seed % 3), bands=bands, histogram=histogram, seed=seed)
    points = np.random.default_rng(seed).uniform(-far, far, (200, 2))
    given: dict[str, Any] = {"footprint": footprint, "keep_contrast": keep_contrast}
    expected = naive_noise.values_at(texture.document, points, **given)
    assert np.abs(texture.at(points, **given) - expected).max() < 1e-5


@pytest.mark.parametrize("bands", ["round", "square"])
def test_values_in_space_are_those_of_the_naive_twin(bands: Any) -> None:
    texture = texforge.fit_noise(grain(), bands=bands, seed=11)
    rng = np.random.default_rng(0)
    points = rng.uniform(-200, 200, (300, 3))
    for footprint in (0.0, 3.3):
        expected = naive_noise.values_at(texture.document, points, footprint=footprint)
        assert np.abs(texture.at(points, footprint=footprint) - expected).max() < 1e-5
    normals = rng.normal(size=(60, 3))
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    expected = naive_noise.values_at(texture.document, points[:60], normals=unit)
    assert np.abs(texture.at(points[:60], normals=normals) - expected).max() < 1e-5


@pytest.mark.parametrize("angle", [0.0, 25.0, -135.5])
def test_oriented_values_are_those_of_the_naive_twin(
    sand: texforge.NoiseTexture, angle: float
) -> None:
    texture = oriented(sand, angle)
    points = np.random.default_rng(0).uniform(-300, 300, (300, 2))
    for footprint in (0.0, 1.5, 6.0):
        expected = naive_noise.values_at(texture.document, points, footprint=footprint)
        assert np.abs(texture.at(points, footprint=footprint) - expected).max() < 1e-5


def test_a_smaller_picture_is_filtered(sand: texforge.NoiseTexture) -> None:
    large = np.asarray(sand.render(512, dtype="float32"), float)
    averaged = large.reshape(64, 8, 64, 8, 3).mean((1, 3))
    small = np.asarray(sand.render(64, scale=8, dtype="float32"), float)
    # Not the same filter, but what remains is much the same.
    assert np.corrcoef(small.ravel(), averaged.ravel())[0, 1] > 0.7
    assert small.mean((0, 1)) == pytest.approx(large.mean((0, 1)), abs=0.005)
    assert small.std() < 0.6 * large.std()
    strong = np.asarray(sand.render(64, scale=8, keep_contrast=True, dtype="float32"), float)
    assert strong.std() == pytest.approx(large.std(), rel=0.15)
    # From far away it is of one colour, which contrast that is kept does not change.
    for keep_contrast in (False, True):
        far = sand.render(8, scale=1000, keep_contrast=keep_contrast, dtype="float32")
        assert np.ptp(far, axis=(0, 1)).max() < 1e-6
        assert far[0, 0] == pytest.approx(sand.document["mean"], abs=0.005)


def test_a_mask_keeps_out_what_it_marks() -> None:
    photo = grain()
    spoilt = photo.copy()
    spoilt[20:40, 30:60] = [255, 0, 255]
    mask = np.ones(photo.shape[:2], bool)
    mask[20:40, 30:60] = False
    texture = texforge.fit_noise(spoilt, mask=mask)
    assert texture.document["mean"] == pytest.approx((photo[mask] / 255).mean(0), abs=1e-5)
    opaque = np.dstack([spoilt, mask.astype(np.uint8) * 255])
    assert texforge.fit_noise(opaque) == texture
    assert texforge.fit_noise(opaque).report["notes"]


def test_progress_and_cancelling(sand: texforge.NoiseTexture) -> None:
    photo = grain()
    calls: list[Callable[[Any], Any]] = [
        lambda told: texforge.fit_noise(photo, progress=told),
        lambda told: sand.render(200, progress=told),
        lambda told: sand.render_maps(200, progress=told),
        lambda told: sand.solid(8, progress=told),
    ]
    for call in calls:
        seen: list[float] = []
        call(seen.append)
        assert seen[0] == 0
        assert seen[-1] == 1
        assert seen == sorted(seen)
        with pytest.raises(texforge.Cancelled):
            call(lambda _: False)


def test_morphing(sand: texforge.NoiseTexture) -> None:
    other = texforge.fit_noise(255 - grain(48, 96, seed=5), seed=3)
    assert sand.morph(other, 0) == sand
    assert sand.morph(other, 1) == other
    half = sand.morph(other, 0.5)
    means = np.add(sand.document["mean"], other.document["mean"]) / 2
    assert half.document["mean"] == pytest.approx(means, abs=1e-5)
    assert half.size == (56, 88)
    points = np.random.default_rng(0).uniform(-100, 100, (500, 2))
    steps = [sand.morph(other, t).at(points) for t in np.linspace(0, 0.99, 12)]
    moved = [float(np.abs(b - a).mean()) for a, b in itertools.pairwise(steps)]
    # Evenly: no step is a jump.
    assert max(moved) < 2 * statistics.median(moved)
    with pytest.raises(texforge.ParameterError, match="other"):
        sand.morph(texforge.fit_noise(grain(channels=None)), 0.5)
    with pytest.raises(texforge.ParameterError, match="other"):
        sand.morph(sand.to_json(), 0.5)  # type: ignore[arg-type]
    for t in (-0.1, 1.1, np.nan, "half", None):
        with pytest.raises(texforge.ParameterError, match=r"^`t` must be .+, got "):
            sand.morph(other, t)  # type: ignore[arg-type]


def test_editing(material: texforge.NoiseTexture) -> None:
    assert material.edit() == material
    assert material.edit(seed=9).seed == 9
    assert material.edit(seed=9).edit(seed=0) == material

    def rendered(texture: texforge.NoiseTexture, **options: Any) -> npt.NDArray[np.float64]:
        return np.asarray(texture.render(256, dtype="float32", **options), float)

    plain = rendered(material)
    softer = rendered(material.edit(contrast=0.5))
    middle = np.array(material.document["mean"][:3])
    assert softer == pytest.approx(middle + 0.5 * (plain - middle), abs=1e-5)
    grey = rendered(material.edit(saturation=0))
    assert np.ptp(grey, axis=2).max() < 1e-4
    assert rendered(material.edit(brightness=0.25)) == pytest.approx(plain + 0.25, abs=1e-5)
    height = rendered(material.edit(saturation=0, brightness=0.25), map="height")
    assert np.array_equal(height, rendered(material, map="height"))
    moved = material.edit(means={"height": 0.125, "basecolor": [0.5, 0.25, 0.75]})
    assert moved.document["mean"][:4] == [0.5, 0.25, 0.75, 0.125]
    without = rendered(material.edit(gains=[0, 0]))
    assert np.abs(np.diff(without, axis=1)).mean() < 0.5 * np.abs(np.diff(plain, axis=1)).mean()
    wide = material.edit(feature_size=2)
    weights = [d.document["model"]["wavelet"]["channels"][0]["weights"] for d in (wide, material)]
    assert len(weights[0]) == len(weights[1]) + 1
    assert "histogram" not in material.edit(histogram="normal").to_json()


def test_exporting(sand: texforge.NoiseTexture, tmp_path: Path) -> None:
    alternatives = typing.get_args(texforge.ExportTarget)
    targets = [typing.get_args(alternative)[0] for alternative in alternatives]
    assert targets == _texforge.export_targets()
    for target in targets:
        files = sand.export(target, name="beach")
        assert files
        assert files == sand.export(target, name="beach")
        assert all("beach" in name and data for name, data in files.items())
        folder = tmp_path / target
        with pytest.raises(FileNotFoundError):
            sand.export_to(folder, target, name="beach")
        folder.mkdir()
        written = sand.export_to(str(folder), target, name="beach")
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == files
        assert sorted(written) == sorted(folder.iterdir())
        with pytest.raises(texforge.OutputExistsError):
            sand.export_to(folder, target, name="beach")
        sand.export_to(folder, target, name="beach", overwrite=True)
    wrong: tuple[Any, ...] = ("cobol", "", 3, None)
    for target in wrong:
        with pytest.raises(texforge.ParameterError, match=r"^`target` must be .+, got "):
            sand.export(target)
    with pytest.raises(texforge.ParameterError, match="name"):
        sand.export("glsl", name=3)  # type: ignore[arg-type]


BAD_EDITS: dict[str, dict[str, Any]] = {
    "contrast": {"contrast": -1},
    "contrast nan": {"contrast": np.nan},
    "saturation": {"saturation": 11},
    "brightness": {"brightness": "dark"},
    "feature size": {"feature_size": 3},
    "feature size zero": {"feature_size": 0},
    "histogram": {"histogram": "flat"},
    "gain negative": {"gains": [-1]},
    "gain nan": {"gains": [np.nan]},
    "gains text": {"gains": "12"},
    "more gains than octaves": {"gains": [1] * 20},
    "mean of no map": {"means": {"roughness": 0.5}},
    "mean nan": {"means": {"height": np.nan}},
    "mean of two": {"means": {"basecolor": (0.5, 0.5)}},
    "means of no names": {"means": {3: 0.5}},
    "means a list": {"means": [0.5]},
    "mean text": {"means": {"height": "half"}},
    "seed": {"seed": 2**32},
    "seed text": {"seed": "a"},
}


@pytest.mark.parametrize("case", BAD_EDITS)
def test_bad_edits(material: texforge.NoiseTexture, case: str) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        material.edit(**BAD_EDITS[case])
    assert "\n" not in str(caught.value)


def test_what_was_edited_again_and_again_can_be_kept(sand: texforge.NoiseTexture) -> None:
    texture = sand
    for _ in range(12):
        try:
            texture = texture.edit(contrast=10, saturation=10, gains=[100])
        except texforge.ParameterError:
            break
        assert pickle.loads(pickle.dumps(texture)) == texture  # noqa: S301 (our own)


BAD_FITS: dict[str, dict[str, Any]] = {
    "bands": {"bands": "hexagonal"},
    "weights": {"weights": None},
    "histogram": {"histogram": "equal"},
    "seed negative": {"seed": -1},
    "seed too large": {"seed": 2**32},
    "seed float": {"seed": 1.0},
    "threads": {"threads": 1025},
    "encoding": {"encoding": "gamma"},
    "progress": {"progress": 3},
    "a map's name": {"maps": {3: noise()}},
    "a map called like the photo": {"maps": {"basecolor": grain()}},
    "too many channels": {"maps": {"data": np.zeros((64, 80, 30), np.uint8)}},
}


@pytest.mark.parametrize("case", BAD_FITS)
def test_bad_arguments_of_a_fit(case: str) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        texforge.fit_noise(grain(), **BAD_FITS[case])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("photo", "kind"),
    [
        (np.full((64, 64, 3), 7, np.uint8), "bad_picture"),
        (np.full((64, 64), 0.25, np.float32), "bad_picture"),
        (noise(1, 1), "too_small"),
        (noise(15, 100), "too_small"),
        (noise(100, 15), "too_small"),
        (np.full((64, 64), np.nan), "not_finite"),
        (np.full((64, 64), np.inf), "not_finite"),
        (np.zeros((64, 64), np.int32), "bad_picture"),
        (np.zeros((0, 64), np.uint8), "bad_picture"),
        (np.zeros((4, 64, 64, 3), np.uint8), "bad_picture"),
        (np.zeros((64, 64, 4), np.uint8), "empty_mask"),
        ("sand.png", "bad_picture"),
        (None, "bad_picture"),
    ],
)
def test_photos_that_cannot_be_fitted(photo: Any, kind: str) -> None:
    with pytest.raises(texforge.PictureError) as caught:
        texforge.fit_noise(photo)
    assert caught.value.kind == kind
    assert "\n" not in str(caught.value)


def test_masks_and_maps_that_do_not_fit() -> None:
    photo = grain()
    for options, kind in (
        ({"mask": np.ones((3, 4), bool)}, "size_mismatch"),
        ({"mask": np.zeros(photo.shape[:2], bool)}, "empty_mask"),
        ({"maps": {"height": grain(32, 40, 1)}}, "size_mismatch"),
        ({"maps": {"height": np.full((64, 80), np.nan)}}, "not_finite"),
        ({"maps": {"height": "height.png"}}, "bad_picture"),
    ):
        with pytest.raises(texforge.PictureError) as caught:
            texforge.fit_noise(photo, **options)
        assert caught.value.kind == kind
        assert "\n" not in str(caught.value)


BAD_POINTS: dict[str, tuple[Any, dict[str, Any]]] = {
    "nan": ([[0.0, np.nan]], {}),
    "infinite": ([[np.inf, 0.0]], {}),
    "far away": ([[1.1e9, 0.0]], {}),
    "nan in space": ([[0.0, 0.0, np.nan]], {}),
    "one axis": ([[1.0], [2.0]], {}),
    "four axes": (np.zeros((3, 4)), {}),
    "a number": (3.0, {}),
    "nothing": (None, {}),
    "no point": ([], {}),
    "text": ("origin", {}),
    "text in a list": ([["a", "b"]], {}),
    "complex": (np.zeros((3, 2), complex), {}),
    "bool": (np.zeros((3, 2), bool), {}),
    "ragged": ([[1, 2], [3]], {}),
    "footprint negative": ([[0, 0]], {"footprint": -1}),
    "footprint nan": ([[0, 0]], {"footprint": np.nan}),
    "footprint huge": ([[0, 0]], {"footprint": 1e7}),
    "footprint text": ([[0, 0]], {"footprint": "wide"}),
    "normals on the plane": ([[0, 0]], {"normals": [[0, 0, 1]]}),
    "normals of two axes": ([[0, 0, 0]], {"normals": [[0, 1]]}),
    "too many normals": ([[0, 0, 0]], {"normals": np.ones((2, 3))}),
    "a normal without length": ([[0, 0, 0]], {"normals": [0, 0, 0]}),
    "a normal that is nan": ([[0, 0, 0]], {"normals": [0, 0, np.nan]}),
    "threads": ([[0, 0]], {"threads": -1}),
}


@pytest.mark.parametrize("case", BAD_POINTS)
def test_bad_points(sand: texforge.NoiseTexture, case: str) -> None:
    points, options = BAD_POINTS[case]
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        sand.at(points, **options)
    assert "\n" not in str(caught.value)


BAD_PICTURES: dict[str, dict[str, Any]] = {
    "size zero": {"size": 0},
    "size negative": {"size": (10, -1)},
    "size huge": {"size": 65537},
    "size that overflows": {"size": 2**64},
    "size of three": {"size": (1, 2, 3)},
    "size float": {"size": 10.0},
    "size text": {"size": "10x10"},
    "scale zero": {"scale": 0},
    "scale nan": {"scale": np.nan},
    "scale huge": {"scale": 1e9},
    "scale text": {"scale": "large"},
    "origin nan": {"origin": (0, np.nan)},
    "origin far": {"origin": (1e10, 0)},
    "origin of three": {"origin": (0, 0, 0)},
    "origin a number": {"origin": 0},
    "dtype": {"dtype": "float64"},
    "dtype class": {"dtype": np.uint8},
    "map": {"map": "roughness"},
    "map number": {"map": 1},
    "threads": {"threads": 1025},
    "progress": {"progress": 3},
}


@pytest.mark.parametrize("case", BAD_PICTURES)
def test_bad_pictures(sand: texforge.NoiseTexture, case: str) -> None:
    options = {"size": 16, **BAD_PICTURES[case]}
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        sand.render(**options)
    assert "\n" not in str(caught.value)
    if "dtype" in case or "map" in case:
        return
    shape = options.pop("size")
    shape = (*shape, 4, 5) if case == "size of three" else shape
    if case != "origin of three":
        options.setdefault("origin", (0.0, 0.0, 0.0))
        with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got "):
            sand.solid(shape, **options)


def test_turned_directions_neither_tile_nor_have_a_third_axis(
    sand: texforge.NoiseTexture,
) -> None:
    texture = oriented(sand, 30.0)
    with pytest.raises(texforge.ParameterError, match="tileable"):
        texture.render(64, tileable=True)
    with pytest.raises(texforge.ParameterError, match="points"):
        texture.at([[0, 0, 0]])
    with pytest.raises(texforge.ParameterError, match="shape"):
        texture.solid(4)
    assert oriented(sand, 0.0).render(64, tileable=True).shape == (64, 64, 3)


def test_what_exceeds_memory_is_refused_at_once(sand: texforge.NoiseTexture) -> None:
    with pytest.raises(texforge.OutOfMemory):
        sand.render(65536, dtype="float32")
    with pytest.raises(texforge.OutOfMemory):
        sand.solid(65536)


def changed(path: tuple[str | int, ...], value: Any) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        place: Any = document
        for step in path[:-1]:
            place = place[step]
        place[path[-1]] = value

    return change


INNER = ("model", "wavelet")
DAMAGE: dict[str, Callable[[dict[str, Any]], object]] = {
    "a later version": changed(("version",), 2),
    "version 0": changed(("version",), 0),
    "version text": changed(("version",), "1"),
    "version fraction": changed(("version",), 1.5),
    "another format": changed(("format",), "other-noise"),
    "no format": lambda d: d.pop("format"),
    "a field more": changed(("comment",), "hello"),
    "a field less": lambda d: d.pop("mean"),
    "seed negative": changed(("seed",), -1),
    "seed large": changed(("seed",), 2**32),
    "size zero": changed(("size",), [0, 64]),
    "size huge": changed(("size",), [2**20, 64]),
    "size of three": changed(("size",), [1, 2, 3]),
    "no maps": changed(("maps",), []),
    "kind": changed(("maps", 0, "kind"), "smell"),
    "encoding": changed(("maps", 0, "encoding"), "gamma"),
    "two maps of one name": lambda d: d.update(
        maps=[{**d["maps"][0], "channels": n} for n in (1, 2)]
    ),
    "no channels": changed(("maps", 0, "channels"), 0),
    "channels overflow": changed(("maps", 0, "channels"), 2**63),
    "more channels": changed(("maps", 0, "channels"), 4),
    "mean short": changed(("mean",), [0.5]),
    "mean text": changed(("mean",), ["a", "b", "c"]),
    "mean huge": changed(("mean",), [1e300, 0.0, 0.0]),
    "mean null": changed(("mean",), [None, 0.0, 0.0]),
    "matrix ragged": changed(("matrix", 1), [1.0]),
    "matrix not square": changed(("matrix",), [[1.0, 0.0, 0.0]]),
    "bands": changed((*INNER, "bands"), "triangular"),
    "no independent channel": changed((*INNER, "channels"), []),
    "weight negative": changed((*INNER, "channels", 0, "weights", 0), -0.5),
    "weights short": changed((*INNER, "channels", 1, "weights"), [0.5]),
    "histogram falls": changed((*INNER, "channels", 0, "histogram", 3), 5.0),
    "histogram short": changed((*INNER, "channels", 0, "histogram"), [0.0, 1.0]),
    "too many bands": lambda d: [
        c.update(weights=[0.1] * 300) for c in d["model"]["wavelet"]["channels"]
    ],
    "model": changed(("model",), {"perlin": {}}),
    "two models": changed(("model", "oriented"), {}),
    "score text": changed(("score", "fit"), "good"),
}


@pytest.mark.parametrize("case", DAMAGE)
def test_damaged_documents(sand: texforge.NoiseTexture, case: str) -> None:
    document = sand.document
    DAMAGE[case](document)
    with pytest.raises(texforge.DocumentError, match="no procedural texture") as caught:
        texforge.NoiseTexture.from_json(json.dumps(document))
    assert isinstance(caught.value, ValueError)
    assert caught.value.kind == "document"
    assert caught.value.fields["reason"]
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["", " ", "{}", "[]", "null", "[" * 100_000, "{" * 300, "\x00", "é", "\ud800", "NaN"]
)
def test_texts_that_are_no_documents(text: str) -> None:
    with pytest.raises(texforge.DocumentError) as caught:
        texforge.NoiseTexture.from_json(text)
    assert "\n" not in str(caught.value)


def test_numbers_that_json_has_not(sand: texforge.NoiseTexture) -> None:
    text = sand.to_json()
    first = text.index('"mean":[') + len('"mean":[')
    rest = text[text.index(",", first) :]
    for number in ("NaN", "Infinity", "-Infinity", "1e999", "1e7", '"0.5"', "0x1"):
        with pytest.raises(texforge.DocumentError):
            texforge.NoiseTexture.from_json(text[:first] + number + rest)


@hypothesis.given(data=st.data())
def test_cut_and_garbled_documents_never_panic(
    sand: texforge.NoiseTexture, data: st.DataObject
) -> None:
    text = sand.to_json()
    start = data.draw(st.integers(0, len(text) - 1))
    length = data.draw(st.integers(0, 8))
    filling = data.draw(st.text('0123456789-+.eE"[]{},:naulb ', max_size=8))
    garbled = text[:start] + filling + text[start + length :]
    try:
        texture = texforge.NoiseTexture.from_json(garbled)
    except texforge.DocumentError as error:
        assert "\n" not in str(error)  # noqa: PT017 (either is right)
    else:
        assert np.isfinite(texture.at([[0.0, 0.0], [12.3, 4.5]])).all()


def test_arguments_that_are_no_text(tmp_path: Path) -> None:
    wrong: tuple[Any, ...] = (None, 3, b"{}", {}, tmp_path)
    for text in wrong:
        with pytest.raises(texforge.ParameterError, match="text"):
            texforge.NoiseTexture.from_json(text)


def test_the_words_of_the_core_are_those_of_the_types() -> None:
    with pytest.raises(texforge.ParameterError, match="dtype"):
        _texforge.fit_noise(
            maps=[("a", (grain().ravel(), "uint8", (64, 80, 3), "srgb"), "color")],
            mask=None,
            params=[],
            seed=0,
            threads=1,
            progress=None,
        )[0].render(
            size=(4, 4),
            scale=1.0,
            origin=[0.0, 0.0],
            tileable=False,
            keep_contrast=False,
            dtype="int8",
            only=None,
            threads=1,
            progress=None,
        )
