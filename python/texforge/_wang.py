"""Wang tiles of a near-periodic photo."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping  # noqa: TC003 (the signatures can be resolved at run time)
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from texforge import _api, _arrays, _extract, _texforge
from texforge._progress import reporting
from texforge._types import (
    Encoding,
    Image,
    ImageLike,
    Progress,
    Scaling,
    TileSet,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from texforge._types import PathType

__all__ = ["WangEdges", "WangSet", "wang"]

# Rows and columns of tiles of the plane that is saved unless its size is given, and that is shown.
_LAID = 6
_SHOWN = 3


class WangEdges(NamedTuple):
    """The colours of a tile's edges, 0 or 1: tiles fit where edges of one colour meet."""

    north: int
    east: int
    south: int
    west: int


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class WangSet:
    """Wang tiles of a photo, made by `texforge.wang`.

    In a notebook it shows a small plane.

    Attributes
    ----------
    tiles : list of (H, W) or (H, W, C) ndarray
        The tiles, with the data type and the number of channels of the photo.
    edges : list of WangEdges
        The colours of each tile's edges.
    atlas : ndarray
        All tiles in one picture, row by row. Neighbours in it fit, around its edges too, so it can
        be filtered as a picture.
    grid : (int, int)
        Rows and columns of the atlas.
    maps : dict
        The atlases of the other maps of the material that were given.
    source_map : ndarray of int32, or None
        Row and column of the photo's pixel that each pixel of the atlas is a copy of. None if the
        photo was scaled.
    period : ((float, float), (float, float))
        The period of the photo, as of `Extraction`.
    encoding : {"srgb", "linear", "data"}
        What the numbers of `atlas` mean.
    report : dict
        How it was done, as ``texforge wang --json`` reports it.
    """

    tiles: list[npt.NDArray[Any]]
    edges: list[WangEdges]
    atlas: npt.NDArray[Any]
    grid: tuple[int, int]
    maps: dict[str, npt.NDArray[Any]]
    source_map: npt.NDArray[np.int32] | None
    period: tuple[tuple[float, float], tuple[float, float]]
    encoding: Encoding
    report: dict[str, Any]
    _core: _texforge.Wang

    def layout(self, rows: int, columns: int, *, seed: int = 0) -> npt.NDArray[np.uint8]:
        """Return which tile lies where on a plane of so many tiles, which repeats as a whole.

        The tile of a place follows from the seed, the place and the size of the plane alone.
        """
        rows, columns = (
            _arrays.integer(name, n, low=1, high=4096)
            for name, n in (("rows", rows), ("columns", columns))
        )
        seed = _arrays.integer("seed", seed)
        cells = self._core.layout(rows=rows, columns=columns, seed=seed)
        return np.frombuffer(cells, np.uint8).reshape(rows, columns).copy()

    def plane(
        self,
        size: tuple[int, int] | int,
        *,
        seed: int = 0,
        map: str | None = None,  # noqa: A002 (as `--map` and `maps`)
    ) -> Image:
        """Return a plane of tiles laid at random.

        Parameters
        ----------
        size : (int, int) or int
            **(height, width)** in pixels, or the side of a square. If both are whole tiles the
            plane repeats.
        seed : int
            Seed of the layout.
        map : str, optional
            The map to show in place of the photo.

        Returns
        -------
        Image
            The plane, in the type of the photo or of the map.

        Raises
        ------
        ParameterError
            If the size is out of range, or there is no such map (also a ValueError).
        """
        plane = self._core.plane(
            size=_size(size),
            seed=_arrays.integer("seed", seed),
            only=None if map is None else _arrays.word("map", map),
        )
        array = _arrays.unpacked(plane)
        flat = (self.atlas if map is None else self.maps[map]).ndim == 2
        image = array[:, :, 0] if flat else array
        return Image.tagged(image, _arrays.array_encoding(plane[3]))

    def save(
        self,
        folder: PathType,
        *,
        plane: tuple[int, int] | int | None = None,
        seed: int = 0,
        overwrite: bool = False,
    ) -> list[Path]:
        """Write the set: all of its files or none, the same as ``texforge wang``.

        Parameters
        ----------
        folder : path
            The folder, made if it is not there: ``tile_01.png`` and so on, ``atlas.png``,
            ``atlas_normal.png``, ``plane.png``, ``index.png`` (column and row in the atlas of every
            tile of the plane, for shaders), ``wang.json``. Floats are written as EXR.
        plane : (int, int) or int, optional
            **(height, width)** of the plane in pixels; 6 by 6 tiles by default.
        seed : int
            Seed of its layout.
        overwrite : bool
            Whether existing files may be replaced.

        Returns
        -------
        list of Path
            The files.

        Raises
        ------
        OutputExistsError
            If one of the files exists and `overwrite` is False (also a FileExistsError).
        MissingFileError, AccessError, FileError
            If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
        """
        base = Path(_arrays.path(folder))
        size = self._of_tiles(_LAID) if plane is None else _size(plane)
        seed = _arrays.integer("seed", seed)
        with _extract.made_folder(base):
            files = self._core.save(
                folder=str(base), plane=size, seed=seed, overwrite=bool(overwrite)
            )
        return [Path(file) for file in files]

    def _of_tiles(self, n: int) -> tuple[int, int]:
        height, width = self.tiles[0].shape[:2]
        return n * height, n * width

    def __repr__(self) -> str:
        """Say what it is in one line."""
        height, width = self.tiles[0].shape[:2]
        return f"WangSet({len(self.tiles)} tiles of {height} x {width})"

    def _repr_png_(self) -> bytes | None:
        """Return a small plane, for notebooks."""
        plane = np.asarray(self.plane(self._of_tiles(_SHOWN)))
        return _api.preview_png(plane, self.encoding, (1, 1))


def wang(
    image: ImageLike,
    *,
    set: TileSet = "complete",  # noqa: A002 (as `--set`)
    period: Literal["auto", "ssd", "lattice"] | tuple[float, float] = "auto",
    periods: int = 2,
    scale: Scaling = "down",
    overlap: float = 0.25,
    min_confidence: float = 0.5,
    flatten: float = 0.0,
    mask: ImageLike | None = None,
    maps: Mapping[str, ImageLike] | None = None,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
) -> WangSet:
    """Make Wang tiles of a photo that repeats: a few tiles that fill planes that do not repeat.

    The edges of the tiles have colours. Laid such that colours agree, tiles fit; as several fit any
    place, they can be laid at random. Cloth, bricks and windows stay as regular as in the photo,
    and no tile catches the eye by coming again and again.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo, of any type that `tile` takes. Pixels that are not wholly opaque are never used.
    set : {"complete", "minimal"}
        Which tiles: all 16 with two colours of edges in either direction, or the 8 that suffice.
    period : {"auto", "ssd", "lattice"} or (float, float)
        **(height, width)** of the period in pixels, which may be fractions; or how it is found, as
        for `extract`.
    periods : int
        How many periods a tile spans in each direction, 1 to 64: the more, the less alike the
        plane's parts are. The photo must hold about twice as many.
    scale : {"down", "off"}
        Whether the photo is scaled down a little so that the period is whole pixels, as for
        `extract`.
    overlap : float
        How much the pieces of the photo that tiles are made of may overlap, as a share of their
        area, 0 to 1.
    min_confidence : float
        From which confidence on a period counts as found, 0 to 1.
    flatten : float
        Reach of the light flattening, as a fraction of the photo's shorter side, 0 (off) or 0.02
        to 1, as for `tile`.
    mask : (H, W) array_like, or Pillow image, optional
        Where the photo may be used: True, or at least half of full scale.
    maps : mapping of str to array_like, optional
        Other maps of the same material by name, of any resolution, made of the same places.
    encoding : {"auto", "srgb", "linear", "data"}
        What the numbers mean, as for `tile`.
    threads : int, optional
        Number of worker threads, as for `tile`.
    progress : bool, callable or bar, optional
        As for `tile`.

    Returns
    -------
    WangSet
        The tiles, their edges and their atlas.

    Raises
    ------
    NoStructureError
        If the photo has no period that is sure enough (also a ValueError).
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the photo, the mask or a map cannot be used, or the photo has no room for the pieces
        (also a ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    The same arguments give the same bytes on every run, for any number of threads.

    Source: Wang tiles for image and texture generation (Cohen et al. 2003), the atlas after Wei
    2004, for photos that repeat as the future work of representative tile extraction has it.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> rng = np.random.default_rng(0)
    >>> cloth = np.tile(rng.integers(0, 200, (12, 16, 3)), (10, 10, 1))
    >>> photo = (cloth + rng.integers(0, 40, cloth.shape)).astype(np.uint8)
    >>> made = texforge.wang(photo)
    >>> len(made.tiles), made.tiles[0].shape, made.atlas.shape, made.edges[0]
    (16, (24, 32, 3), (96, 128, 3), WangEdges(north=0, east=0, south=0, west=0))
    >>> made.plane((100, 300), seed=1).shape
    (100, 300, 3)
    """
    values = dict(locals())
    photo = _arrays.picture(image, "the photo", encoding)
    texts = [
        (param["name"], _extract.text(param, values[param["name"]]))
        for param in _texforge.schema("wang")
    ]
    others = {name: _api.maps_of(other, name, 0) for name, other in (maps or {}).items()}
    with reporting(progress) as callback:
        core, atlas, source_map, of_maps, report_text = _texforge.wang(
            photo=photo.packed(),
            mask=None if mask is None else _arrays.mask(mask).packed(),
            maps=[
                (name, [one.packed() for one in other], _texforge.map_kind(name))
                for name, other in others.items()
            ],
            params=texts,
            threads=_arrays.integer("threads", threads or 0, high=1024),
            progress=callback,
        )
    report = json.loads(report_text)
    report["notes"] = [*report["notes"], *photo.notes]
    picture = photo.unpacked(atlas)
    (columns, rows), (width, height) = report["atlas"], report["tile_size"]
    (across_x, across_y), (down_x, down_y) = report["period"]["sides"]
    return WangSet(
        tiles=[
            picture[y * height : (y + 1) * height, x * width : (x + 1) * width].copy()
            for y in range(rows)
            for x in range(columns)
        ],
        edges=[WangEdges(**edges) for edges in report["tiles"]],
        atlas=picture,
        grid=(rows, columns),
        maps={name: others[name][0].unpacked(piece) for name, piece in of_maps},
        source_map=None if source_map is None else _api.map_positions(source_map),
        period=((down_y, down_x), (across_y, across_x)),
        encoding=_arrays.array_encoding(atlas[3]),
        report=report,
        _core=core,
    )


def _size(size: Any) -> tuple[int, int]:
    sides = size if isinstance(size, tuple | list) else (size, size)
    if len(sides) != 2:
        sides = (0, 0)
    height, width = (_arrays.integer("size", side, low=1, high=65536) for side in sides)
    return height, width
