"""Choosing by eye how even a tile becomes."""

from __future__ import annotations

import dataclasses
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from texforge import _api, _arrays

if TYPE_CHECKING:
    import numpy.typing as npt

    from texforge._types import ImageLike, PathType, Tile, TileOptions

__all__ = ["Palette", "palette"]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Palette:
    """Tiles of one photo, from hardly evened out to wholly, made by `texforge.palette`.

    In a notebook it shows all of them side by side.

    Attributes
    ----------
    tiles : list of Tile
        The steps.
    stationarities : list of float
        The place of each on the dial, from 0.0 to 1.0: what ``texforge.tile(photo,
        stationarity=...)`` takes.
    sigmas : list of float
        The sigma that each place is for this photo, falling.
    differences : list of float
        How different two neighbours look, in CIE L*a*b* units: one less than there are tiles.
        The steps are even if these are alike.
    curve : list of (float, float)
        What the dial was made from: the sigmas that were tried, falling, and how much the look
        has changed up to each, in CIE L*a*b* units.
    picture : (H, W) or (H, W, C) ndarray of uint8
        All tiles side by side, each repeated two by two and over a bar as long as its place on
        the dial.
    """

    tiles: list[Tile]
    stationarities: list[float]
    sigmas: list[float]
    differences: list[float]
    curve: list[tuple[float, float]]
    picture: npt.NDArray[Any]

    def save(self, path: PathType, *, overwrite: bool = False) -> list[Path]:
        """Write the tiles and the picture of all.

        Parameters
        ----------
        path : path
            ``wall.png`` makes ``wall-1.png`` and so on, and ``wall.palette.png``.
        overwrite : bool
            Whether existing files may be replaced.

        Returns
        -------
        list of Path
            The files, the picture of all last.

        Raises
        ------
        OutputExistsError
            If one of the files exists and `overwrite` is False.
        FormatError
            If the format is unknown or cannot hold the tiles as they are.
        """
        base = Path(_arrays.path(path))
        files = [base.with_stem(f"{base.stem}-{i}") for i in range(1, len(self.tiles) + 1)]
        for tile, file in zip(self.tiles, files, strict=True):
            tile.save(file, overwrite=overwrite)
        sheet = base.with_suffix(".palette.png")
        _api.write_image(sheet, self.picture, overwrite=overwrite)
        return [*files, sheet]

    def __repr__(self) -> str:
        """Say what it is in one line."""
        sigmas = ", ".join(f"{sigma:.3g}" for sigma in self.sigmas)
        return f"Palette({len(self.tiles)} tiles, sigma {sigmas})"

    def _repr_png_(self) -> bytes:
        """Return all of them side by side, for notebooks."""
        return _api.png(self.picture)


def palette(image: ImageLike, steps: int = 5, **options: Unpack[TileOptions]) -> Palette:
    """Make a photo into tiles that are evened out more and more, to choose one by eye.

    Equal steps look like equal steps, whatever the photo: sigmas are tried, and chosen such that
    neighbouring tiles differ alike (Sec. 4.4 of the paper).

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo.
    steps : int
        How many tiles, 2 to 100. The first is at stationarity 0, the last at 1.
    **options
        Those of `tile`, but neither `sigma` nor `stationarity`, nor a `sigma_map`. A small `size`
        and quality ``"draft"`` make it quick.

    Returns
    -------
    Palette
        The tiles, where on the dial they are, and a picture of all of them.

    Raises
    ------
    ParameterError
        If `steps` is out of range, `sigma`, `stationarity` or a `sigma_map` is given, or method
        or measure make nothing stationary; and as `tile`.

    Notes
    -----
    Which sigma a place on the dial is depends on the photo and the options, not on the seed.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> photo = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    >>> palette = texforge.palette(photo, 3, size=32, patch=5, quality="draft")
    >>> palette.stationarities
    [0.0, 0.5, 1.0]
    >>> palette.sigmas[0], palette.sigmas[-1]
    (0.5, 0.02)
    """
    arguments = inspect.signature(_api.tile).bind(image, **options)
    arguments.apply_defaults()
    steps = _arrays.integer("steps", steps, 2, 100)
    tiles, rest = _api.tiles(steps, as_palette=True, **arguments.arguments)
    differences, curve, picture = rest
    whole = _arrays.unpacked(picture)
    return Palette(
        tiles=tiles,
        stationarities=[tile.report["stationarity"] for tile in tiles],
        sigmas=[tile.params["sigma"] for tile in tiles],
        differences=differences,
        curve=curve,
        picture=whole[:, :, 0] if whole.shape[2] == 1 else whole,
    )
