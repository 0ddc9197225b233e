"""Pictures in and out: what numpy or Pillow has, as a contiguous buffer and what it holds."""

from __future__ import annotations

import operator
import os
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from texforge._errors import ParameterError, PictureError
from texforge._types import Encoding, Image, SourceMap

if TYPE_CHECKING:
    import numpy.typing as npt

_DTYPES = ("uint8", "uint16", "float16", "float32", "float64")

_ENCODINGS: dict[str, Encoding] = {"srgb": "srgb", "linear": "linear", "data": "data"}

# What Pillow's other modes become before they are arrays.
_PILLOW_MODES = {
    "1": "L",
    "La": "LA",
    "PA": "RGBA",
    "RGBX": "RGB",
    "RGBa": "RGBA",
    "CMYK": "RGB",
    "YCbCr": "RGB",
    "HSV": "RGB",
}
_PILLOW_PLAIN = ("L", "LA", "RGB", "RGBA", "F", "I", "I;16", "I;16B", "I;16L", "I;16N")


class Picture(NamedTuple):
    """A picture on its way into the core."""

    array: npt.NDArray[Any]
    """C-contiguous, native-endian, height x width x channels."""
    encoding: str
    """``srgb``, ``linear`` or ``data``."""
    flat: bool
    """Whether it came without an axis of channels."""
    tagged: bool
    """Whether it came as an `Image`."""
    notes: tuple[str, ...]
    """What the user should know, one sentence each."""

    def packed(self) -> tuple[Any, str, tuple[int, int, int], str]:
        """Return the parts that the core takes."""
        height, width, channels = self.array.shape
        data = self.array.reshape(-1).view(np.uint8)
        return data, self.array.dtype.name, (height, width, channels), self.encoding

    def unpacked(self, parts: tuple[bytearray, str, tuple[int, int, int], str]) -> npt.NDArray[Any]:
        """Return what the core made of this picture, in the form in which this came."""
        array = unpacked(parts)
        if self.flat and array.shape[2] == 1:
            array = array[:, :, 0]
        return Image.tagged(array, array_encoding(parts[3])) if self.tagged else array


def unpacked(parts: tuple[bytearray, str, tuple[int, int, int], str]) -> npt.NDArray[Any]:
    """Return the array, height x width x channels, that the core's parts hold."""
    data, dtype, shape, _ = parts
    return np.frombuffer(data, dtype=dtype).reshape(shape)


def array_encoding(name: object) -> Encoding:
    """Return the name of an encoding, checked."""
    if isinstance(name, str) and name in _ENCODINGS:
        return _ENCODINGS[name]
    raise ParameterError(
        f"`encoding` must be one of auto, {', '.join(_ENCODINGS)}, got {name!r}",
        fields={"name": "encoding"},
    )


def displayable(image: npt.NDArray[Any], encoding: Encoding) -> npt.NDArray[np.uint8] | None:
    """Return 8-bit sRGB to look at, height x width x channels; None if there is no such thing."""
    array = np.asarray(image).reshape(*image.shape[:2], -1)
    if array.shape[2] > 4:
        return None
    if array.dtype == np.uint16:
        return (array >> 8).astype(np.uint8)
    if array.dtype == np.uint8:
        return array
    unit = np.clip(np.nan_to_num(array.astype(np.float32)), 0.0, 1.0)
    if encoding == "linear":
        n_colors = array.shape[2] - (array.shape[2] in (2, 4))
        light = unit[:, :, :n_colors]
        unit[:, :, :n_colors] = np.where(
            light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055
        )
    return (unit * 255 + 0.5).astype(np.uint8)


def picture(image: Any, what: str, encoding: str = "auto") -> Picture:
    """Return `image` ready for the core; `what` names it in messages."""
    if encoding != "auto":
        encoding = array_encoding(encoding)
    notes: tuple[str, ...] = ()
    pillow = sys.modules.get("PIL.Image")
    if pillow is not None and isinstance(image, pillow.Image):
        array, notes = _from_pillow(image, what)
    else:
        array = _from_any(image, what)
    if encoding == "auto":
        encoding = getattr(image, "encoding", "srgb") if isinstance(image, Image) else "srgb"
    native = array.dtype.newbyteorder("=")
    if native.name not in _DTYPES:
        raise PictureError(
            f"{what} is an array of {array.dtype.name}, which is none of {', '.join(_DTYPES)}; "
            f"{_dtype_remedy(array.dtype)}",
            fields={"what": what},
        )
    if array.ndim not in (2, 3):
        raise PictureError(
            f"{what} has {array.ndim} dimensions of shape {array.shape}; "
            "give one picture as height x width or height x width x channels",
            fields={"what": what},
        )
    if array.size == 0:
        raise PictureError(
            f"{what} has shape {array.shape}, which holds no pixel; "
            "give a picture of at least one pixel",
            fields={"what": what},
        )
    flat = array.ndim == 2
    whole = np.ascontiguousarray(array[:, :, np.newaxis] if flat else array, dtype=native)
    return Picture(whole, encoding, flat, isinstance(image, Image), notes)


def mask(mask: Any, what: str = "the mask") -> Picture:
    """Return a mask ready for the core: white or True is set."""
    if not hasattr(mask, "mode"):
        array = _from_any(mask, what)
        if array.dtype == np.bool_:
            mask = array.astype(np.uint8) * np.uint8(255)
    return picture(mask, what, "srgb")


def positions(source_map: Any) -> npt.NDArray[np.int32]:
    """Return a source map as a contiguous array of 32-bit positions, checked."""
    array = _from_any(source_map, "the source map")
    if array.ndim != 3 or array.shape[2] != 2 or array.dtype.kind not in "iu" or array.size == 0:
        raise PictureError(
            f"the source map is an array of {array.dtype.name} of shape {array.shape}; "
            "give integers of shape height x width x 2: row and column of each source pixel",
            fields={"what": "the source map"},
        )
    low, high = int(array.min()), int(array.max())
    if low < 0 or high >= 2**31:
        raise PictureError(
            f"the source map holds positions from {low} to {high}; they must not be negative, "
            "nor 2147483648 or more",
            fields={"what": "the source map"},
        )
    return np.ascontiguousarray(array, dtype=np.int32)


def packed_map(
    source_map: SourceMap,
) -> tuple[Any, tuple[int, int], list[tuple[int, int]], Any]:
    """Return a source map as the parts that the core takes."""
    places = positions(source_map.positions)
    sizes = []
    all_sizes: tuple[object, ...] = (source_map.source_size, *source_map.further_sizes)
    for size in all_sizes:
        if not isinstance(size, tuple | list) or len(size) != 2:
            raise ParameterError(
                f"`source_size` must be (height, width), got {size!r}",
                fields={"name": "source_size"},
            )
        height, width = (integer("source_size", side, 1, 2**31) for side in size)
        sizes.append((height, width))
    origins = source_map.origins
    if origins is not None:
        origins = positions(origins)
        if origins.shape != places.shape:
            raise PictureError(
                f"the source map has positions of shape {places.shape} and origins of shape "
                f"{origins.shape}; they must be the same",
                fields={"what": "the source map"},
            )
        origins = origins.reshape(-1).view(np.uint8)
    shape = (places.shape[0], places.shape[1])
    return places.reshape(-1).view(np.uint8), shape, sizes, origins


def integer(name: str, value: Any, low: int = 0, high: int = 2**64 - 1) -> int:
    """Return an argument that must be an integer in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool | np.bool_) or not low <= number <= high:
        raise ParameterError(
            f"`{name}` must be an integer from {low} to {high}, got {value!r}",
            fields={"name": name},
        )
    return number


def real(name: str, value: Any) -> float:
    """Return an argument that must be a number."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"`{name}` must be a number, got {value!r}", fields={"name": name}
        ) from None


def number(name: str, value: Any) -> str:
    """Return an argument that must be a number as the text that the core reads."""
    return repr(real(name, value))


def word(name: str, value: object) -> str:
    """Return an argument that must be a word."""
    if not isinstance(value, str):
        raise ParameterError(f"`{name}` must be a word, got {value!r}", fields={"name": name})
    return value


def path(value: Any) -> str:
    """Return an argument that must be the path of a file."""
    try:
        return os.fsdecode(value)
    except TypeError:
        raise ParameterError(
            f"`path` must be a path, got {type(value).__name__}", fields={"name": "path"}
        ) from None


def _from_any(image: Any, what: str) -> npt.NDArray[Any]:
    if isinstance(image, np.ma.MaskedArray):
        raise PictureError(
            f"{what} is a masked array; give its data, and what may be used as mask=~image.mask",
            fields={"what": what},
        )
    try:
        return np.asarray(image)
    except (ValueError, TypeError) as error:
        raise PictureError(
            f"{what} cannot be made an array ({error}); give a numpy array or a Pillow image",
            fields={"what": what},
        ) from error


def _from_pillow(image: Any, what: str) -> tuple[npt.NDArray[Any], tuple[str, ...]]:
    notes = []
    mode: str = image.mode
    if mode == "P":
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
    elif mode in _PILLOW_MODES:
        image = image.convert(_PILLOW_MODES[mode])
    elif mode not in _PILLOW_PLAIN:
        raise PictureError(
            f"{what} is a Pillow image of mode {mode}; convert it to RGB first",
            fields={"what": what},
        )
    if mode == "CMYK":
        notes.append("The CMYK image was converted to RGB without its colour profile.")
    elif image.info.get("icc_profile"):
        notes.append(
            "The Pillow image's colour profile was not looked at; texforge.read_image converts it."
        )
    array = np.asarray(image)
    if mode == "I":
        # 32-bit integers are how Pillow holds some 16-bit pictures.
        if array.size and (array.min() < 0 or array.max() > 65535):
            raise PictureError(
                f"{what} is a Pillow image of mode I with values outside 0 to 65535; "
                "scale it to 16 bits",
                fields={"what": what},
            )
        array = array.astype(np.uint16)
    return array, tuple(notes)


def _dtype_remedy(dtype: np.dtype[Any]) -> str:
    if dtype == np.bool_:
        return "a mask is given as mask=, a black and white picture as image.astype('uint8') * 255"
    if dtype.kind in "iu":
        return "scale the values to 0 to 255 and convert with image.astype('uint8')"
    if dtype.kind == "f":
        return "convert with image.astype('float64')"
    return "give real numbers"
