"""The photographs below a folder, and what is measured on them and their tiles."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import texforge

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    import numpy.typing as npt
    from PIL import Image

SUFFIXES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".exr"}
OTHER_MAPS = re.compile(
    r"(^|[-_. ])(ao|arm|orm|disp|displacement|height|metal|metallic|nor|normal|normalgl|normaldx"
    r"|nrm|occlusion|opacity|rough|roughness)([-_. ]|$)"
)
"""Words in the names of files that are no base colours."""
SHRINK = 4
"""Photos whose shorter side is longer than this many tiles are made smaller first."""


def by_class(folder: Path, classes: Collection[str] = (), only: str = "") -> dict[str, list[Path]]:
    """Return the photographs below a folder by the name of its folder they are in."""
    found: dict[str, list[Path]] = {}
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        name = parts[0] if len(parts) > 1 else folder.name
        wanted = path.suffix.lower() in SUFFIXES and only in str(path)
        if classes and name not in classes:
            continue
        if wanted and not OTHER_MAPS.search(path.stem.lower()):
            found.setdefault(name, []).append(path)
    return found


def reduced(photo: texforge.Image, side: int) -> texforge.Image:
    """Return the photo, averaged over squares of pixels if it is much larger than the tile."""
    factor = min(photo.shape[:2]) // (SHRINK * side)
    if factor < 2:
        return photo
    array = np.asarray(photo)
    height, width = (n // factor for n in array.shape[:2])
    blocks = array[: height * factor, : width * factor].reshape(
        height, factor, width, factor, *array.shape[2:]
    )
    mean = blocks.mean(axis=(1, 3), dtype=np.float64)
    if array.dtype.kind in "ui":
        mean = np.rint(mean)
    return texforge.Image.tagged(mean.astype(array.dtype), photo.encoding)


def lightness(picture: Image.Image) -> npt.NDArray[np.float64]:
    """Return CIE L* of a picture as shown."""
    srgb = np.asarray(picture, dtype=np.float64) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    y = linear @ np.array([0.2126, 0.7152, 0.0722])
    star: npt.NDArray[np.float64] = np.where(y > 216 / 24389, 116 * np.cbrt(y) - 16, y * 24389 / 27)
    return star


def gradient(picture: Image.Image, used: npt.NDArray[np.bool_]) -> float:
    """Return the mean absolute difference of L* between neighbouring pixels that are used."""
    plane = lightness(picture)
    differences = [
        np.abs(np.diff(plane, axis=axis))[
            np.take(used, range(1, used.shape[axis]), axis)
            & np.take(used, range(used.shape[axis] - 1), axis)
        ]
        for axis in (0, 1)
    ]
    both = np.concatenate(differences)
    return float(both.mean()) if both.size else 0.0


def opaque(image: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return where a picture is wholly opaque."""
    if image.ndim == 3 and image.shape[2] in (2, 4):
        full = 1.0 if image.dtype.kind == "f" else np.iinfo(image.dtype).max
        return np.asarray(image[:, :, -1] >= full)
    return np.ones(image.shape[:2], dtype=bool)
