"""Near-regular textures through Python. How they are put together is tested in Rust."""

from __future__ import annotations

import copy
import json
import pickle
import re
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

COPIED: dict[str, Any] = {"feather": 0, "flatten": 0}
"""Settings with which every pixel is a copy of one of the photo's."""

Vectors = tuple[tuple[float, float], tuple[float, float]]
TRUE: Vectors = ((28, 0), (14, 16))
"""The lattice of `bricks`."""


def bricks(
    dtype: str = "uint8",
    channels: int | None = 3,
    seed: int = 0,
    shape: tuple[int, int] = (96, 112),
) -> npt.NDArray[Any]:
    """Return bricks of 28 x 16 pixels in running bond: each of its own colour, with grain."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]]
    course = y // 16
    along = x + course % 2 * 14
    count = 1 if channels is None else channels
    colors = rng.uniform(0.25, 0.5, (course.max() + 1, along.max() // 28 + 1, count))
    unit = colors[course, along // 28]
    unit[(y % 16 < 3) | (along % 28 < 3)] = 0.8
    unit += rng.uniform(-0.06, 0.06, unit.shape)
    if channels in (2, 4):
        unit[..., -1] = 1
    full = np.iinfo(dtype).max if dtype[0] == "u" else 1
    wall: npt.NDArray[Any] = (unit * full).astype(dtype)
    return wall[..., 0] if channels is None else wall


@pytest.fixture(scope="module")
def wall() -> npt.NDArray[Any]:
    """Return an RGB wall of 96 x 112 pixels."""
    return bricks()


def picked(photo: npt.NDArray[Any], texture: texforge.Regular) -> npt.NDArray[Any]:
    """Return what the source map names."""
    y, x = np.moveaxis(texture.source_map, -1, 0)
    return np.asarray(photo[y, x])


def off_phase(texture: texforge.Regular) -> npt.NDArray[np.float64]:
    """Return by how many pixels each pixel came from another place of a brick than it is at."""
    height, width = texture.source_map.shape[:2]
    y, x = np.mgrid[:height, :width]
    # The texture starts in the photo's own phase.
    moved = np.stack([texture.source_map[..., 1] - x, texture.source_map[..., 0] - y], axis=-1)
    whole = np.rint(moved @ np.linalg.inv(TRUE))
    return np.asarray(np.linalg.norm(moved - whole @ TRUE, axis=-1))


def in_lattice(vectors: Any) -> bool:
    """Return whether displacements lead from bricks to bricks, within half a pixel."""
    whole = np.rint(np.array(vectors) @ np.linalg.inv(TRUE))
    return bool(np.abs(whole @ TRUE - vectors).max() < 0.5)


def test_a_texture_continues_the_photos_pattern(wall: npt.NDArray[Any]) -> None:
    texture = texforge.regular(wall, size=(150, 180), straighten="off", **COPIED)
    assert texture.image.shape == (150, 180, 3)
    assert texture.image.dtype == np.uint8
    assert np.array_equal(texture.image, picked(wall, texture))
    assert texture.confidence is not None
    assert texture.confidence > 0.5
    assert texture.photo_size == (96, 112)
    assert texture.encoding == "srgb"
    assert texture.lattice is not None
    whole = np.array(texture.lattice) @ np.linalg.inv(TRUE)
    assert whole == pytest.approx(np.rint(whole), abs=0.02)
    assert texture.lattice_of_texture is not None
    assert np.array(texture.lattice_of_texture) == pytest.approx(np.array(texture.lattice))
    # Less than what would take brick for mortar: the tolerance, and vectors that are a little off.
    assert off_phase(texture).max() < 3 * 2**0.5 + 2
    again = texforge.detect_lattice(texture.image)
    assert again.found
    assert in_lattice([again.v1, again.v2])
    # Drawn at random, not the photo repeated.
    moved = texture.source_map - np.moveaxis(np.indices((150, 180)), 0, -1)
    assert len(np.unique(moved.reshape(-1, 2), axis=0)) > 20


@hypothesis.given(
    dtype=st.sampled_from(["uint8", "uint16", "float16", "float32", "float64"]),
    channels=st.sampled_from([None, 1, 2, 3, 4, 5]),
    size=st.tuples(st.integers(1, 150), st.integers(1, 150)),
    seam=st.sampled_from(["graph", "cut"]),
    matching=st.sampled_from(["color", "correlation"]),
    seed=st.integers(0, 2**16),
)
def test_every_pixel_is_one_of_the_photos(
    dtype: str, channels: int | None, size: tuple[int, int], seam: Any, matching: Any, seed: int
) -> None:
    photo = bricks(dtype, channels, seed)
    texture = texforge.regular(
        photo, size=size, lattice=TRUE, seam=seam, matching=matching, seed=seed, **COPIED
    )
    assert texture.image.dtype == photo.dtype
    assert texture.image.shape == (*size, *photo.shape[2:])
    assert texture.image.tobytes() == picked(photo, texture).tobytes()


@hypothesis.given(
    dtype=st.sampled_from(["uint8", "uint16", "float16", "float32", "float64"]),
    channels=st.sampled_from([None, 1, 2, 3, 4, 5]),
    seam=st.sampled_from(["graph", "cut", "linear"]),
    feather=st.integers(0, 20),
    deform=st.integers(0, 4),
    tileable=st.sampled_from(["none", "both", "x", "y"]),
)
def test_mixed_pixels_are_between_the_photos(
    dtype: str, channels: int | None, seam: Any, feather: int, deform: int, tileable: Any
) -> None:
    photo = bricks(dtype, channels)
    texture = texforge.regular(
        photo, lattice=TRUE, seam=seam, feather=feather, deform=deform, tileable=tileable, flatten=0
    )
    assert texture.image.dtype == photo.dtype
    assert texture.image.shape == photo.shape
    low, high = photo.min(axis=(0, 1)), photo.max(axis=(0, 1))
    rounding = 0 if dtype[0] == "u" else float(np.finfo(dtype).eps)
    assert (texture.image >= low - rounding).all()
    assert (texture.image <= high + rounding).all()
    copied = (texture.image == picked(photo, texture)).mean()
    assert (copied == 1) == (feather == 0 and seam != "linear")


@pytest.mark.parametrize("lattice", ["auto", "none", TRUE])
@pytest.mark.parametrize("tileable", ["none", "both"])
def test_same_bytes_for_any_number_of_threads_and_every_run(
    wall: npt.NDArray[Any], lattice: Any, tileable: Any
) -> None:
    options: dict[str, Any] = {"size": (192, 224), "lattice": lattice, "tileable": tileable}
    textures = [
        texforge.regular(wall, threads=threads, seed=7, **options) for threads in (1, 2, 5, 5, None)
    ]
    assert len({texture.image.tobytes() for texture in textures}) == 1
    assert len({texture.source_map.tobytes() for texture in textures}) == 1
    other = texforge.regular(wall, seed=2**64 - 1, **options)
    assert other.seed == 2**64 - 1
    assert other.image.tobytes() != textures[0].image.tobytes()


@pytest.mark.parametrize("tileable", ["none", "both", "x", "y"])
def test_bricks_are_whole_over_the_edges_that_repeat(tileable: Any) -> None:
    # So that every edge runs through bricks.
    photo = np.roll(bricks(), 8, axis=0)
    y, x = np.mgrid[-8:88, :112]
    inside = (y % 16 > 3) & ((x + y // 16 % 2 * 14) % 28 > 3)
    steps = np.zeros((2, 96, 112))
    for seed in range(5):
        texture = texforge.regular(photo, tileable=tileable, lattice=TRUE, seed=seed, **COPIED)
        assert texture.image.shape == photo.shape
        assert off_phase(texture).max() < 3 * 2**0.5 + 2
        image = texture.image.astype(np.float64)
        for axis in (0, 1):
            steps[axis] += abs(image - np.roll(image, 1, axis)).mean(axis=2)
    for axis, wraps in enumerate((tileable in ("both", "y"), tileable in ("both", "x"))):
        pairs = inside & np.roll(inside, 1, axis)
        used = pairs.any(axis=1 - axis)
        assert used[0]
        lines = steps[axis].sum(axis=1 - axis, where=pairs)[used] / pairs.sum(axis=1 - axis)[used]
        # Bricks differ in colour: where halves of two were put together it shows.
        assert (lines[0] < 1.4 * np.median(lines)) == wraps, (axis, lines[0], np.median(lines))


def test_a_repeating_texture_has_the_lattice_shifted_or_not(wall: npt.NDArray[Any]) -> None:
    texture = texforge.regular(wall, size=(192, 224), tileable="both", **COPIED)
    assert texture.lattice_of_texture is not None
    assert in_lattice(texture.lattice_of_texture)
    for shift in (0, 50, 100):
        found = texforge.detect_lattice(np.roll(texture.image, (shift, shift), (0, 1)))
        assert found.found
        assert in_lattice([found.v1, found.v2])


def test_the_default_size_of_what_repeats_is_whole_periods() -> None:
    photo = bricks(shape=(100, 120))
    texture = texforge.regular(photo, tileable="both", lattice=TRUE)
    height, width = texture.image.shape[:2]
    assert texture.lattice_of_texture is not None
    per = np.array([[width, 0], [0, height]]) @ np.linalg.inv(texture.lattice_of_texture)
    assert per == pytest.approx(np.rint(per), abs=1e-6)
    assert abs(height - 100) <= 16
    assert abs(width - 120) <= 14
    across = texforge.regular(photo, tileable="x", lattice=TRUE)
    assert across.image.shape[:2] == (100, width)


def test_a_lattice_can_be_given(wall: npt.NDArray[Any]) -> None:
    given = texforge.regular(wall, lattice=TRUE)
    assert given.confidence is None
    assert given.lattice is not None
    assert in_lattice(given.lattice)
    assert abs(np.linalg.det(given.lattice)) == pytest.approx(28 * 16)
    found = texforge.detect_lattice(wall)
    followed = texforge.regular(wall, lattice=found)
    assert followed.confidence is None
    assert followed.lattice == (found.v1, found.v2)
    alone = texforge.regular(wall)
    assert alone.confidence == found.confidence
    assert alone.image.tobytes() == followed.image.tobytes()
    unsure = texforge.detect_lattice(wall, min_confidence=1)
    assert not unsure.found
    assert texforge.regular(wall, lattice=unsure).image.tobytes() == alone.image.tobytes()


def test_params_can_be_given_again(wall: npt.NDArray[Any]) -> None:
    cases: tuple[dict[str, Any], ...] = (
        {"tileable": "both"},
        {"lattice": "none", "matching": "correlation"},
        {"lattice": TRUE, "size": 70, "seam": "linear", "flatten": 0.3},
    )
    for options in cases:
        one = texforge.regular(wall, seed=3, **options)
        again = texforge.regular(wall, seed=3, **one.params)
        assert again.image.tobytes() == one.image.tobytes()
        assert again.params == one.params
        assert one.params["tileable"] == options.get("tileable", "none")
    assert texforge.regular(wall, size=70).params["size"] == (70, 70)


@hypothesis.given(
    size=st.tuples(st.integers(20, 90), st.integers(20, 90)),
    tileable=st.sampled_from(["none", "both", "x", "y"]),
    seed=st.integers(0, 2**16),
)
def test_without_a_lattice_any_size_does(size: tuple[int, int], tileable: Any, seed: int) -> None:
    photo = noise(48, 64, seed=seed)
    texture = texforge.regular(
        photo, lattice="none", size=size, tileable=tileable, seed=seed, **COPIED
    )
    assert texture.image.shape[:2] == size
    assert (texture.lattice, texture.lattice_of_texture, texture.confidence) == (None, None, None)
    assert texture.image.tobytes() == picked(photo, texture).tobytes()
    assert "no lattice" in repr(texture)


def test_maps_follow(wall: npt.NDArray[Any]) -> None:
    height = np.random.default_rng(1).integers(0, 65536, (96, 112), dtype=np.uint16)
    small = np.random.default_rng(2).random((48, 56)).astype(np.float32)
    texture = texforge.regular(wall, maps={"height": height, "roughness": small}, **COPIED)
    assert np.array_equal(texture.maps["height"], picked(height, texture))
    assert np.array_equal(texture.maps["height"], texture.apply(height))
    assert np.array_equal(texture.maps["height"], texforge.apply(texture, height))
    assert np.array_equal(texture.maps["roughness"], texture.apply(small))
    assert texture.maps["roughness"].dtype == np.float32
    # Mixed as the picture is: a map that is the photo becomes the texture.
    mixed = texforge.regular(wall, maps={"base color": wall, "height": wall[..., 0]}, flatten=0)
    assert np.array_equal(mixed.maps["base color"], mixed.image)
    assert not np.array_equal(mixed.apply(wall, kind="color"), mixed.image)
    assert np.array_equal(mixed.apply(wall, kind="color"), picked(wall, mixed))
    normals = np.random.default_rng(3).normal(0, 1, (96, 112, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    mixed = texforge.regular(wall, maps={"normal": normals / 2 + 0.5}, feather=20)
    assert np.linalg.norm(mixed.maps["normal"] * 2 - 1, axis=2) == pytest.approx(1)


def test_a_lattice_between_pixels_is_followed_there(tmp_path: Path) -> None:
    def waves(height: int, width: int) -> npt.NDArray[Any]:
        y, x = np.mgrid[:height, :width]
        across, down = x / 20.37, y / 17.63
        shape = np.sin(2 * np.pi * across) + np.cos(2 * np.pi * (down + across))
        values: npt.NDArray[Any] = (0.5 + 0.2 * shape).astype(np.float32)
        return values

    options: dict[str, Any] = {
        "size": (150, 170),
        "lattice": ((20.37, 0), (0, 17.63)),
        "straighten": "off",
        "tolerance": 0,
        "encoding": "linear",
        **COPIED,
    }
    photo, wanted = waves(130, 140), waves(150, 170)
    copied = texforge.regular(photo, **options)
    between = texforge.regular(photo, **options, subpixel="on", maps={"height": photo})
    off, near = (np.abs(t.image - wanted).max() for t in (copied, between))
    assert near < 0.01 < 0.05 < off
    assert np.array_equal(between.maps["height"], between.image)
    again = texforge.regular(photo, **between.params, seed=0, encoding="linear")
    assert np.array_equal(again.image, between.image)
    # The file has the same bytes; a source map of whole pixels cannot say where they are.
    path = tmp_path / "between.exr"
    texforge.regular_to_file(photo, path, **options, subpixel="on")
    assert np.array_equal(texforge.read_image(path), between.image)
    assert np.array_equal(copied.apply(photo), copied.image)
    for refused in (
        lambda: between.apply(photo),
        lambda: texforge.apply(between, photo),
        lambda: between.save_source_map(tmp_path / "map.exr"),
    ):
        with pytest.raises(texforge.ParameterError, match="`subpixel`"):
            refused()


def test_no_masked_pixel_is_used(wall: npt.NDArray[Any]) -> None:
    mask = np.ones((96, 112), bool)
    mask[:20, :20] = False
    spoilt = wall.copy()
    spoilt[~mask] = noise(96, 112)[~mask]
    # The lattice is given: looking for one looks at all of the photo.
    clean, dirty = (texforge.regular(p, mask=mask, lattice=TRUE, feather=0) for p in (wall, spoilt))
    assert mask[tuple(np.moveaxis(clean.source_map, -1, 0))].all()
    assert clean.source_map.tobytes() == dirty.source_map.tobytes()
    clear = np.dstack([wall, np.where(mask, 255, 0).astype(np.uint8)])
    texture = texforge.regular(clear, lattice=TRUE, feather=0)
    assert mask[tuple(np.moveaxis(texture.source_map, -1, 0))].all()


def test_data_is_left_as_it_is(wall: npt.NDArray[Any]) -> None:
    data = wall.astype(np.float32) * 3 - 200
    texture = texforge.regular(data, encoding="data", feather=0)
    assert texture.params["flatten"] == 0
    assert texture.encoding == "data"
    assert np.array_equal(texture.image, picked(data, texture))


def test_files_say_how_it_was_made(wall: npt.NDArray[Any], tmp_path: Path) -> None:
    texture = texforge.regular(wall, seed=5, **COPIED)
    texture.save(tmp_path / "wall.png")
    assert np.array_equal(texforge.read_image(tmp_path / "wall.png"), texture.image)
    text = (tmp_path / "wall.png").read_bytes().decode("latin-1")
    found = re.search(r'\{.*"verb":"regular".*?\}', text)
    assert found is not None
    record = json.loads(found[0])
    assert (record["tool"], record["verb"], record["seed"]) == ("texforge", "regular", 5)
    assert record["params"]["block"] == texture.params["block"]
    assert record["params"]["feather"] == 0
    assert record["params"]["size"] == "112x96"
    assert record["params"]["lattice"].count(",") == 3
    with pytest.raises(texforge.OutputExistsError):
        texture.save(tmp_path / "wall.png")
    texture.save(tmp_path / "wall.png", overwrite=True)
    texture.save_source_map(tmp_path / "wall.exr")
    loaded = texforge.load_source_map(tmp_path / "wall.exr")
    assert np.array_equal(loaded.apply(wall, kind="color"), texture.image)


def test_a_texture_shows_itself_and_can_be_copied(wall: npt.NDArray[Any], tmp_path: Path) -> None:
    shapes = {"none": (96, 112), "both": (192, 224), "x": (96, 224), "y": (192, 112)}
    ways: list[Any] = list(shapes)
    for tileable in ways:
        texture = texforge.regular(wall, tileable=tileable, lattice=TRUE)
        png = texture._repr_png_()
        assert png is not None
        (tmp_path / "shown.png").write_bytes(png)
        assert texforge.read_image(tmp_path / "shown.png").shape[:2] == shapes[tileable]
        assert repr(texture).startswith("Regular(96 x 112 uint8, lattice (")
        assert texture.tiled(2, 3).shape == (192, 336, 3)
        for twin in (copy.deepcopy(texture), pickle.loads(pickle.dumps(texture))):  # noqa: S301
            assert np.array_equal(twin.image, texture.image)
            assert twin.params == texture.params
    assert texforge.regular(bricks("uint8", 5), lattice=TRUE)._repr_png_() is None


def test_a_texture_can_be_measured_and_not_changed(wall: npt.NDArray[Any]) -> None:
    texture = texforge.regular(wall)
    cost = texforge.texture_cost(texture, wall, axis="x", patch=5, samples=50)
    assert cost == texforge.texture_cost(texture.image, wall, axis="x", patch=5, samples=50)
    assert cost.mean > 0
    with pytest.raises(AttributeError):
        texture.seed = 3  # type: ignore[misc]


def test_progress_and_cancelling(wall: npt.NDArray[Any]) -> None:
    shares: list[float] = []
    texture = texforge.regular(wall, size=400, progress=shares.append)
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert texture.image.tobytes() == texforge.regular(wall, size=400).image.tobytes()
    with pytest.raises(texforge.Cancelled):
        texforge.regular(wall, size=1000, progress=lambda _: False)
    with pytest.raises(ZeroDivisionError):
        texforge.regular(wall, size=1000, progress=lambda _: 1 / 0)


BAD: dict[str, dict[str, Any]] = {
    "size zero": {"size": 0},
    "size of three": {"size": (1, 2, 3)},
    "size text": {"size": "64x64"},
    "size too large": {"size": (2**20 + 1, 5)},
    "no whole number of periods": {"size": (100, 112), "tileable": "both", "lattice": TRUE},
    "less than a period": {"size": (96, 10), "tileable": "x", "lattice": TRUE},
    "tileable": {"tileable": "z"},
    "tileable nothing": {"tileable": None},
    "a lattice of nothing": {"lattice": None},
    "a word that is no lattice": {"lattice": "square"},
    "one displacement": {"lattice": (28, 0)},
    "three displacements": {"lattice": ((28, 0), (14, 16), (3, 3))},
    "displacements of three": {"lattice": ((28, 0, 0), (14, 16, 0))},
    "displacements of text": {"lattice": (("a", 0), (14, 16))},
    "displacements of nan": {"lattice": ((float("nan"), 0), (14, 16))},
    "endless displacements": {"lattice": ((float("inf"), 0), (14, 16))},
    "parallel displacements": {"lattice": ((28, 14), (-14, -7))},
    "no displacement": {"lattice": ((0, 0), (14, 16))},
    "longer than half the photo": {"lattice": ((57, 0), (0, 16))},
    "a displacement below 2 pixels": {"lattice": ((1, 0), (0, 16))},
    "min_confidence": {"min_confidence": 1.5},
    "straighten": {"straighten": True},
    "block too small": {"block": 7},
    "block negative": {"block": -8},
    "block fraction": {"block": 30.5},
    "border zero": {"border": 0},
    "border more than half a block": {"block": 20, "border": 11},
    "sample candidates": {"sample_candidates": 0},
    "candidates": {"candidates": 0},
    "candidates too many": {"candidates": 65537},
    "tolerance": {"tolerance": 65},
    "subpixel": {"subpixel": True},
    "matching": {"matching": "colour"},
    "deform": {"deform": 9},
    "seam": {"seam": "none"},
    "feather": {"feather": 65},
    "feather negative": {"feather": -1},
    "flatten": {"flatten": 1.5},
    "flatten too little": {"flatten": 0.001},
    "flatten nan": {"flatten": float("nan")},
    "flatten negative": {"flatten": -0.2},
    "flatten of data": {"flatten": 0.2, "encoding": "data"},
    "seed": {"seed": -1},
    "threads": {"threads": 1025},
    "encoding": {"encoding": "gamma"},
    "progress": {"progress": 3},
    "maps": {"maps": {3: noise()}},
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arguments(wall: npt.NDArray[Any], case: str) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        texforge.regular(wall, **BAD[case])
    assert caught.value.kind == "parameter"
    assert "\n" not in str(caught.value)


def test_a_size_that_does_not_repeat_says_which_does(wall: npt.NDArray[Any]) -> None:
    with pytest.raises(texforge.ParameterError, match="a width of 120") as caught:
        texforge.regular(wall, size=(96, 120), tileable="x", lattice=TRUE)
    wanted = re.search(r"(\d+) does", str(caught.value))
    assert wanted is not None
    width = int(wanted[1])
    texture = texforge.regular(wall, size=(96, width), tileable="x", lattice=TRUE)
    assert texture.image.shape[:2] == (96, width)


def test_what_has_no_lattice_is_refused() -> None:
    with pytest.raises(texforge.NoStructureError, match="lattice") as caught:
        texforge.regular(noise(96, 128))
    assert caught.value.kind == "no_structure"
    assert isinstance(caught.value, ValueError)
    assert caught.value.fields["confidence"] < caught.value.fields["least"] == 0.5
    assert "`lattice` none" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("photo", "options", "kind"),
    [
        (np.full((64, 64, 3), 7, np.uint8), {}, "bad_picture"),
        (np.full((64, 64, 3), 7, np.uint8), {"lattice": "none"}, "bad_picture"),
        (np.zeros((64, 64, 4), np.uint8), {}, "bad_picture"),
        (noise(7, 100), {}, "too_small"),
        (noise(1, 1), {}, "too_small"),
        (noise(40, 60), {"lattice": "none", "block": 40}, "too_small"),
        (noise(40, 60), {"lattice": "none", "block": 32, "border": 5}, "too_small"),
        (np.full((64, 64), np.nan), {}, "not_finite"),
        (np.full((64, 64), np.inf), {}, "not_finite"),
        (np.zeros((64, 64), np.int32), {}, "bad_picture"),
        (np.zeros((0, 64), np.uint8), {}, "bad_picture"),
        (np.zeros((4, 64, 64, 3), np.uint8), {}, "bad_picture"),
    ],
)
def test_photos_that_cannot_be_used(
    photo: npt.NDArray[Any], options: dict[str, Any], kind: str
) -> None:
    with pytest.raises(texforge.PictureError) as caught:
        texforge.regular(photo, **options)
    assert caught.value.kind == kind
    assert "\n" not in str(caught.value)


def test_masks_and_maps_that_do_not_fit(wall: npt.NDArray[Any]) -> None:
    with pytest.raises(texforge.PictureError, match="mask") as caught:
        texforge.regular(wall, mask=np.ones((3, 4), bool))
    assert caught.value.kind == "size_mismatch"
    holes = np.ones((96, 112), bool)
    holes[::10, ::10] = False
    for mask in (holes, np.zeros((96, 112), bool)):
        with pytest.raises(texforge.PictureError) as caught:
            texforge.regular(wall, mask=mask, lattice=TRUE)
        assert caught.value.kind == "bad_picture"
        assert "\n" not in str(caught.value)
    with pytest.raises(texforge.PictureError, match="height"):
        texforge.regular(wall, maps={"height": noise(10, 100)})
    with pytest.raises(texforge.PictureError):
        texforge.regular(wall).apply(noise(10, 100))


def test_a_size_beyond_memory_is_refused_at_once(wall: npt.NDArray[Any]) -> None:
    with pytest.raises(texforge.OutOfMemory):
        texforge.regular(wall, size=2**20, lattice=TRUE)
