"""Measuring finished textures."""

from __future__ import annotations

from typing import Literal

from texforge import _arrays, _texforge
from texforge._progress import reporting
from texforge._types import (
    Axis,
    Encoding,
    ImageLike,
    Progress,
    Regular,
    SourceMap,
    Texture,
    TextureCost,
    Tile,
)

__all__ = ["texture_cost"]


def texture_cost(
    texture: Tile | Regular | ImageLike,
    photo: ImageLike,
    *,
    axis: Axis = "both",
    patch: int = 11,
    samples: int = 500,
    seed: int = 0,
    mask: ImageLike | None = None,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
) -> TextureCost:
    """Measure how much a texture looks like its photo, by the definition of the texture cost.

    For patches of the texture drawn at random, the nearest of all patches of the photo is found by
    comparing with every one of them. `Tile.costs` has a quick upper bound instead.

    Parameters
    ----------
    texture : Tile, Regular, (H, W) or (H, W, C) array_like, or Pillow image
        The texture; of the photo's data type and number of channels. A `Tile` also says where its
        pixels come from, which narrows the margin by much.
    photo : (H', W') or (H', W', C) array_like, or Pillow image
        The photo.
    axis : {"both", "x", "y"}
        In which directions the texture repeats. Where it does not, only whole patches count.
    patch : int
        Side of the patches that are compared, in pixels; odd, 3 to 21.
    samples : int
        How many of the texture's patches are drawn, 2 to 1000000; all of them if there are no
        more. The time is proportional to it, and to the photo's pixels.
    seed : int
        Seed of the draw, 0 to 2**64 - 1.
    mask : (H', W') array_like, or Pillow image, optional
        Where the photo may be used, as for `tile`.
    encoding : {"auto", "srgb", "linear", "data"}
        What the numbers of both mean, as for `tile`.
    threads : int, optional
        Number of worker threads, as for `tile`.
    progress : bool, callable or bar, optional
        As for `tile`.

    Returns
    -------
    TextureCost
        The mean, in squared CIE L*a*b* units, and its 95 % confidence interval.

    Raises
    ------
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the pictures are of different kinds, too small, or not finite, or the mask leaves
        nothing (also a ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    The same arguments give the same numbers on every run, for any number of threads.

    Source: Moritz et al. 2017 (see `tile`), eq. 5.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> photo = np.random.default_rng(0).integers(0, 256, (80, 100, 3), dtype=np.uint8)
    >>> tile = texforge.tile(photo, size=32, quality="draft")
    >>> cost = texforge.texture_cost(tile, photo, samples=32 * 32)
    >>> cost.mean <= tile.costs.texture, cost.margin
    (True, 0.0)
    """
    original = _arrays.picture(photo, "the photo", encoding)
    image: ImageLike = texture.image if isinstance(texture, Texture) else texture
    source_map = None
    if isinstance(texture, Tile) and texture.source_map is not None:
        source_map = _arrays.packed_map(
            SourceMap(texture.source_map, texture.photo_size, texture.also_sizes, texture.origins)
        )
    params = {
        "axis": _arrays.word("axis", axis),
        "patch": str(_arrays.integer("patch", patch)),
        "samples": str(_arrays.integer("samples", samples)),
    }
    with reporting(progress) as callback:
        mean, margin, compared = _texforge.texture_cost(
            texture=_arrays.picture(image, "the texture", original.encoding).packed(),
            photo=original.packed(),
            source_map=source_map,
            mask=None if mask is None else _arrays.mask(mask).packed(),
            params=list(params.items()),
            seed=_arrays.integer("seed", seed),
            threads=_arrays.integer("threads", threads or 0, high=1024),
            progress=callback,
        )
    return TextureCost(mean, margin, compared)
