"""Any array, any type, any strides: in and out unchanged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from .conftest import QUICK, noise, source_map_of

if TYPE_CHECKING:
    from collections.abc import Callable

DTYPES = ["uint8", "uint16", "float16", "float32", "float64"]


def as_dtype(picture: npt.NDArray[np.uint8], dtype: str) -> npt.NDArray[Any]:
    if dtype == "uint8":
        return picture
    if dtype == "uint16":
        return picture.astype(np.uint16) * 257 + 1
    return (picture / 255).astype(dtype)


LAYOUTS: dict[str, Callable[[npt.NDArray[Any]], npt.NDArray[Any]]] = {
    "plain": lambda a: a,
    "flipped": lambda a: a[::-1, ::-1],
    "transposed": lambda a: a.swapaxes(0, 1),
    "fortran": np.asfortranarray,
    "every second": lambda a: np.repeat(np.repeat(a, 2, axis=0), 2, axis=1)[::2, 1::2],
    "inside": lambda a: np.pad(a, ((3, 2), (1, 4)) + ((0, 0),) * (a.ndim - 2))[3:-2, 1:-4],
    "big-endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "channels reversed": lambda a: a[..., ::-1] if a.ndim == 3 else a,
    "broadcast": lambda a: np.broadcast_to(a[..., :1], a.shape) if a.ndim == 3 else a,
}


@given(
    dtype=st.sampled_from(DTYPES),
    channels=st.sampled_from([None, 1, 2, 3, 4, 5, 7]),
    layout=st.sampled_from(sorted(LAYOUTS)),
    read_only=st.booleans(),
    seed=st.integers(0, 2**64 - 1),
)
def test_every_pixel_is_a_copy(
    dtype: str, channels: int | None, layout: str, read_only: bool, seed: int
) -> None:
    plain = as_dtype(noise(30, 40, channels), dtype)
    if channels in (2, 4):
        plain[..., -1] = 1.0 if plain.dtype.kind == "f" else np.iinfo(dtype).max
        if layout in ("channels reversed", "broadcast"):
            layout = "plain"
    photo = LAYOUTS[layout](plain)
    before = photo.copy()
    if read_only:
        photo.flags.writeable = False
    tile = texforge.tile(photo, seed=seed, **QUICK)
    assert np.array_equal(photo, before)
    assert tile.image.dtype == np.dtype(dtype)
    assert tile.image.dtype.isnative
    assert tile.image.shape == (24, 32, *photo.shape[2:])
    assert tile.image.flags.c_contiguous
    assert tile.image.flags.writeable
    source_map = source_map_of(tile)
    assert source_map.shape == (24, 32, 2)
    assert source_map.dtype == np.int32
    assert np.array_equal(tile.image, photo[source_map[..., 0], source_map[..., 1]])


@given(layout=st.sampled_from(sorted(set(LAYOUTS) - {"channels reversed", "broadcast"})))
def test_the_layout_in_memory_does_not_matter(layout: str) -> None:
    laid_out = LAYOUTS[layout](as_dtype(noise(30, 40), "uint16"))
    plain = np.ascontiguousarray(laid_out).astype(np.uint16)
    one, two = texforge.tile(laid_out, **QUICK), texforge.tile(plain, **QUICK)
    assert one.image.tobytes() == two.image.tobytes()


def test_changing_the_array_meanwhile_changes_nothing(photo: npt.NDArray[np.uint8]) -> None:
    expected = texforge.tile(photo, **QUICK).image
    changing = photo.copy()
    tile = texforge.tile(changing, progress=lambda _: changing.fill(0), **QUICK)
    # The first call comes after the array was copied.
    assert np.array_equal(tile.image, expected)


def test_lists_and_array_likes_are_pictures() -> None:
    class Wrapped:
        def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
            return noise()

    expected = texforge.tile(noise(), **QUICK).image
    assert np.array_equal(texforge.tile(Wrapped(), **QUICK).image, expected)
    view: Any = memoryview(noise())  # type: ignore[arg-type]
    assert np.array_equal(texforge.tile(view, **QUICK).image, expected)


BAD: dict[str, tuple[Any, str]] = {
    "bool": (np.zeros((9, 9), bool), "bool"),
    "int64": (np.zeros((9, 9), np.int64), "int64"),
    "int8": (np.zeros((9, 9), np.int8), "int8"),
    "complex": (np.zeros((9, 9), complex), "complex128"),
    "object": (np.full((9, 9), None), "object"),
    "text": ("photo.png", "dimensions|<U|str"),
    "none": (None, "object"),
    "dates": (np.zeros((9, 9), "datetime64[s]"), "datetime64"),
    "structured": (np.zeros((9, 9), [("r", "u1")]), "void"),
    "zero size": (np.zeros((0, 9, 3), np.uint8), "no pixel"),
    "zero channels": (np.zeros((9, 9, 0), np.uint8), "no pixel"),
    "one dimension": (np.zeros(9, np.uint8), "1 dimensions"),
    "no dimension": (np.uint8(1), "0 dimensions"),
    "four dimensions": (np.zeros((1, 9, 9, 3), np.uint8), "4 dimensions"),
    "ragged": ([[1, 2], [3]], "cannot be made an array"),
    "masked": (np.ma.masked_array(np.zeros((9, 9), np.uint8)), "mask=~image.mask"),
    "too many channels": (np.zeros((9, 9, 2000), np.uint8), "1024 channels"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_picture_is_refused_in_one_sentence(case: str) -> None:
    image, words = BAD[case]
    with pytest.raises(texforge.PictureError, match=words) as caught:
        texforge.tile(image)
    assert caught.value.kind == "bad_picture"
    assert "\n" not in str(caught.value)


PILLOW = {
    "L": ("uint8", None),
    "RGB": ("uint8", 3),
    "RGBA": ("uint8", 4),
    "LA": ("uint8", 2),
    "P": ("uint8", 3),
    "1": ("uint8", None),
    "CMYK": ("uint8", 3),
    "YCbCr": ("uint8", 3),
    "F": ("float32", None),
    "I;16": ("uint16", None),
    "I": ("uint16", None),
}


@pytest.mark.parametrize("mode", PILLOW)
def test_pillow_images_of_every_mode(mode: str) -> None:
    dtype, channels = PILLOW[mode]
    if mode == "F":
        image = Image.fromarray(noise(channels=None).astype(np.float32) / 255)
    elif mode in ("I;16", "I"):
        image = Image.fromarray(noise(channels=None).astype(np.uint16 if mode != "I" else np.int32))
    else:
        image = Image.fromarray(noise()).convert(mode)
    assert image.mode == mode
    tile = texforge.tile(image, **QUICK)
    assert tile.image.dtype == np.dtype(dtype)
    assert tile.image.shape == ((24, 32) if channels is None else (24, 32, channels))


def test_a_pillow_image_is_the_array_it_shows() -> None:
    one = texforge.tile(Image.fromarray(noise()), **QUICK)
    assert np.array_equal(one.image, texforge.tile(noise(), **QUICK).image)


def test_pillow_palette_with_transparency_has_alpha() -> None:
    image = Image.fromarray(noise(channels=None)).convert("P")
    image.info["transparency"] = bytes([0] * 40 + [255] * 216)
    tile = texforge.tile(image, **QUICK)
    assert tile.image.shape == (24, 32, 4)
    assert tile.image[..., 3].min() == 255


def test_a_pillow_colour_profile_is_not_dropped_silently() -> None:
    image = Image.fromarray(noise())
    image.info["icc_profile"] = b"some profile"
    notes = texforge.tile(image, **QUICK).report["notes"]
    assert any("profile" in note for note in notes)


def test_pillow_integers_that_are_not_16_bits_are_refused() -> None:
    image = Image.fromarray(np.full((20, 20), 70000, np.int32))
    with pytest.raises(texforge.PictureError, match="0 to 65535"):
        texforge.tile(image)


def test_an_image_remembers_its_encoding() -> None:
    light = texforge.Image.tagged(noise().astype(np.float32), "linear")
    brighter = light[::2] * 2
    assert isinstance(brighter, texforge.Image)
    assert brighter.encoding == "linear"
    assert type(np.asarray(light)) is np.ndarray
    tile = texforge.tile(light / 255, **QUICK)
    assert tile.encoding == "linear"
    assert isinstance(tile.image, texforge.Image)
    assert tile.image.encoding == "linear"
    assert texforge.tile(noise() / 255, **QUICK).encoding == "srgb"
    assert texforge.tile(noise() / 255, encoding="linear", **QUICK).encoding == "linear"
    assert type(texforge.tile(noise(), **QUICK).image) is np.ndarray


def test_floats_and_bytes_of_the_same_photo_give_the_same_tile() -> None:
    photo = noise()
    one, two = texforge.tile(photo, **QUICK), texforge.tile(photo / 255, **QUICK)
    assert np.array_equal(source_map_of(one), source_map_of(two))
