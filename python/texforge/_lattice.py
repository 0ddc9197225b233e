"""Finding the lattice of a near-regular photo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from texforge import _arrays, _texforge
from texforge._errors import ParameterError
from texforge._progress import reporting
from texforge._types import Encoding, ImageLike, Lattice, Progress, Snap

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["detect_lattice"]

_PREVIEW_SIDE = 1024
"""Longer side of what notebooks show, in pixels, at most about."""


def detect_lattice(
    image: ImageLike,
    *,
    min_confidence: float = 0.5,
    min_period: float = 0.0,
    autocorrelation: bool = False,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
) -> Lattice:
    """Find by which displacements a photo of bricks, tiles or cloth repeats.

    A photo without a lattice is no error: the confidence is then low and `Lattice.found` False. So
    it is for several lattices at once and for strong distortion. Patterns of fewer than about 2 x 2
    repeats are not found, nor those finer than about 6 pixels once the photo is reduced to a
    megapixel.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo: grey or RGB, with or without alpha, or data of any number of channels. Pixels
        that are not wholly opaque do not count.
    min_confidence : float
        From which confidence on a lattice counts as found, 0 to 1.
    min_period : float
        Shortest period that counts, in pixels, 0 to 65536: set it above the weave of a cloth to
        find the pattern printed on it.
    autocorrelation : bool
        Whether `Lattice.autocorrelation` is wanted.
    encoding : {"auto", "srgb", "linear", "data"}
        What the numbers mean, as for `tile`.
    threads : int, optional
        Number of worker threads, as for `tile`.
    progress : bool, callable or bar, optional
        As for `tile`.

    Returns
    -------
    Lattice
        The reduced basis of the lattice, as displacements (to the right, downwards) in pixels, and
        its confidence.

    Raises
    ------
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the photo is smaller than 16 pixels, constant, or not finite (also a ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    The same arguments give the same numbers on every run, for any number of threads.

    Source: "Near-Regular Texture Synthesis by Random Sampling and Gap Filling" (2011), sec. 3.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> y, x = np.mgrid[:120, :160]
    >>> wall = np.where((y % 20 < 3) | ((x + y // 20 * 16) % 32 < 3), 200, 90).astype(np.uint8)
    >>> lattice = texforge.detect_lattice(wall)
    >>> lattice.found
    True
    >>> np.abs(np.round(lattice.v1)), np.abs(np.round(lattice.v2))
    (array([16., 20.]), array([16., 20.]))
    >>> lattice.snap(64).size
    (80, 64)
    """
    photo = _arrays.picture(image, "the photo", encoding)
    params = [
        ("min_confidence", _arrays.number("min_confidence", min_confidence)),
        ("min_period", _arrays.number("min_period", min_period)),
    ]
    with reporting(progress) as callback:
        v1, v2, confidence, found, goodness, correlation, gamma = _texforge.lattice(
            photo=photo.packed(),
            params=params,
            autocorrelation=bool(autocorrelation),
            threads=_arrays.integer("threads", threads or 0, high=1024),
            progress=callback,
        )
    array = photo.array[:, :, 0] if photo.flat else photo.array
    return Lattice(
        v1=(v1[0], v1[1]),
        v2=(v2[0], v2[1]),
        confidence=confidence,
        found=found,
        goodness=goodness,
        correlation=correlation,
        photo=array,
        encoding=_arrays.array_encoding(photo.encoding),
        autocorrelation=None if gamma is None else _arrays.unpacked(gamma[0])[:, :, 0],
        autocorrelation_scale=None if gamma is None else (gamma[1][1], gamma[1][0]),
    )


def overlay(lattice: Lattice, image: ImageLike | None) -> npt.NDArray[np.uint8]:
    """Return a picture, the lattice's photo if None, with the lattice drawn over it."""
    if image is None:
        picture = _arrays.picture(lattice.photo, "the photo", lattice.encoding)
    else:
        picture = _arrays.picture(image, "the picture")
    drawn: npt.NDArray[Any] = _arrays.unpacked(
        _texforge.lattice_overlay(picture=picture.packed(), v1=lattice.v1, v2=lattice.v2)
    )
    return drawn


def snap(lattice: Lattice, size: object) -> Snap | None:
    """Return the size near `size` after which the lattice repeats."""
    sides: tuple[Any, ...] = tuple(size) if isinstance(size, tuple | list) else (size, size)
    if len(sides) != 2:
        raise ParameterError(
            f"`size` must be one number or (height, width), got {size!r}", fields={"name": "size"}
        )
    height, width = (_arrays.integer("size", side, 1, 65536) for side in sides)
    found = _texforge.lattice_snap(v1=lattice.v1, v2=lattice.v2, width=width, height=height)
    if found is None:
        return None
    width, height, (scale_x, scale_y), (across, down), (off_x, off_y) = found
    return Snap(
        size=(height, width),
        scale=(scale_y, scale_x),
        periods=((down[0], down[1]), (across[0], across[1])),
        misfit=(off_y, off_x),
    )


def preview_png(lattice: Lattice) -> bytes:
    """Return the lattice over its photo as a PNG that fits a screen."""
    image = overlay(lattice, None)
    # Averages whole blocks; pixels at the far edge that fill no block are left out.
    step = -(-max(image.shape[:2]) // _PREVIEW_SIDE)
    height, width = image.shape[0] // step, image.shape[1] // step
    blocks = image[: height * step, : width * step].reshape(height, step, width, step, 3)
    small = blocks.mean(axis=(1, 3)).round().astype(np.uint8)
    return bytes(_texforge.encode_png(picture=_arrays.picture(small, "the preview").packed()))
