"""Making near-regular textures of any size."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping  # noqa: TC003 (the signatures can be resolved at run time)
from pathlib import Path
from typing import Any, Literal, Unpack

from texforge import _api, _arrays, _texforge
from texforge._progress import reporting
from texforge._types import (
    Encoding,
    ImageLike,
    Lattice,
    Matching,
    PathType,
    Progress,
    Regular,
    RegularFile,
    RegularOptions,
    Seam,
    Straightening,
    Subpixel,
    Tileable,
)

__all__ = ["regular", "regular_to_file"]


def regular(
    image: ImageLike,
    *,
    size: int | tuple[int, int] | None = None,
    tileable: Tileable = "none",
    lattice: Literal["auto", "none"]
    | Lattice
    | tuple[tuple[float, float], tuple[float, float]] = "auto",
    min_confidence: float = 0.5,
    straighten: Straightening = "on",
    block: int | None = None,
    border: int | None = None,
    sample_candidates: int = 1,
    candidates: int = 64,
    tolerance: int = 3,
    subpixel: Subpixel = "off",
    matching: Matching = "color",
    deform: int = 0,
    seam: Seam = "graph",
    feather: int = 4,
    flatten: float | None = None,
    seed: int = 0,
    mask: ImageLike | None = None,
    maps: Mapping[str, ImageLike] | None = None,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
) -> Regular:
    """Make a texture of any size from a photo of bricks, tiles, cloth or windows.

    It follows the photo's lattice, but where `extract` repeats one cell, here every second block is
    a piece of the photo drawn at random among those that lie at the same place of a cell, and the
    gaps between take the pieces that fit best.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo, of any type that `tile` takes. Pixels that are not wholly opaque are never used.
    size : int or (int, int), optional
        **(height, width)** of the texture in pixels, at most 1048576; one number makes a square.
        By default the photo's own, or the whole periods nearest to it where the texture repeats.
    tileable : {"none", "both", "x", "y"}
        In which directions the texture repeats. A `size` that is given must then be a whole number
        of the photo's periods within 3 %.
    lattice : {"auto", "none"}, Lattice, or ((float, float), (float, float))
        What is followed: what `detect_lattice` finds, or returned; or two displacements in pixels
        of the photo, **(to the right, downwards)** each, of at most half its width and height.
        With ``"none"`` pieces come from anywhere, for textures without a lattice.
    min_confidence : float
        From which confidence on a lattice that was found is followed, 0 to 1.
    straighten : {"off", "on"}
        Whether cells of the photo that lie beside their place on the lattice are put into it.
    block : int, optional
        Side of the blocks that the texture is made of, in pixels, 8 or more: larger keeps more of
        the photo together, smaller mixes more. By default the root of a cell's area, or 64 if that
        is more, as far as the photo is large enough.
    border : int, optional
        How far pieces overlap with their neighbours, to either side, in pixels, 1 to half a block.
        By default 0.45 of a block.
    sample_candidates : int
        How many places are tried for each of the pieces that are drawn at random, 1 to 65536: of
        these the one that agrees best with the random pieces around it is taken. 1 leaves it to
        chance, as in the paper; 16 joins stones and panes of many sizes and colors better, and
        mixes the photo a little less evenly.
    candidates : int
        How many pieces are tried for every gap, 1 to 65536.
    tolerance : int
        How far from its place on the lattice a piece for a gap may come from, in pixels, 0 to 64.
    subpixel : {"off", "on"}
        Whether pieces that the lattice puts between pixels are interpolated there, or moved to the
        nearest pixel and copied. On, joints stay straighter and pixels become a little softer; it
        makes no difference without a lattice.
    matching : {"color", "correlation"}
        By what a piece for a gap is chosen: squared differences of colour, or normalized
        cross-correlation, for which lines count more than brightness.
    deform : int
        How far such a piece may be bent so that lines meet that do not by themselves, in pixels,
        0 (not at all) to 8.
    seam : {"graph", "cut", "linear"}
        How pieces are joined: where the seam shows least, anywhere in the overlap (graph cut);
        along the path of least difference across each side (minimum-error boundary cut); or faded
        over the whole overlap, as in the paper.
    feather : int
        How far the two sides of a seam are faded into each other, in pixels, 0 to 64. With 0
        every pixel is a copy of one of the photo's (unless `subpixel` is on). Linear seams are as
        wide as the border.
    flatten : float, optional
        Reach of the light flattening, as a fraction of the photo's shorter side, 0 (off) or 0.02
        to 1, as for `tile`: else pieces from dark and from bright parts would lie side by side. By
        default a quarter, or more where a period is longer; data is left as it is, and so are
        photos that would change by more than 2.5 times, which is not light.
    seed : int
        Seed of all random choices, 0 to 2**64 - 1.
    mask : (H, W) array_like, or Pillow image, optional
        Where the photo may be used: True, or at least half of full scale.
    maps : mapping of str to array_like, optional
        Other maps of the same material by name, of any resolution, to be put together in the same
        way, seams included. The name decides what a map is, as for `tile`.
    encoding : {"auto", "srgb", "linear", "data"}
        What the numbers mean, as for `tile`.
    threads : int, optional
        Number of worker threads, as for `tile`.
    progress : bool, callable or bar, optional
        As for `tile`.

    Returns
    -------
    Regular
        The texture, where its pixels came from, and the lattice that was followed.

    Raises
    ------
    NoStructureError
        If no lattice that is sure enough was found (also a ValueError).
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the photo, the mask or a map cannot be used: wrong type or shape, constant, smaller than
        a block with its border, NaN or infinities, no piece that the mask leaves whole (also a
        ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    The same arguments give the same bytes on every run, for any number of threads.

    Source: "Near-Regular Texture Synthesis by Random Sampling and Gap Filling" (2011), sec. 4.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> y, x = np.mgrid[:96, :112]
    >>> mortar = (y % 16 < 3) | ((x + y // 16 * 14) % 28 < 3)
    >>> grain = np.random.default_rng(0).integers(0, 40, (96, 112))
    >>> wall = (np.where(mortar, 200, 90) + grain).astype(np.uint8)
    >>> texture = texforge.regular(wall, size=(150, 180), feather=0, flatten=0)
    >>> texture.image.shape, texture.confidence > 0.9
    ((150, 180), True)
    >>> y, x = texture.source_map[..., 0], texture.source_map[..., 1]
    >>> bool(np.all(texture.image == wall[y, x]))
    True
    >>> texforge.regular(wall, tileable="both").image.shape
    (96, 112)
    """
    photo, others, arguments = _packed(dict(locals()))
    with reporting(progress) as callback:
        picture, source_map, of_maps, report_text = _texforge.regular(
            **arguments, progress=callback
        )
    return Regular(
        image=photo.unpacked(picture),
        source_map=_api.map_positions(source_map),
        maps={name: others[name].unpacked(parts) for name, parts in of_maps},
        **_told(report_text, photo),
    )


def regular_to_file(
    image: ImageLike, path: PathType, *, overwrite: bool = False, **options: Unpack[RegularOptions]
) -> RegularFile:
    """Make a texture as `regular` does and write it to a file that may be larger than memory.

    It is written from top to bottom while it is made. The memory that it takes grows with its
    width, not with its height.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo, as for `regular`.
    path : path
        The file: ``.png``, ``.tif`` or ``.exr``. Each of the `maps` goes into a file beside it,
        named after it: ``wall.png`` and ``"normal"`` make ``wall_normal.png``, floats
        ``wall_normal.exr``.
    overwrite : bool
        Whether existing files may be replaced.
    **options
        As for `regular`: size, maps, seed, progress and so on.

    Returns
    -------
    RegularFile
        Where the files are, and how the texture was made.

    Raises
    ------
    OutputExistsError
        If one of the files exists and `overwrite` is False (also a FileExistsError).
    FormatError
        If the format cannot hold the picture, or is not one of those above (also an OSError).
    MissingFileError, AccessError, FileError
        If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
    NoStructureError, ParameterError, PictureError, OutOfMemory, Cancelled
        As for `regular`.

    Notes
    -----
    The files hold the same pixels as what `regular` returns, and the same bytes as those that it
    or ``texforge regular`` writes. All of them appear, or none: if it fails or is interrupted,
    nothing is left behind.

    Examples
    --------
    >>> import numpy as np, pathlib, tempfile
    >>> import texforge
    >>> y, x = np.mgrid[:96, :112]
    >>> mortar = (y % 16 < 3) | ((x + y // 16 * 14) % 28 < 3)
    >>> grain = np.random.default_rng(0).integers(0, 40, (96, 112))
    >>> bricks = (np.where(mortar, 200, 90) + grain).astype(np.uint8)
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "wall.png"
    >>> wall = texforge.regular_to_file(bricks, path, size=(150, 180))
    >>> wall.size, texforge.read_image(wall.path).shape
    ((150, 180), (150, 180))
    """
    call = inspect.signature(regular).bind(image, **options)
    call.apply_defaults()
    photo, others, arguments = _packed(call.arguments)
    place = _arrays.path(path)
    with reporting(call.arguments["progress"]) as callback:
        places, report_text = _texforge.regular_to_file(
            path=place, overwrite=bool(overwrite), **arguments, progress=callback
        )
    told = _told(report_text, photo)
    width, height = told["report"]["size"]
    files = dict(zip(others, places, strict=True))
    return RegularFile(path=Path(place), maps=files, size=(height, width), **told)


def _packed(
    values: Mapping[str, Any],
) -> tuple[_arrays.Picture, dict[str, _arrays.Picture], dict[str, Any]]:
    """Return the photo, its further maps by name, and the arguments of the core but progress."""
    photo = _arrays.picture(values["image"], "the photo", values["encoding"])
    others = {
        name: _api.maps_of(other, name, 0)[0] for name, other in (values["maps"] or {}).items()
    }
    mask = values["mask"]
    return (
        photo,
        others,
        {
            "photo": photo.packed(),
            "mask": None if mask is None else _arrays.mask(mask).packed(),
            "maps": [
                (name, [other.packed()], _texforge.map_kind(name)) for name, other in others.items()
            ],
            "params": [
                (param["name"], _api.parameter_text(param, values[param["name"]]))
                for param in _texforge.schema("regular")
            ],
            "seed": _arrays.integer("seed", values["seed"]),
            "threads": _arrays.integer("threads", values["threads"] or 0, high=1024),
        },
    )


def _told(report_text: str, photo: _arrays.Picture) -> dict[str, Any]:
    """Return what is known of a texture besides its pixels."""
    report = json.loads(report_text)
    report["notes"] = [*report["notes"], *photo.notes]
    return {
        "seed": report["seed"],
        "params": _api.typed_params("regular", report),
        "report": report,
        "encoding": _arrays.array_encoding(photo.encoding),
        "photo_size": (photo.array.shape[0], photo.array.shape[1]),
        "lattice": _vectors(report["lattice"]),
        "lattice_of_texture": _vectors(report["lattice_of_texture"]),
        "confidence": report["confidence"],
    }


def _vectors(basis: Any) -> tuple[tuple[float, float], tuple[float, float]] | None:
    if basis is None:
        return None
    (ax, ay), (bx, by) = basis
    return (ax, ay), (bx, by)
