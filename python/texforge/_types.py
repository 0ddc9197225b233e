"""The types of arguments and results."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path  # noqa: TC003 (the annotations can be resolved at run time)
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    Protocol,
    TypeAlias,
    TypedDict,
)

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from typing import Self

__all__ = [
    "Axis",
    "Bands",
    "Costs",
    "Encoding",
    "ExportTarget",
    "Follow",
    "Histogram",
    "Image",
    "ImageLike",
    "Lattice",
    "MapKind",
    "Matching",
    "Measure",
    "Method",
    "Model",
    "PathType",
    "Progress",
    "ProgressBar",
    "Quality",
    "Regular",
    "RegularFile",
    "RegularOptions",
    "SampleType",
    "Scaling",
    "Seam",
    "Similarity",
    "Snap",
    "SourceMap",
    "Step",
    "Straightening",
    "Subpixel",
    "Symmetries",
    "TextureCost",
    "Tile",
    "TileOptions",
    "TileSet",
    "Tileable",
    "Weights",
]

# Unions, not Literal["a", "b"]: mypy holds both for the same, stubtest only the union.
Axis: TypeAlias = Literal["both"] | Literal["x"] | Literal["y"]
"""In which directions a tile repeats."""
Method: TypeAlias = (
    Literal["stationary"] | Literal["wrap-only"] | Literal["no-wrap"] | Literal["make-seamless"]
)
"""How a tile is made."""
Measure: TypeAlias = (
    Literal["histogram"] | Literal["moments"] | Literal["steerable"] | Literal["none"]
)
"""The statistic that is made equal everywhere in a tile."""
Quality: TypeAlias = Literal["draft"] | Literal["normal"] | Literal["best"]
"""How much time to spend."""
Symmetries: TypeAlias = Literal["none"] | Literal["mirror"] | Literal["rotate"] | Literal["all"]
"""In which symmetries the photo's patches are used."""
Follow: TypeAlias = Literal["off"] | Literal["auto"]
"""Whether a tile follows the photo's lattice."""
Scaling: TypeAlias = Literal["down"] | Literal["off"]
"""Whether a photo is scaled so that its period is a whole number of pixels."""
TileSet: TypeAlias = Literal["complete"] | Literal["minimal"]
"""Which Wang tiles a set holds."""
Similarity: TypeAlias = Literal["squared"] | Literal["absolute"]
"""How differences of colours count."""
Tileable: TypeAlias = Literal["none"] | Literal["both"] | Literal["x"] | Literal["y"]
"""In which directions a near-regular texture repeats."""
Straightening: TypeAlias = Literal["off"] | Literal["on"]
"""Whether cells that lie beside their place on the lattice are put into it."""
Subpixel: TypeAlias = Literal["off"] | Literal["on"]
"""Whether pieces that the lattice puts between pixels are interpolated there."""
Matching: TypeAlias = Literal["color"] | Literal["correlation"]
"""By what a piece for a gap is chosen."""
Seam: TypeAlias = Literal["graph"] | Literal["cut"] | Literal["linear"]
"""How pieces are joined."""
Model: TypeAlias = Literal["auto"] | Literal["wavelet"] | Literal["oriented"] | Literal["tiling"]
"""Which kind of procedural texture is fitted."""
Bands: TypeAlias = Literal["round"] | Literal["square"]
"""The shape of a noise's bands in the spectrum."""
Weights: TypeAlias = Literal["corrected"] | Literal["direct"]
"""How the bands' weights follow from the photo's spectrum."""
Histogram: TypeAlias = Literal["kept"] | Literal["normal"]
"""What becomes of the photo's histograms."""
ExportTarget: TypeAlias = (
    Literal["glsl"]
    | Literal["glsl-es"]
    | Literal["wgsl"]
    | Literal["hlsl"]
    | Literal["osl"]
    | Literal["materialx"]
    | Literal["blender"]
)
"""A language or a program that a procedural texture is written for."""
SampleType: TypeAlias = Literal["uint8"] | Literal["uint16"] | Literal["float32"]
"""The samples of a rendered picture."""
Encoding: TypeAlias = Literal["srgb"] | Literal["linear"] | Literal["data"]
"""What the numbers of a picture mean."""
MapKind: TypeAlias = (
    Literal["color"]
    | Literal["data"]
    | Literal["normal"]
    | Literal["normal_gl"]
    | Literal["normal_dx"]
)
"""What the numbers of a material's map mean."""
PathType: TypeAlias = str | PathLike[str]
"""Where a file is."""


class ProgressBar(Protocol):
    """A progress bar like tqdm's."""

    def update(self, n: float, /) -> object:
        """Move the bar on by `n`, in units of its `total` (1 if it has none)."""


class _PillowImage(Protocol):
    @property
    def __array_interface__(self) -> dict[str, Any]: ...


ImageLike: TypeAlias = npt.ArrayLike | _PillowImage
"""Anything that `numpy.asarray` makes a picture of, or a Pillow image."""
Progress: TypeAlias = bool | Callable[[float], object] | ProgressBar | None
"""What `progress=` may be: see `texforge.tile`."""


class TileOptions(TypedDict, total=False):
    """The options of `texforge.tile`, for `texforge.tile_variants` and `texforge.palette`."""

    size: int | tuple[int, int] | None
    axis: Axis
    method: Method
    measure: Measure
    order: int
    sigma: float
    stationarity: float | None
    patch: int
    uniformity: float
    rarity: float
    quality: Quality
    avoid_grow: int
    flatten: float
    symmetry: Symmetries
    lattice: Follow
    band: int
    seed: int
    also: Sequence[ImageLike] | None
    mask: ImageLike | None
    avoid: ImageLike | None
    sigma_map: ImageLike | None
    redo: tuple[int, int, int, int] | None
    redo_of: Tile | SourceMap | npt.ArrayLike | None
    maps: Mapping[str, ImageLike | Sequence[ImageLike]] | None
    encoding: Encoding | Literal["auto"]
    threads: int | None
    progress: Progress
    trace: bool


class RegularOptions(TypedDict, total=False):
    """The options of `texforge.regular`, for `texforge.regular_to_file`."""

    size: int | tuple[int, int] | None
    tileable: Tileable
    lattice: Literal["auto", "none"] | Lattice | tuple[tuple[float, float], tuple[float, float]]
    min_confidence: float
    straighten: Straightening
    block: int | None
    border: int | None
    sample_candidates: int
    candidates: int
    tolerance: int
    subpixel: Subpixel
    matching: Matching
    deform: int
    seam: Seam
    feather: int
    flatten: float | None
    seed: int
    mask: ImageLike | None
    maps: Mapping[str, ImageLike] | None
    encoding: Encoding | Literal["auto"]
    threads: int | None
    progress: Progress


class Image(np.ndarray[Any, np.dtype[Any]]):
    """An array that remembers what its numbers mean, as `read_image` returns it.

    It is an ordinary numpy array in every other respect; ``numpy.asarray(image)`` is one without
    the memory. What is computed from it has the same `encoding`.

    Attributes
    ----------
    encoding : {"srgb", "linear", "data"}
        Display-referred sRGB, linear light with sRGB primaries, or numbers that are no colours.
    """

    encoding: Encoding

    def __array_finalize__(self, parent: Any) -> None:
        """Take over the encoding of the array that this one is made from."""
        self.encoding = getattr(parent, "encoding", "srgb")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle with the encoding."""
        return Image.tagged, (np.array(self), self.encoding)

    @classmethod
    def tagged(cls, array: npt.NDArray[Any], encoding: Encoding) -> Self:
        """Return a view of `array` that says what its numbers mean."""
        image = array.view(cls)
        image.encoding = encoding
        return image


@dataclasses.dataclass(frozen=True)
class Costs:
    """What a tile costs, measured on the finished picture; lower is better.

    Attributes
    ----------
    texture : float or None
        Mean squared CIE L*a*b* distance, per pixel of a patch, between the tile's patches and
        the photo's patches that they were copied from. High where copies do not fit together.
        None for the method ``"make-seamless"``, which blends.
    stationarity : float
        Mean earth mover's distance between the local histograms of two places of the tile, in
        CIE L*a*b* units. High where one part of the tile looks different from another. The same
        for all measures, so that tiles can be compared.
    stationarity_by_measure : float or None
        The cost under the measure that the tile was made with. ``"histogram"``: as
        `stationarity`. ``"moments"``: mean squared difference of two places' moments (of values
        counted from the mean in tens of units), in CIE L*a*b* units squared. ``"steerable"``: mean
        earth mover's distance, summed over twelve responses. To be compared between tiles of
        the same measure and order only. None for ``"none"``.
    """

    texture: float | None
    stationarity: float
    stationarity_by_measure: float | None

    def __str__(self) -> str:
        """Say both in words."""
        texture = "" if self.texture is None else f"texture cost {self.texture:.3g}, "
        return f"{texture}stationarity cost {self.stationarity:.3g}"


@dataclasses.dataclass(frozen=True)
class TextureCost:
    """The texture cost by its definition, estimated from a random sample: see `texture_cost`.

    Attributes
    ----------
    mean : float
        Mean squared CIE L*a*b* distance, per pixel of a patch, between the texture's patches and
        the nearest of all the photo's patches; an estimate of the mean over all patches, with a
        bias far below its margin.
    margin : float
        Half the width of the 95 % confidence interval around `mean`; 0 if nothing was left
        to chance.
    samples : int
        How many patches were compared with all of the photo's. Fewer than were asked for if there
        are no more whose cost is not known to be 0 from where the tile's pixels come from.
    """

    mean: float
    margin: float
    samples: int


class Step(NamedTuple):
    """What an iteration has come to: one line of `Tile.trace`.

    The costs are those of `Tile.costs`, for the tile that would have been delivered if the work
    had stopped here, before seams are settled: its pixels are the middles of the matched patches.
    They are measured at the level's resolution: `texture` against the photo at that level,
    `stationarity` with a window that is a fraction of the level's own size.

    Attributes
    ----------
    level : int
        Level of the pyramid: 0 has the tile's size, every further one is smaller by 1.3.
    iteration : int
        Iteration at this level, from 1. The last of level 0 is the finished tile, and has exactly
        its `costs`: one more than there are iterations, as seams are settled after them.
    texture : float
        Texture cost, in squared CIE L*a*b* units.
    stationarity : float
        Stationarity cost, in CIE L*a*b* units.
    """

    level: int
    iteration: int
    texture: float
    stationarity: float


class Snap(NamedTuple):
    """A size after which a lattice repeats on both axes: see `Lattice.snap`."""

    size: tuple[int, int]
    """Height and width in pixels, after scaling."""
    scale: tuple[float, float]
    """By what height and width of the photo must be multiplied so that `size` is a whole number of
    periods; within 3 % of 1."""
    periods: tuple[tuple[int, int], tuple[int, int]]
    """How often `v1` and `v2` are in the vertical displacement, and in the horizontal one."""
    misfit: tuple[float, float]
    """By how many pixels of the photo the vertical displacement misses the vertical and the
    horizontal one the horizontal, which scaling cannot mend; at most half a pixel or 3 % of
    `v1`."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Lattice:
    """By which displacements a photo repeats, found by `texforge.detect_lattice`.

    In a notebook it shows itself drawn over the photo.

    Attributes
    ----------
    v1 : (float, float)
        The shortest displacement, in pixels: to the right, downwards.
    v2 : (float, float)
        The shortest that is no multiple of `v1`. Both point from 70 degrees above the right to 110
        degrees below it.
    confidence : float
        How sure it is that the photo has a lattice and this is it, 0 to 1.
    found : bool
        Whether the confidence reaches `min_confidence`. Else the vectors are but the best guess.
    goodness : float
        What candidates were compared by.
    correlation : float
        The mean autocorrelation at the lattice's displacements, of the colors or of the edges:
        where the lattice was found; -1 to 1.
    photo : (H, W) or (H, W, C) ndarray
        The photo.
    encoding : {"srgb", "linear", "data"}
        What its numbers mean.
    autocorrelation : (2h - 1, 2w - 1) ndarray of float32, or None
        The generalized normalized autocorrelation of the photo's colors, reduced to h x w pixels
        with its light evened out, if it was asked for: -1 to 1, no displacement in the middle.
    autocorrelation_scale : (float, float) or None
        How many of its pixels are one of the photo, downwards and to the right.
    """

    v1: tuple[float, float]
    v2: tuple[float, float]
    confidence: float
    found: bool
    goodness: float
    correlation: float
    photo: npt.NDArray[Any]
    encoding: Encoding
    autocorrelation: npt.NDArray[np.float32] | None = None
    autocorrelation_scale: tuple[float, float] | None = None

    def overlay(self, image: ImageLike | None = None) -> npt.NDArray[np.uint8]:
        """Draw the lattice over the photo, or over a picture that fits it.

        Parameters
        ----------
        image : array_like, optional
            The picture to draw over; the photo if left out.

        Returns
        -------
        (H, W, 3) ndarray of uint8
            The picture as sRGB with bright, dark-rimmed lines through its middle.
        """
        from texforge import _lattice

        return _lattice.overlay(self, image)

    def snap(self, size: int | tuple[int, int]) -> Snap | None:
        """Return the size nearest to a wished one after which the lattice repeats on both axes.

        Parameters
        ----------
        size : int or (int, int)
            The wished height and width, or one number for both.

        Returns
        -------
        Snap or None
            The wished side itself wherever the photo need be scaled by no more than 3 % for it,
            else the nearest whole number of periods; None if there is none from half to twice the
            size.
        """
        from texforge import _lattice

        return _lattice.snap(self, size)

    def __repr__(self) -> str:
        """Say what it is in one line."""
        (ax, ay), (bx, by) = self.v1, self.v2
        found = "" if self.found else ", not found"
        return (
            f"Lattice(({ax:.2f}, {ay:.2f}), ({bx:.2f}, {by:.2f}), "
            f"confidence {self.confidence:.2f}{found})"
        )

    def _repr_png_(self) -> bytes:
        """Return the lattice over the photo, for notebooks."""
        from texforge import _lattice

        return _lattice.preview_png(self)


@dataclasses.dataclass(frozen=True, eq=False)
class SourceMap:
    """Where every pixel of a texture comes from.

    ``numpy.asarray(source_map)`` is `positions`.

    Attributes
    ----------
    positions : (H, W, 2) ndarray of int32
        Row and column of the photo's pixel that each pixel is a copy of.
    source_size : (int, int)
        Height and width of the (first) photo.
    further_sizes : tuple of (int, int)
        Height and width of the photos after the first.
    origins : (H, W, 2) ndarray of int32, or None
        Which photo each pixel is of, from 0 on, and in which symmetry: quarter turns
        counter-clockwise, and 4 more if the photo was mirrored left to right before. None if all
        are of the only photo, as it lies.
    """

    positions: npt.NDArray[np.int32]
    source_size: tuple[int, int]
    further_sizes: tuple[tuple[int, int], ...] = ()
    origins: npt.NDArray[np.int32] | None = None

    def __array__(self, dtype: Any = None, *, copy: bool | None = None) -> npt.NDArray[Any]:
        """Return the positions."""
        array: npt.NDArray[Any] = np.asarray(self.positions, dtype=dtype)
        return array.copy() if copy and array is self.positions else array

    def apply(
        self, image: ImageLike, *, kind: MapKind = "data", also: Sequence[ImageLike] = ()
    ) -> npt.NDArray[Any]:
        """Make another map of the photo's material match: see `texforge.apply`."""
        from texforge import _api

        return _api.apply(self, image, kind=kind, also=also)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Texture:
    """A picture made of a photo's pixels: what `Tile` and `Regular` have in common."""

    image: npt.NDArray[Any]
    source_map: npt.NDArray[np.int32] | None
    seed: int
    params: dict[str, Any]
    report: dict[str, Any]
    maps: dict[str, npt.NDArray[Any]]
    encoding: Encoding
    photo_size: tuple[int, int]

    _verb: ClassVar[str]
    """The function that makes it."""

    def save(self, path: PathType, *, overwrite: bool = False) -> None:
        """Write the picture to a file that also records how it was made.

        Parameters
        ----------
        path : path
            The file; its extension decides the format.
        overwrite : bool
            Whether an existing file may be replaced.

        Raises
        ------
        OutputExistsError
            If the file exists and `overwrite` is False.
        FormatError
            If the format is unknown or cannot hold the picture as it is.
        """
        from texforge import _api

        _api.save_texture(self, path, verb=self._verb, overwrite=overwrite)

    def save_source_map(self, path: PathType, *, overwrite: bool = False) -> None:
        """Write the source map to a file, for `texforge.load_source_map`.

        ``texforge apply`` on the command line reads it too.
        """
        from texforge import _api

        _api.save_source_map(self, path, overwrite=overwrite)

    def tiled(self, rows: int = 3, columns: int = 3) -> npt.NDArray[Any]:
        """Return the image repeated `rows` times downwards and `columns` times to the right."""
        return np.tile(self.image, (rows, columns) + (1,) * (self.image.ndim - 2))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Tile(Texture):
    """A texture that repeats, made by `texforge.tile`.

    In a notebook it shows itself repeated two by two.

    Attributes
    ----------
    image : (H, W) or (H, W, C) ndarray
        The tile, with the data type and the number of channels of the photo.
    source_map : (H, W, 2) ndarray of int32, or None
        Row and column of the photo's pixel that each pixel is a copy of, so that
        ``image == photo[source_map[..., 0], source_map[..., 1]]`` (of one photo; see `origins`).
        None for the method ``"make-seamless"``, which blends.
    costs : Costs
        How well it went.
    seed : int
        Seed of all random choices.
    params : dict
        Every parameter that `texforge.tile` used, with `size` as (height, width), and the sigma
        that `stationarity` came to in its place: ``tile(photo, **params)`` makes the same again.
    report : dict
        How the tile was made, as ``texforge tile --json`` reports it: version, seconds, notes
        and so on. Sizes in it are (width, height).
    maps : dict
        The other maps of the material that were given, matching `image`.
    encoding : {"srgb", "linear", "data"}
        What the numbers of `image` mean.
    photo_size : (int, int)
        Height and width of the (first) photo.
    trace : list of Step
        The costs of every iteration, coarse to fine, if ``trace=True`` was asked for; else, and
        with the method ``"make-seamless"``, which has no iterations, empty.
    also_sizes : tuple of (int, int)
        Height and width of the further photos.
    origins : (H, W, 2) ndarray of int32, or None
        Which photo each pixel is of and in which symmetry: see `SourceMap`. None if all are of
        the only photo, as it lies.
    """

    costs: Costs
    trace: list[Step]
    also_sizes: tuple[tuple[int, int], ...] = ()
    origins: npt.NDArray[np.int32] | None = None

    _verb = "tile"

    def apply(
        self, image: ImageLike, *, kind: MapKind = "data", also: Sequence[ImageLike] = ()
    ) -> npt.NDArray[Any]:
        """Make another map of the photo's material match the tile.

        Parameters
        ----------
        image : array_like
            The map, showing the same as the photo; of any resolution with its aspect ratio.
        kind : {"data", "color", "normal"}
            What its numbers are: see `texforge.apply`.
        also : sequence of array_like
            The same map of each further photo.

        Returns
        -------
        ndarray
            The map's tile, of the map's data type.

        Raises
        ------
        PictureError
            If the map has another aspect ratio than the photo.
        ParameterError
            If the tile was made by blending, and so has no source map.
        """
        from texforge import _api

        return _api.apply(self, image, kind=kind, also=also)

    def __repr__(self) -> str:
        """Say what it is in one line."""
        height, width = self.image.shape[:2]
        return f"Tile({height} x {width} {self.image.dtype}, {self.costs}, seed {self.seed})"

    def _repr_png_(self) -> bytes | None:
        """Return the tile repeated two by two, for notebooks."""
        from texforge import _api

        return _api.preview_png(self.image, self.encoding, (2, 2))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Regular(Texture):
    """A near-regular texture, made by `texforge.regular`.

    In a notebook it shows itself, twice in the directions in which it repeats.

    Attributes
    ----------
    image : (H, W) or (H, W, C) ndarray
        The texture, with the data type and the number of channels of the photo.
    source_map : (H, W, 2) ndarray of int32
        Row and column of the photo's pixel that each pixel is a copy of, or with ``subpixel="on"``
        lies nearest to. Where two are mixed, along seams, the one that there is more of. With
        ``feather=0, flatten=0`` and seams that are not ``"linear"`` nothing is mixed, and
        ``image == photo[source_map[..., 0], source_map[..., 1]]``.
    lattice : ((float, float), (float, float)) or None
        The lattice that was followed, found or given: two displacements in pixels of the photo, to
        the right and downwards. None if none was.
    lattice_of_texture : ((float, float), (float, float)) or None
        The same in the texture, where it is a little stretched if the texture repeats.
    confidence : float or None
        How sure it is that this is the photo's lattice, 0 to 1. None if it was given, or none was
        followed.
    seed : int
        Seed of all random choices.
    params : dict
        Every parameter that `texforge.regular` used, with `size` as (height, width), and with what
        it chose by itself: ``regular(photo, **params)`` makes the same again.
    report : dict
        How the texture was made: version, seconds, how far cells were moved into place, notes and
        so on. Sizes in it are (width, height).
    maps : dict
        The other maps of the material that were given, matching `image`, and mixed as it is.
    encoding : {"srgb", "linear", "data"}
        What the numbers of `image` mean.
    photo_size : (int, int)
        Height and width of the photo.
    """

    source_map: npt.NDArray[np.int32]
    lattice: tuple[tuple[float, float], tuple[float, float]] | None
    lattice_of_texture: tuple[tuple[float, float], tuple[float, float]] | None
    confidence: float | None

    _verb = "regular"

    def apply(self, image: ImageLike, *, kind: MapKind = "data") -> npt.NDArray[Any]:
        """Make another map of the photo's material match the texture.

        It copies, so where pixels are mixed along seams (`feather` above 0, or seams that are
        ``"linear"``) it has hard edges there. The `maps` of `texforge.regular` are mixed
        likewise. What was made with ``subpixel="on"`` is refused, as its pixels are no copies.

        Parameters
        ----------
        image : array_like
            The map, showing the same as the photo; of any resolution with its aspect ratio.
        kind : {"data", "color", "normal"}
            What its numbers are: see `texforge.apply`.

        Returns
        -------
        ndarray
            The map's texture, of the map's data type.

        Raises
        ------
        PictureError
            If the map has another aspect ratio than the photo.
        ParameterError
            If the texture was made with ``subpixel="on"``.
        """
        from texforge import _api

        return _api.apply(self, image, kind=kind)

    def __repr__(self) -> str:
        """Say what it is in one line."""
        height, width = self.image.shape[:2]
        lattice = "no lattice"
        if self.lattice:
            (ax, ay), (bx, by) = self.lattice
            lattice = f"lattice ({ax:.2f}, {ay:.2f}), ({bx:.2f}, {by:.2f})"
        return f"Regular({height} x {width} {self.image.dtype}, {lattice}, seed {self.seed})"

    def _repr_png_(self) -> bytes | None:
        """Return the texture, twice in the directions in which it repeats, for notebooks."""
        from texforge import _api

        tileable = self.params["tileable"]
        times = (1 + (tileable in ("both", "y")), 1 + (tileable in ("both", "x")))
        return _api.preview_png(self.image, self.encoding, times)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RegularFile:
    """A near-regular texture in a file, made by `texforge.regular_to_file`.

    Attributes
    ----------
    path : Path
        The file.
    maps : dict of str to Path
        The files of the other maps of the material, by name.
    size : (int, int)
        Height and width of the texture in pixels.
    lattice : ((float, float), (float, float)) or None
        As of `Regular`.
    lattice_of_texture : ((float, float), (float, float)) or None
        As of `Regular`.
    confidence : float or None
        As of `Regular`.
    seed : int
        Seed of all random choices.
    params : dict
        Every parameter that was used, as of `Regular`: ``regular_to_file(photo, path, **params)``
        makes the same file again.
    report : dict
        How the texture was made, as of `Regular`.
    encoding : {"srgb", "linear", "data"}
        What the texture's numbers mean.
    photo_size : (int, int)
        Height and width of the photo.
    """

    path: Path
    maps: dict[str, Path]
    size: tuple[int, int]
    lattice: tuple[tuple[float, float], tuple[float, float]] | None
    lattice_of_texture: tuple[tuple[float, float], tuple[float, float]] | None
    confidence: float | None
    seed: int
    params: dict[str, Any]
    report: dict[str, Any]
    encoding: Encoding
    photo_size: tuple[int, int]

    def __repr__(self) -> str:
        """Say what it is in one line."""
        height, width = self.size
        return f"RegularFile({str(self.path)!r}, {height} x {width}, seed {self.seed})"
