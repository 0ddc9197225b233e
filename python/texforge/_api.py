"""The public functions: they name and document; the work is done in Rust."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping, Sequence  # noqa: TC003 (the signatures can be resolved at run time)
from typing import Any, Literal, Unpack

import numpy as np
import numpy.typing as npt

from texforge import _arrays, _texforge
from texforge._errors import ParameterError
from texforge._progress import reporting
from texforge._types import (
    Axis,
    Costs,
    Encoding,
    Follow,
    Image,
    ImageLike,
    Lattice,
    MapKind,
    Measure,
    Method,
    PathType,
    Progress,
    Quality,
    Regular,
    SourceMap,
    Step,
    Symmetries,
    Texture,
    Tile,
    TileOptions,
)

__all__ = ["apply", "load_source_map", "read_image", "tile", "tile_variants", "write_image"]

# Longest side of a notebook's picture: larger ones only slow the page down.
_PREVIEW_SIDE = 1024

# Kinds of parameters that are numbers.
_NUMBERS = ("integer", "number", "optional number")


def tile(
    image: ImageLike,
    *,
    size: int | tuple[int, int] | None = None,
    axis: Axis = "both",
    method: Method = "stationary",
    measure: Measure = "histogram",
    order: int = 2,
    sigma: float = 0.1,
    stationarity: float | None = None,
    patch: int = 11,
    uniformity: float = 1.0,
    rarity: float = 0.5,
    quality: Quality = "normal",
    avoid_grow: int = 0,
    flatten: float = 0.0,
    symmetry: Symmetries = "none",
    lattice: Follow = "auto",
    band: int = 0,
    seed: int = 0,
    also: Sequence[ImageLike] | None = None,
    mask: ImageLike | None = None,
    avoid: ImageLike | None = None,
    sigma_map: ImageLike | None = None,
    redo: tuple[int, int, int, int] | None = None,
    redo_of: Tile | SourceMap | npt.ArrayLike | None = None,
    maps: Mapping[str, ImageLike | Sequence[ImageLike]] | None = None,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
    trace: bool = False,
) -> Tile:
    """Turn a photo into a texture that repeats without a seam and without a giveaway blob.

    Every pixel of the tile is a copy of a pixel of the photo (except with the method
    ``"make-seamless"``; see `flatten` for what it does to the photo first), bit for bit.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo, as uint8, uint16, float16, float32 or float64. One channel is grey, two are
        grey and alpha, three RGB, four RGB and alpha; any other number is data. Full scale is
        255, 65535 or 1.0; floats may exceed it. Pixels that are not wholly opaque are never used.
    size : int or (int, int), optional
        **(height, width)** of the tile in pixels, as in ``image.shape``; one number makes a
        square. By default the largest power of two that fits into the photo, at most 2048, or
        whole periods near it: see `lattice`.
    axis : {"both", "x", "y"}
        In which directions the tile repeats: ``"x"`` horizontally only, ``"y"`` vertically only.
    method : {"stationary", "wrap-only", "no-wrap", "make-seamless"}
        How the tile is made. All but the first are baselines to compare with.
    measure : {"histogram", "moments", "steerable", "none"}
        The statistic that is made equal everywhere in the tile: the histograms of the colours,
        their moments, or the histograms of the responses to filters of four orientations, which
        know fine structure but no shades.
    order : int
        With the measure ``"moments"``, how many of them, 1 to 4: the mean, the variance, the
        skewness, the kurtosis.
    sigma : float
        Reach of the measure, as a fraction of the tile's shorter side, 0.01 to 1. Smaller evens
        out smaller stains, larger keeps more variety.
    stationarity : float, optional
        How even the tile becomes, in place of `sigma`, 0 to 1: equal steps look like equal steps,
        whatever the photo (Sec. 4.4 of the paper). 0 evens out least, 1 until little but one
        material is left. What sigma that is, is found by trying, which takes about a second;
        ``tile.params["sigma"]`` says it. `palette` shows the range.
    patch : int
        Side of the patches that are compared, in pixels; odd, 3 to 21. Larger keeps larger
        features whole, smaller mixes more.
    uniformity : float
        How strongly every part of the photo is made to contribute equally, 0 (not at all) to 100.
    rarity : float
        How strongly single things that catch the eye (a leaf, a nail, a dark spot) are held
        back, 0 (not at all) to 4. For the method ``"stationary"``.
    quality : {"draft", "normal", "best"}
        How much time to spend.
    avoid_grow : int
        How far the marks of `avoid` are grown, in pixels, 0 to 10000: nothing this near to a mark
        (as the crow flies) is copied.
    flatten : float
        Reach of the light flattening, as a fraction of the photo's shorter side, 0 (off) or 0.02
        to 1: differences of light and of its colour that are wider are divided out of the photo
        before it is used. The tile then is made of the flattened photo's pixels; `maps` are left
        as they are.
    symmetry : {"none", "mirror", "rotate", "all"}
        Whether patches of the photo are also used mirrored left to right, turned by quarters, or
        both: more to choose from, but light then falls from several sides. Time and memory grow
        with it, up to eight photos'.
    lattice : {"off", "auto"}
        Whether a photo that repeats (bricks, tiles, weave) stays in step, as far as
        `detect_lattice` finds its periods. The default size then is a whole number of them, and a
        given `size` holds the nearest number of them, a little narrower or wider, if that is one
        within 45 %. Another cuts some, but straight rows (the courses of bricks) stay so if a
        whole number of them fits within 3 %; a note in ``tile.report["notes"]`` says what was
        kept and which size would do without. For the method
        ``"stationary"``, of one photo as it lies, without a band.
    band : int
        Width of the border that is made anew, in pixels, so that the photo repeats; its middle
        stays as it is, pixel for pixel. At least `patch`, at most 8192; 0 makes all anew. The tile
        then is as large as the photo, unless `size` cuts out its middle.
    seed : int
        Seed of all random choices, 0 to 2**64 - 1.
    also : sequence of array_like or Pillow images, optional
        Further photos to mix with the first, of its data type and channels and of any sizes. What
        is wholly opaque in them may be used; `mask` and `avoid` are those of the first.
    mask : (H, W) array_like, or Pillow image, optional
        Where the photo may be used: True, or at least half of full scale (128 of 255).
    avoid : (H, W) array_like, or Pillow image, optional
        What must not be copied from the photo, such as stains: marks that are True, or at least
        half of full scale. May be given together with `mask`.
    sigma_map : (H', W') array_like, or Pillow image, optional
        Sigma at every pixel of the tile (and of its size), in place of `sigma`. Floats are sigma
        itself, 0.01 to 1. Of integers black is 0.01, half of full scale 0.1 and white 1, in even
        factors. ``costs.stationarity`` is measured with `sigma` still.
    redo : (int, int, int, int), optional
        **(y, x, height, width)** of a rectangle of the tile `redo_of` in pixels: only that is
        made anew, and grows out of the rest, which stays as it is, pixel for pixel. It may reach
        over the bottom and the right edge if the tile repeats there, and must leave a patch's
        side of rows or columns. What was in it is not to come back, even with the same `seed`,
        but for a rim of half a patch, where the new joins the old; other seeds make other
        choices (`tile_variants` makes several).
    redo_of : Tile, SourceMap or (H', W', 2) array_like of int, optional
        The tile, or its source map, for `redo`. The photos must be those that it was made of, in
        their order; `symmetry` must have all that it uses, and `flatten` must be the tile's for
        its pixels to stay the same. `size` is the tile's. `mask` and `avoid` say what may come
        in, and change nothing outside of the rectangle.
    maps : mapping of str to array_like, optional
        Other maps of the same material by name, to be tiled the same way. The name decides what
        a map is: base colour and emission are colours, normals are vectors (turned with the photo
        and of unit length), everything else is data. With further photos, each is a sequence of
        one map a photo. With quarter turns a map of normals must say which way green points:
        ``normal_gl`` (up) or ``normal_dx`` (down).
    encoding : {"auto", "srgb", "linear", "data"}
        What the photo's numbers mean: display-referred sRGB, linear light with sRGB primaries,
        or numbers that are no colours (then there is no alpha either). ``"auto"`` is what
        `read_image` found out about its pictures, and sRGB for all others: also for floats,
        which usually are 8-bit pictures divided by 255, as scikit-image makes them. Say
        ``"linear"`` for floats that come from elsewhere and are linear, such as renderings.
    threads : int, optional
        Number of worker threads, at most 1024; None or 0: one per core. Does not change the
        result.
    progress : bool, callable or bar, optional
        True shows a tqdm bar. A function is called on this thread, with the fraction done from
        0.0 to 1.0; returning False cancels, and exceptions pass through. An object with
        ``update``, such as ``tqdm.tqdm(total=1.0)``, is moved on.
    trace : bool
        Whether to measure the costs of every iteration, as `Tile.trace`. The pixels are the same;
        it takes longer.

    Returns
    -------
    Tile
        The picture, the map of where each pixel came from, and what it costs.

    Raises
    ------
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the photo, the mask or a map cannot be used: wrong type or shape, too small, NaN or
        infinities, nothing left by the mask (also a ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.
    KeyboardInterrupt
        On Ctrl-C, at once; other threads of Python run on meanwhile.

    Notes
    -----
    The same photo, arguments and seed give the same bytes on every run and every machine, for
    any number of threads. Arrays are copied before the work starts.

    Source: J. Moritz, S. James, T. S. F. Haines, T. Ritschel, T. Weyrich, "Texture
    Stationarization: Turning Photos into Tileable Textures", Computer Graphics Forum 36(2), 2017.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> photo = np.random.default_rng(0).integers(0, 256, (80, 100, 3), dtype=np.uint8)
    >>> tile = texforge.tile(photo, size=(32, 48), quality="draft")
    >>> tile.image.shape, tile.image.dtype
    ((32, 48, 3), dtype('uint8'))
    >>> y, x = tile.source_map[..., 0], tile.source_map[..., 1]
    >>> bool(np.all(tile.image == photo[y, x]))
    True
    >>> other = texforge.tile(photo, redo=(4, 30, 12, 24), redo_of=tile)
    >>> changed = np.any(other.image != tile.image, axis=2)
    >>> rows, columns = np.nonzero(changed)  # over the right edge: 30 to 47, and 0 to 5
    >>> set(columns) <= {*range(30, 48), *range(6)} and set(rows) <= {*range(4, 16)}
    True
    """
    arguments = locals()
    (made,), _ = tiles(1, as_palette=False, **arguments)
    return made


def tile_variants(image: ImageLike, count: int, **options: Unpack[TileOptions]) -> list[Tile]:
    """Make several tiles of one photo, which is analysed once.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo.
    count : int
        How many, 1 to 1000. The first is what `tile` makes of the same arguments; the others have
        the seeds after its `seed`.
    **options
        Those of `tile`.

    Returns
    -------
    list of Tile
        All of them; choose.

    Raises
    ------
    ParameterError
        If `count` is out of range, more than 1 with the method ``"make-seamless"``, which makes
        no random choices, or leads beyond the last seed; and as `tile`.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> photo = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    >>> tiles = texforge.tile_variants(photo, 3, size=32, seed=5, quality="draft")
    >>> best = min(tiles, key=lambda tile: tile.costs.stationarity)
    >>> best.seed in (5, 6, 7)
    True
    """
    arguments = inspect.signature(tile).bind(image, **options)
    arguments.apply_defaults()
    count = _arrays.integer("count", count, 1, 1000)
    made, _ = tiles(count, as_palette=False, **arguments.arguments)
    return made


def tiles(
    count: int,
    *,
    as_palette: bool,
    image: ImageLike,
    seed: int,
    also: Sequence[ImageLike] | None,
    mask: ImageLike | None,
    avoid: ImageLike | None,
    sigma_map: ImageLike | None,
    redo: tuple[int, int, int, int] | None,
    redo_of: Tile | SourceMap | npt.ArrayLike | None,
    maps: Mapping[str, ImageLike | Sequence[ImageLike]] | None,
    encoding: Encoding | Literal["auto"],
    threads: int | None,
    progress: Progress,
    trace: bool,
    **params: Any,
) -> tuple[list[Tile], Any]:
    """Make tiles of neighbouring seeds, or those of a palette and what else it is."""
    photo = _arrays.picture(image, "the photo", encoding)
    further = [
        _arrays.picture(other, f"photo {i}", encoding) for i, other in enumerate(also or (), 2)
    ]
    texts = [
        (param["name"], parameter_text(param, params[param["name"]]))
        for param in _texforge.schema()
    ]
    if maps and params["method"] == "make-seamless":
        raise ParameterError(
            "`maps` must be empty with method 'make-seamless', which blends and so leaves nothing "
            f"to apply to other maps, got {', '.join(map(repr, maps))}",
            fields={"name": "maps"},
        )
    others = {name: maps_of(other, name, len(further)) for name, other in (maps or {}).items()}
    kinds = {name: _texforge.map_kind(name) for name in others}
    with reporting(progress) as callback:
        made, rest = _texforge.tiles(
            photo=photo.packed(),
            also=[other.packed() for other in further],
            mask=None if mask is None else _arrays.mask(mask).packed(),
            avoid=None if avoid is None else _arrays.mask(avoid, "the avoid mask").packed(),
            sigma_map=None
            if sigma_map is None
            else _arrays.picture(sigma_map, "the sigma map", "data").packed(),
            redo=_redone(redo, redo_of, photo),
            maps=[
                (name, [other.packed() for other in all_of_it], kinds[name])
                for name, all_of_it in others.items()
            ],
            params=texts,
            seed=_arrays.integer("seed", seed),
            count=count,
            as_palette=as_palette,
            threads=_arrays.integer("threads", threads or 0, high=1024),
            progress=callback,
            trace=bool(trace),
        )
    return [_tile(photo, others, parts) for parts in made], rest


def _tile(photo: _arrays.Picture, others: dict[str, list[_arrays.Picture]], parts: Any) -> Tile:
    picture_out, map_out, maps_out, report_text, steps = parts
    report = json.loads(report_text)
    report["notes"] = [*report["notes"], *photo.notes]
    return Tile(
        image=photo.unpacked(picture_out),
        source_map=None if map_out is None else map_positions(map_out),
        costs=Costs(**report["costs"]),
        seed=report["seed"],
        params=typed_params("tile", report),
        report=report,
        maps={name: others[name][0].unpacked(parts) for name, parts in maps_out},
        encoding=_arrays.array_encoding(picture_out[3]),
        photo_size=(photo.array.shape[0], photo.array.shape[1]),
        trace=[Step(level, i, texture or 0.0, even) for level, i, texture, even in steps],
        also_sizes=() if map_out is None else tuple(map_out[2][1:]),
        origins=None if map_out is None else _origins(map_out),
    )


def apply(
    source_map: Tile | Regular | SourceMap | npt.ArrayLike,
    image: ImageLike,
    *,
    kind: MapKind = "data",
    source_size: tuple[int, int] | None = None,
    also: Sequence[ImageLike] = (),
) -> npt.NDArray[Any]:
    """Replay a source map on another map of the photo's material.

    Parameters
    ----------
    source_map : Tile, Regular, SourceMap or (H, W, 2) array_like of int
        Row and column of the photo's pixel that each pixel of the texture is a copy of.
    image : (H', W') or (H', W', C) array_like, or Pillow image
        The map, showing the same as the photo. At another resolution (but the same aspect ratio)
        it is read in between its pixels, bilinearly; otherwise values are copied bit for bit.
    kind : {"data", "color", "normal", "normal_gl", "normal_dx"}
        What the map's numbers are. Normals, stored as ``(n + 1) / 2``, are turned with the photo
        and come out with unit length; if the photo was turned by quarters, they must be
        ``"normal_gl"`` (green points up) or ``"normal_dx"`` (down).
    source_size : (int, int), optional
        Height and width of the photo, for a `source_map` that is a plain array; by default
        those of `image`.
    also : sequence of array_like, optional
        The same map of each further photo, for a tile made of several.

    Returns
    -------
    (H, W) or (H, W, C) ndarray
        The map's tile, of the map's data type.

    Raises
    ------
    PictureError
        If the map has another aspect ratio than the photo, or a position lies outside.
    ParameterError
        If `kind` is unknown, or the tile was made by blending and so has no source map.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> height = np.array([[0.0, 0.25], [0.5, 1.0]])
    >>> texforge.apply([[[1, 1], [0, 1], [0, 0]]], height)
    array([[1.  , 0.25, 0.  ]])
    """
    if isinstance(source_map, Texture):
        source_map = _source_map_of(source_map)
    encoding: Literal["auto", "data"] = "auto" if kind == "color" else "data"
    other = _arrays.picture(image, "the map", encoding)
    further = [_arrays.picture(one, f"map {i}", encoding) for i, one in enumerate(also, 2)]
    if not isinstance(source_map, SourceMap):
        if source_size is None:
            source_size = (other.array.shape[0], other.array.shape[1])
        source_map = SourceMap(_arrays.positions(source_map), source_size)
    out = _texforge.apply(
        source_map=_arrays.packed_map(source_map),
        pictures=[one.packed() for one in (other, *further)],
        kind=_arrays.word("kind", kind),
    )
    return other.unpacked(out)


def read_image(path: PathType, *, kind: MapKind = "color") -> Image:
    """Read a picture with all the bits it has.

    Reads PNG (8 and 16 bits), JPEG, TIFF, WebP, EXR, BMP, TGA, PNM and GIF. The camera's
    orientation is applied; colours are converted to sRGB (integers) or linear light (floats).

    Parameters
    ----------
    path : path
        The file.
    kind : {"color", "data", "normal", "normal_gl", "normal_dx"}
        What its numbers are. Only colours are converted.

    Returns
    -------
    (H, W) or (H, W, C) Image
        An array that remembers its encoding, of uint8, uint16, float16 or float32.

    Raises
    ------
    ReadError
        If the file is damaged or no picture.
    MissingFileError, AccessError, FileError
        If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
    OutOfMemory
        If the picture would not fit into memory.
    """
    parts = _texforge.read(path=_arrays.path(path), kind=_arrays.word("kind", kind))
    array = _arrays.unpacked(parts)
    flat = array[:, :, 0] if array.shape[2] == 1 else array
    return Image.tagged(flat, _arrays.array_encoding(parts[3]))


def write_image(
    path: PathType,
    image: ImageLike,
    *,
    kind: MapKind = "color",
    encoding: Encoding | Literal["auto"] = "auto",
    overwrite: bool = False,
) -> None:
    """Write a picture with all the bits it has, at once or not at all.

    Parameters
    ----------
    path : path
        The file; its extension decides the format.
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The picture. What the format cannot hold is refused, never rounded away.
    kind : {"color", "data", "normal", "normal_gl", "normal_dx"}
        What its numbers are.
    encoding : {"auto", "srgb", "linear", "data"}
        What a colour picture's numbers mean, as for `tile`.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    OutputExistsError
        If the file exists and `overwrite` is False (also a FileExistsError).
    FormatError
        If the format is unknown or cannot hold the picture.
    MissingFileError, AccessError, FileError
        If the operating system refuses (also FileNotFoundError, PermissionError, OSError).

    Examples
    --------
    >>> import numpy as np, pathlib, tempfile
    >>> import texforge
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "height.png"
    >>> texforge.write_image(path, np.array([[0, 65535]], np.uint16), kind="data")
    >>> texforge.read_image(path, kind="data").tolist()
    [[0, 65535]]
    """
    picture = _arrays.picture(image, "the picture", encoding if kind == "color" else "data")
    _texforge.write(
        files=[(_arrays.path(path), picture.packed(), _arrays.word("kind", kind), None)],
        overwrite=bool(overwrite),
    )


def load_source_map(path: PathType) -> SourceMap:
    """Read a source map written by `Tile.save_source_map` or ``texforge tile --save-source-map``.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    SourceMap
        The positions and the photo's size.

    Raises
    ------
    ReadError
        If the file is damaged or holds no source map.
    MissingFileError, AccessError, FileError
        If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
    """
    parts = _texforge.read_source_map(path=_arrays.path(path))
    first, *further = parts[2]
    return SourceMap(map_positions(parts), first, tuple(further), _origins(parts))


def save_source_map(texture: Texture, path: PathType, *, overwrite: bool) -> None:
    """See `Tile.save_source_map`."""
    _texforge.write_source_map(
        path=_arrays.path(path),
        source_map=_arrays.packed_map(_source_map_of(texture)),
        overwrite=bool(overwrite),
    )


def save_texture(texture: Texture, path: PathType, *, verb: str, overwrite: bool) -> None:
    """See `Tile.save`."""
    numbers = {p["name"] for p in _texforge.schema(verb) if p["kind"] in _NUMBERS}
    params = {
        name: text if name not in numbers else None if text == "none" else json.loads(text)
        for name, text in texture.report["params"]
    }
    # As the command line writes it, so that equal textures make equal files.
    made = {
        "tool": "texforge",
        "version": texture.report["version"],
        "verb": verb,
        "seed": texture.seed,
        "params": params,
    }
    if "redo" in texture.report:
        made["redo"] = texture.report["redo"]
    picture = _arrays.picture(texture.image, f"the {verb}", texture.encoding).packed()
    kind = "data" if texture.encoding == "data" else "color"
    record = json.dumps(made, sort_keys=True, separators=(",", ":"))
    _texforge.write(files=[(_arrays.path(path), picture, kind, record)], overwrite=bool(overwrite))


def preview_png(
    picture: npt.NDArray[Any], encoding: Encoding, times: tuple[int, int]
) -> bytes | None:
    """Return a picture, so many times downwards and across, as an 8-bit PNG that fits a screen.

    None for data that is no picture.
    """
    image = _arrays.displayable(picture, encoding)
    if image is None:
        return None
    image = np.tile(image, (*times, 1))
    # Averages whole blocks; texels at the far edge that fill no block are left out.
    step = -(-max(image.shape[:2]) // _PREVIEW_SIDE)
    if step > 1:
        height, width, channels = image.shape[0] // step, image.shape[1] // step, image.shape[2]
        blocks = image[: height * step, : width * step].reshape(height, step, width, step, channels)
        image = blocks.mean(axis=(1, 3)).round().astype(np.uint8)
    return png(image)


def png(image: npt.NDArray[Any]) -> bytes:
    """Return a picture to look at as a PNG."""
    return bytes(_texforge.encode_png(picture=_arrays.picture(image, "the preview").packed()))


def _source_map_of(texture: Texture) -> SourceMap:
    if texture.source_map is None:
        raise ParameterError(
            "`source_map` must be that of a tile made of copied pixels, got None: the method "
            "'make-seamless' blends; choose another method",
            fields={"name": "source_map"},
        )
    if texture.params.get("subpixel") == "on":
        raise ParameterError(
            "`source_map` must be that of a texture made of copied pixels, got one made with "
            '`subpixel` "on"; give the maps to `texforge.regular` (`maps`), or leave it off',
            fields={"name": "source_map"},
        )
    if isinstance(texture, Tile):
        also = (texture.also_sizes, texture.origins)
        return SourceMap(texture.source_map, texture.photo_size, *also)
    return SourceMap(texture.source_map, texture.photo_size)


def _redone(redo: object, redo_of: Any, photo: _arrays.Picture) -> Any:
    """Return the tile to redo and the rectangle as the parts that the core takes."""
    if (redo is None) != (redo_of is None):
        name, other = ("redo", "redo_of") if redo_of is None else ("redo_of", "redo")
        raise ParameterError(
            f"`{name}` must be given together with `{other}`, got it alone", fields={"name": name}
        )
    if redo is None:
        return None
    if not isinstance(redo, tuple | list) or len(redo) != 4:
        raise ParameterError(
            f"`redo` must be (y, x, height, width), got {redo!r}", fields={"name": "redo"}
        )
    if isinstance(redo_of, Tile):
        redo_of = _source_map_of(redo_of)
    if not isinstance(redo_of, SourceMap):
        size = (photo.array.shape[0], photo.array.shape[1])
        redo_of = SourceMap(_arrays.positions(redo_of), size)
    return _arrays.packed_map(redo_of), [_arrays.integer("redo", side, 0, 2**31) for side in redo]


def maps_of(images: Any, name: object, further: int) -> list[_arrays.Picture]:
    """Return a map of each photo; with one photo `images` is the map itself."""
    if not isinstance(name, str):
        raise ParameterError(
            f"`maps` must be a mapping with names as keys, got the key {name!r}",
            fields={"name": "maps"},
        )
    encoding = "auto" if _texforge.map_kind(name) == "color" else "data"
    if not further:
        return [_arrays.picture(images, f"the map `{name}`", encoding)]
    if not isinstance(images, list | tuple) or len(images) != 1 + further:
        got = f"{len(images)}" if isinstance(images, list | tuple) else type(images).__name__
        raise ParameterError(
            f"`maps` must be a list of {1 + further} for each name, one of each photo, "
            f"got {got} for {name!r}",
            fields={"name": "maps"},
        )
    return [_arrays.picture(image, f"the map `{name}`", encoding) for image in images]


def map_positions(parts: Any) -> npt.NDArray[np.int32]:
    data, (height, width), _, _ = parts
    return np.frombuffer(data, dtype=np.int32).reshape(height, width, 2)


def _origins(parts: Any) -> npt.NDArray[np.int32] | None:
    _, (height, width), _, origins = parts
    if origins is None:
        return None
    return np.frombuffer(origins, dtype=np.int32).reshape(height, width, 2)


def _pair(name: str, value: Any, expected: str) -> tuple[Any, Any]:
    """Return the two things that an argument consists of."""
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise ParameterError(f"`{name}` must be {expected}, got {value!r}", fields={"name": name})
    return value[0], value[1]


def parameter_text(param: Mapping[str, Any], value: Any) -> str:
    """Return a parameter of the schema as the text that the core reads."""
    name, kind = param["name"], param["kind"]
    if value is None and kind in ("size", *_NUMBERS) and param["default"] in ("auto", "none"):
        return str(param["default"])
    if kind == "size":
        sides = value if isinstance(value, tuple | list) else (value, value)
        height, width = (
            _arrays.integer(name, side, 1)
            for side in _pair(name, sides, "one number or (height, width)")
        )
        return f"{width}x{height}"
    if kind == "integer":
        return str(_arrays.integer(name, value))
    if kind == "lattice" and not isinstance(value, str):
        expected = '"auto", "none", a Lattice or two displacements ((x, y), (x, y))'
        vectors = (value.v1, value.v2) if isinstance(value, Lattice) else value
        numbers = [
            _arrays.number(name, number)
            for vector in _pair(name, vectors, expected)
            for number in _pair(name, vector, expected)
        ]
        return ",".join(numbers)
    return _arrays.number(name, value) if kind in _NUMBERS else _arrays.word(name, value)


def typed_params(verb: str, report: Mapping[str, Any]) -> dict[str, Any]:
    """Return a report's parameters, written as text, in the types that the function takes."""
    texts = dict(report["params"])
    return {p["name"]: _typed(p["kind"], texts[p["name"]]) for p in _texforge.schema(verb)}


def _typed(kind: str, text: str) -> Any:
    if kind == "size":
        return None if text == "auto" else tuple(map(int, reversed(text.split("x"))))
    if kind == "integer":
        return int(text)
    if kind in _NUMBERS:
        return None if text == "none" else float(text)
    if kind == "lattice" and text != "none":
        ax, ay, bx, by = map(float, text.split(","))
        return (ax, ay), (bx, by)
    return text
