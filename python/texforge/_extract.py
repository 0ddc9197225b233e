"""Extracting the representative tile of a near-periodic photo."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Mapping  # noqa: TC003 (the signatures can be resolved at run time)
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from texforge import _api, _arrays, _texforge
from texforge._errors import ParameterError, from_core
from texforge._progress import reporting
from texforge._types import (  # noqa: TC001 (the signatures can be resolved at run time)
    Encoding,
    ImageLike,
    Progress,
    Scaling,
    Similarity,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy.typing as npt

    from texforge._types import PathType

__all__ = ["ExtractedTile", "Extraction", "extract"]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExtractedTile:
    """One tile of `texforge.extract`.

    In a notebook it shows itself repeated two by two.

    Attributes
    ----------
    image : (H, W) or (H, W, C) ndarray
        The tile, with the data type and the number of channels of the photo.
    place : (int, int)
        Row and column of its first pixel in the scaled photo.
    photo_place : (float, float)
        The same in the photo as it is: rows and columns from its upper left corner.
    continuity : float
        The mean difference of the pixels that meet where tiles do (the paper's h), in CIE L*a*b*
        units, squared unless the similarity is ``"absolute"``; of the tile before a band was made
        anew. Lower is better.
    resemblance : float
        The mean difference of the photo and the tiling (SSDN), likewise.
    score : float
        alpha times the one plus beta times the other.
    maps : dict
        The other maps of the material that were given, cut at the same place.
    source_map : (H, W, 2) ndarray of int32, or None
        Row and column of the photo's pixel that each pixel is a copy of. None if the photo was
        scaled.
    scaled_size : (int, int)
        Height and width of the scaled photo.
    encoding : {"srgb", "linear", "data"}
        What the numbers of `image` mean.
    record : str
        How it was made, as its file says it: JSON.
    """

    image: npt.NDArray[Any]
    place: tuple[int, int]
    photo_place: tuple[float, float]
    continuity: float
    resemblance: float
    score: float
    maps: dict[str, npt.NDArray[Any]]
    source_map: npt.NDArray[np.int32] | None
    scaled_size: tuple[int, int]
    encoding: Encoding
    record: str

    def tiling(self) -> npt.NDArray[Any]:
        """Return a picture as large as the scaled photo: the tile repeated, where it was found."""
        rows, columns = (
            (np.arange(side) - place) % period
            for side, place, period in zip(
                self.scaled_size, self.place, self.image.shape, strict=False
            )
        )
        tiling: npt.NDArray[Any] = self.image[rows][:, columns]
        return tiling

    def tiled(self, rows: int = 3, columns: int = 3) -> npt.NDArray[Any]:
        """Return the image repeated `rows` times downwards and `columns` times to the right."""
        return np.tile(self.image, (rows, columns) + (1,) * (self.image.ndim - 2))

    def __repr__(self) -> str:
        """Say what it is in one line."""
        height, width = self.image.shape[:2]
        y, x = self.place
        return f"ExtractedTile({height} x {width} at {y}, {x}, score {self.score:.4g})"

    def _repr_png_(self) -> bytes | None:
        """Return the tile repeated two by two, for notebooks."""
        return _api.preview_png(self.image, self.encoding, (2, 2))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Extraction:
    """Tiles of a near-periodic photo, made by `texforge.extract`.

    In a notebook it shows all tiles over their tilings.

    Attributes
    ----------
    tiles : list of ExtractedTile
        The tiles, the best first.
    period : ((float, float), (float, float))
        The period of the photo: the displacements (rows, columns) of one period downwards and of
        one to the right, in its pixels.
    found_by : {"ssd", "lattice", "given"}
        How it was found.
    confidence : float or None
        How sure it is that the photo repeats so, 0 to 1. None if it was given.
    scale : (float, float)
        By what the photo's height and width were multiplied; (1.0, 1.0) if it was left as it is.
    alpha : float
        The weight of continuity that was used.
    sheet : (H, W) or (H, W, C) ndarray of uint8
        All tiles over all tilings.
    report : dict
        How it was done, as ``texforge extract --json`` reports it: version, parameters, seconds,
        notes. Sizes and places in it are (width, height) and (x, y).
    """

    tiles: list[ExtractedTile]
    period: tuple[tuple[float, float], tuple[float, float]]
    found_by: str
    confidence: float | None
    scale: tuple[float, float]
    alpha: float
    sheet: npt.NDArray[Any]
    report: dict[str, Any]

    def save(self, folder: PathType, *, overwrite: bool = False) -> list[Path]:
        """Write the tiles, their maps and tilings and the sheet: all of these files or none.

        They are named as by ``texforge extract``, and as there those of the tiles record how they
        were made.

        Parameters
        ----------
        folder : path
            The folder, made if it is not there: ``tile_01.png``, ``tile_01_normal.png``,
            ``tiling_01.png`` and so on, ``sheet.png``. Floats are written as EXR.
        overwrite : bool
            Whether existing files may be replaced.

        Returns
        -------
        list of Path
            The files, the sheet last.

        Raises
        ------
        OutputExistsError
            If one of the files exists and `overwrite` is False (also a FileExistsError).
        MissingFileError, AccessError, FileError
            If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
        """
        base = Path(_arrays.path(folder))
        files: list[tuple[str, Any, str, str | None]] = []

        def add(
            name: str,
            image: npt.NDArray[Any],
            kind: str,
            encoding: Encoding,
            record: str | None = None,
        ) -> None:
            path = base / f"{name}.{'exr' if image.dtype.kind == 'f' else 'png'}"
            picture = _arrays.picture(image, name, encoding).packed()
            files.append((str(path), picture, kind, record))

        for number, tile in enumerate(self.tiles, 1):
            kind = "data" if tile.encoding == "data" else "color"
            add(f"tile_{number:02}", tile.image, kind, tile.encoding, tile.record)
            for name, image in tile.maps.items():
                of_map = _texforge.map_kind(name)
                encoding: Encoding = "data" if of_map != "color" else tile.encoding
                add(f"tile_{number:02}_{name}", image, of_map, encoding)
            add(f"tiling_{number:02}", tile.tiling(), kind, tile.encoding)
        add("sheet", self.sheet, "color", "srgb")
        with made_folder(base):
            _texforge.write(files=files, overwrite=bool(overwrite))
        return [Path(path) for path, *_ in files]

    def __repr__(self) -> str:
        """Say what it is in one line."""
        (down, _), (_, across) = self.period
        return f"Extraction({len(self.tiles)} tiles, period {down:.2f} x {across:.2f})"

    def _repr_png_(self) -> bytes:
        """Return the sheet, for notebooks."""
        return _api.png(self.sheet)


@contextlib.contextmanager
def made_folder(path: Path) -> Iterator[None]:
    """Make a folder if it is not there, and take it away again if what follows fails."""
    was_there = path.is_dir()
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        fields = {"action": "write", "path": str(path), "errno": error.errno}
        raise from_core("io", f"cannot write {path}: {error.strerror}", fields) from None
    try:
        yield
    except BaseException:
        if not was_there:
            path.rmdir()
        raise


def extract(
    image: ImageLike,
    *,
    period: Literal["auto", "ssd", "lattice"] | tuple[float, float] = "auto",
    periods: int = 1,
    scale: Scaling = "down",
    count: int = 4,
    similarity: Similarity = "squared",
    alpha: float | None = None,
    beta: float = 1.0,
    keep: float = 1.0,
    overlap: float = 0.25,
    min_confidence: float = 0.5,
    flatten: float = 0.0,
    band: int = 0,
    seed: int = 0,
    mask: ImageLike | None = None,
    maps: Mapping[str, ImageLike] | None = None,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
) -> Extraction:
    """Cut the tile out of a photo that repeats that stands best for all of it.

    Cloth, bricks, windows: one period of the photo, which repeated is most like the photo, and
    whose edges fit each other. All positions are tried.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo, of any type that `tile` takes. Pixels that are not wholly opaque are never used.
    period : {"auto", "ssd", "lattice"} or (float, float)
        **(height, width)** of the period in pixels, which may be fractions; or how it is found:
        ``"lattice"`` takes the smallest upright rectangle of what `detect_lattice` finds, ``"ssd"``
        moves the photo along both axes over itself (the paper's way), ``"auto"`` does the first
        and, if that is not sure enough, the second.
    periods : int
        How many periods a tile spans in each direction, 1 to 64.
    scale : {"down", "off"}
        Whether the photo is scaled down a little, and put upright if it leans, so that the period
        is a whole number of pixels, unless it nearly is. ``"off"`` rounds the tile's sides and
        copies the photo's pixels.
    count : int
        How many tiles, 1 to 100; fewer come back if no more fit beside each other.
    similarity : {"squared", "absolute"}
        How differences count, of edges as of the tiling from the photo: ``"squared"`` (the
        paper's), or ``"absolute"``, which a few stains or odd periods do not mislead.
    alpha : float, optional
        Weight of continuity: of how well a tile's edges fit each other. By default such that it
        counts as much as resemblance.
    beta : float
        Weight of resemblance, 0 to 1000000: of how much the tiling is like the photo.
    keep : float
        Share of the positions that is looked at, those with the best fitting edges, 0 to 1: the
        paper's p. 1 looks at all and takes no longer.
    overlap : float
        How much two tiles may overlap, as a share of their area, 0 to 1.
    min_confidence : float
        From which confidence on a period counts as found, 0 to 1.
    flatten : float
        Reach of the light flattening, as a fraction of the photo's shorter side, 0 (off) or 0.02
        to 1, as for `tile`.
    band : int
        Width of a border inside each tile that is made anew out of the photo's other periods, in
        pixels, 5 or more, at most 8192, so that the tile repeats without a seam; 0 leaves it as
        it is.
    seed : int
        Seed of the random choices of a band.
    mask : (H, W) array_like, or Pillow image, optional
        Where the photo may be used: True, or at least half of full scale.
    maps : mapping of str to array_like, optional
        Other maps of the same material by name, of any resolution, to be cut at the same places.
    encoding : {"auto", "srgb", "linear", "data"}
        What the numbers mean, as for `tile`.
    threads : int, optional
        Number of worker threads, as for `tile`.
    progress : bool, callable or bar, optional
        As for `tile`.

    Returns
    -------
    Extraction
        The tiles, the best first, and how they were found.

    Raises
    ------
    NoStructureError
        If the photo has no period that is sure enough (also a ValueError).
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the photo, the mask or a map cannot be used (also a ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    The same arguments give the same bytes on every run, for any number of threads.

    Source: representative tile extraction from near-periodic textures, sec. 3 and 4.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> rng = np.random.default_rng(0)
    >>> cloth = np.tile(rng.integers(0, 200, (24, 30, 3)), (5, 6, 1))
    >>> photo = (cloth + rng.integers(0, 40, cloth.shape)).astype(np.uint8)
    >>> found = texforge.extract(photo, count=2)
    >>> found.tiles[0].image.shape, found.found_by
    ((24, 30, 3), 'lattice')
    >>> found.tiles[0].tiling().shape
    (120, 180, 3)
    """
    values = dict(locals())
    photo = _arrays.picture(image, "the photo", encoding)
    texts = [
        (param["name"], text(param, values[param["name"]])) for param in _texforge.schema("extract")
    ]
    others = {name: _api.maps_of(other, name, 0) for name, other in (maps or {}).items()}
    with reporting(progress) as callback:
        made, of_maps, sheet, report_text = _texforge.extract(
            photo=photo.packed(),
            mask=None if mask is None else _arrays.mask(mask).packed(),
            maps=[
                (name, [one.packed() for one in other], _texforge.map_kind(name))
                for name, other in others.items()
            ],
            params=texts,
            seed=_arrays.integer("seed", seed),
            threads=_arrays.integer("threads", threads or 0, high=1024),
            progress=callback,
        )
    report = json.loads(report_text)
    report["notes"] = [*report["notes"], *photo.notes]
    scaled_width, scaled_height = report["scaled_size"]
    tiles = [
        ExtractedTile(
            image=photo.unpacked(picture),
            place=place,
            photo_place=(photo_place[1], photo_place[0]),
            continuity=continuity,
            resemblance=resemblance,
            score=score,
            maps={name: others[name][0].unpacked(pieces[i]) for name, pieces in of_maps},
            source_map=None if source_map is None else _api.map_positions(source_map),
            scaled_size=(scaled_height, scaled_width),
            encoding=_arrays.array_encoding(picture[3]),
            record=record,
        )
        for i, (
            picture,
            source_map,
            place,
            photo_place,
            (continuity, resemblance, score),
            record,
        ) in enumerate(made)
    ]
    (across_x, across_y), (down_x, down_y) = report["period"]["sides"]
    whole = _arrays.unpacked(sheet)
    return Extraction(
        tiles=tiles,
        period=((down_y, down_x), (across_y, across_x)),
        found_by=report["period"]["by"],
        confidence=report["period"]["confidence"],
        scale=(report["scale"][1], report["scale"][0]),
        alpha=report["alpha"],
        sheet=whole[:, :, 0] if whole.shape[2] == 1 else whole,
        report=report,
    )


def text(param: Mapping[str, Any], value: Any) -> str:
    """Return an argument as the text that the core reads."""
    if param["kind"] == "period" and not isinstance(value, str):
        sides = tuple(value) if isinstance(value, tuple | list) else ()
        if len(sides) != 2:
            raise ParameterError(
                f"`period` must be (height, width), or one of auto, ssd, lattice, got {value!r}",
                fields={"name": "period"},
            )
        height, width = (_arrays.number("period", side) for side in sides)
        return f"{width}x{height}"
    return _api.parameter_text(param, value)
