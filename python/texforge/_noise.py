"""Procedural textures by example."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from texforge import _api, _arrays, _texforge
from texforge._errors import ParameterError
from texforge._progress import reporting
from texforge._types import (
    Bands,
    Encoding,
    ExportTarget,
    Histogram,
    Image,
    ImageLike,
    Model,
    PathType,
    Progress,
    SampleType,
    Weights,
)

if TYPE_CHECKING:
    from typing import Self

__all__ = ["NoiseTexture", "fit_noise"]

BASE = "basecolor"
"""The name of the map that `fit_noise` makes of its photo."""

_MOST_SIDE = 65536


def fit_noise(
    image: ImageLike,
    *,
    model: Model = "auto",
    bands: Bands = "round",
    weights: Weights = "corrected",
    histogram: Histogram = "kept",
    cell: int = 0,
    sharpness: int = 4,
    keep: int = 1024,
    seed: int = 0,
    mask: ImageLike | None = None,
    maps: Mapping[str, ImageLike] | None = None,
    encoding: Encoding | Literal["auto"] = "auto",
    threads: int | None = None,
    progress: Progress = None,
) -> NoiseTexture:
    """Fit a procedural texture to a photo of sand, plaster, granite or the like.

    What remains of the photo is about a kilobyte, from which values are computed at any point, on
    the plane or in space: noise with the photo's colours, with its histograms, and in every octave
    as strong as the photo. Noise has no edges and no shapes: for photos of stones, leaves or bricks
    there is the model ``"tiling"``, which keeps a part of the photo and shows pieces of it that go
    on into each other, without end and at any point of the plane.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like, or Pillow image
        The photo, of at least 16 x 16 pixels and of any type that `tile` takes. Pixels that are not
        wholly opaque do not count. It becomes the map ``"basecolor"``.
    model : {"auto", "wavelet", "oriented", "tiling"}
        Which kind of texture is fitted: wavelet is noise that is alike in all directions (the
        paper's kind); oriented is noise with bands that differ along two directions, for wood and
        the like; auto takes the better of these; tiling lays parts of the photo beside each other
        and blends them, for photos with shapes, and keeps a picture in the document.
    bands : {"round", "square"}
        The shape of isotropic noise's bands in the spectrum: round is alike in all directions;
        square is the paper's, Cook and DeRose's wavelet noise, and looks a little woven.
    weights : {"corrected", "direct"}
        How the bands' weights follow from the photo's spectrum: corrected takes into account what
        each band leaks into others; direct is the paper's formula, which does not.
    histogram : {"kept", "normal"}
        Whether the photo's histograms are kept, or become normal distributions.
    cell : int
        Distance of the tiles of tiling in pixels, 0 to 4096: large shapes need large tiles, small
        tiles repeat less. 0 is a fifth of the part that is kept.
    sharpness : int
        How narrow the borders are where the tiles of tiling blend, 1 to 16: 1 blends all over as
        the paper does, 16 is nearly a cut.
    keep : int
        Most pixels along each side of the photo's part that tiling keeps, 64 to 8192; a document of
        colours has about 8 bytes for each pixel of that part.
    seed : int
        Chooses among the textures with the same statistics, 0 to 2**32 - 1.
    mask : (H, W) array_like, or Pillow image, optional
        Where the photo counts: True, or at least half of full scale.
    maps : mapping of str to array_like, optional
        Other maps of the same material by name, of the photo's size. They are fitted together with
        it, so they stay correlated as they are; of all together at most 32 channels. The name
        decides what a map is, as for `tile`.
    encoding : {"auto", "srgb", "linear", "data"}
        What the numbers mean, as for `tile`. The texture's values mean the same.
    threads : int, optional
        Number of worker threads, as for `tile`.
    progress : bool, callable or bar, optional
        As for `tile`.

    Returns
    -------
    NoiseTexture
        The texture.

    Raises
    ------
    ParameterError
        If an argument is out of range (also a ValueError).
    PictureError
        If the photo, the mask or a map cannot be used: wrong type or shape, too small, of one
        colour, NaN or infinities, all masked out (also a ValueError).
    OutOfMemory
        If it would not fit into memory; checked first (also a MemoryError).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    The same arguments give the same texture on every run, for any number of threads.

    Source: A. Lagae, P. Vangorp, T. Lenaerts, P. Dutré, "Procedural Textures by Example" (2009),
    sections 4 to 7; the noise: R. L. Cook, T. DeRose, "Wavelet Noise" (2005); tiling: E. Heitz,
    F. Neyret, "High-Performance By-Example Noise using a Histogram-Preserving Blending Operator"
    (2018), with pieces that are chosen instead of drawn.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> rng = np.random.default_rng(0)
    >>> grain = rng.normal(0, 20, (96, 128, 1)) + rng.normal(0, 4, (96, 128, 3))
    >>> photo = np.clip([150, 130, 90] + grain, 0, 255).astype(np.uint8)
    >>> sand = texforge.fit_noise(photo)
    >>> sand.render((300, 200)).shape
    (300, 200, 3)
    >>> sand.at([[10.5, 20.5], [1e6, -3.25]]).shape
    (2, 3)
    >>> texforge.NoiseTexture.from_json(sand.to_json()) == sand
    True
    """
    values = dict(locals())
    photo = _arrays.picture(image, "the photo", encoding)
    texts = [
        (param["name"], _api.parameter_text(param, values[param["name"]]))
        for param in _texforge.schema("fit_noise")
    ]
    others = [
        (name, _api.maps_of(other, name, 0)[0].packed(), _texforge.map_kind(name))
        for name, other in (maps or {}).items()
    ]
    kind = "data" if photo.encoding == "data" else "color"
    with reporting(progress) as callback:
        core, report_text = _texforge.fit_noise(
            maps=[(BASE, photo.packed(), kind), *others],
            mask=None if mask is None else _arrays.mask(mask).packed(),
            params=texts,
            seed=_arrays.integer("seed", seed, 0, 2**32 - 1),
            threads=_threads(threads),
            progress=callback,
        )
    report = json.loads(report_text)
    report["notes"] = [*report["notes"], *photo.notes]
    return NoiseTexture(core, report)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class NoiseTexture:
    """A procedural texture, made by `texforge.fit_noise` or read from its document.

    The unit of length is a pixel of the photo; x goes right, y down, and the photo's first pixel
    has its middle at (0.5, 0.5). The texture goes on in all directions. Values have full scale 1,
    in the encodings of the maps ("srgb" is display-referred), and are not clipped: noise exceeds 0
    and 1 now and then.

    The same document gives the same values on every machine, for any number of threads, and in
    every later version of texforge. Textures are equal if their documents are; they can be pickled
    and copied. In a notebook a texture shows itself.

    Attributes
    ----------
    report : dict
        How it was fitted: version, parameters, seconds, notes and so on. Empty if it was not.

    Examples
    --------
    >>> import numpy as np
    >>> import texforge
    >>> rng = np.random.default_rng(0)
    >>> height = rng.random((64, 64))
    >>> photo = (80 + 100 * height[..., None] + rng.integers(0, 20, (64, 64, 3))).astype(np.uint8)
    >>> plaster = texforge.fit_noise(photo, maps={"height": height.astype(np.float32)})
    >>> plaster.maps, plaster.size, plaster.channels["height"]
    (('basecolor', 'height'), (64, 64), slice(3, 4, None))
    >>> plaster.render(32, map="height", dtype="uint16").dtype
    dtype('uint16')
    """

    _core: _texforge.Noise
    report: dict[str, Any] = dataclasses.field(default_factory=dict)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read a texture from the text of its document.

        Parameters
        ----------
        text : str
            JSON, as `to_json` writes it.

        Raises
        ------
        DocumentError
            If the text is damaged, no such document, or of a later version (also a ValueError).
        """
        if not isinstance(text, str):
            raise ParameterError(
                f"`text` must be a document's text, got {type(text).__name__}",
                fields={"name": "text"},
            )
        # What no file can hold is no document either.
        return cls(_texforge.Noise.from_json(text.encode("utf-8", "replace").decode("utf-8")))

    def to_json(self) -> str:
        """Return the text of the document: JSON in one line, which `from_json` reads exactly."""
        return self._core.to_json()

    @classmethod
    def load(cls, path: PathType) -> Self:
        """Read a texture from a file, written by `save` or ``texforge noise fit``.

        Raises
        ------
        DocumentError
            If the file holds a damaged document, none, or one of a later version (also a
            ValueError).
        ReadError
            If it is not text.
        MissingFileError, AccessError, FileError
            If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
        """
        return cls(_texforge.Noise.load(_arrays.path(path)))

    def save(self, path: PathType, *, overwrite: bool = False) -> None:
        """Write the document to a file, at once or not at all.

        Parameters
        ----------
        path : path
            The file, usually ``.json``.
        overwrite : bool
            Whether an existing file may be replaced.

        Raises
        ------
        OutputExistsError
            If the file exists and `overwrite` is False (also a FileExistsError).
        MissingFileError, AccessError, FileError
            If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
        """
        text = self.to_json() + "\n"
        _texforge.write_files(
            files=[(_arrays.path(path), text.encode())], overwrite=bool(overwrite)
        )

    @property
    def document(self) -> dict[str, Any]:
        """What the texture consists of: a copy of the document."""
        document: dict[str, Any] = json.loads(self.to_json())
        return document

    @functools.cached_property
    def _facts(self) -> dict[str, Any]:
        """The document, read once: that of tiles has megabytes."""
        return self.document

    @property
    def maps(self) -> tuple[str, ...]:
        """The names of the maps, in the order of their channels."""
        return tuple(self.channels)

    @property
    def channels(self) -> dict[str, slice]:
        """Which channels of a value each map has: ``values[..., texture.channels["height"]]``."""
        found, first = {}, 0
        for one in self._facts["maps"]:
            found[one["name"]] = slice(first, first + one["channels"])
            first += one["channels"]
        return found

    @property
    def size(self) -> tuple[int, int]:
        """Height and width of the photo in pixels."""
        width, height = self._facts["size"]
        return height, width

    @property
    def seed(self) -> int:
        """The seed."""
        seed: int = self._facts["seed"]
        return seed

    @property
    def score(self) -> float:
        """How well a texture of this kind fits the photo, 0 to 1."""
        fit: float = self._facts["score"]["fit"]
        return fit

    @property
    def recommended(self) -> str:
        """What fits best: ``"wavelet"``, ``"oriented"``, ``"tiling"`` or ``"none"``."""
        recommended: str = self._facts["score"]["recommended"]
        return recommended

    def at(
        self,
        points: npt.ArrayLike,
        *,
        footprint: float = 0.0,
        keep_contrast: bool = False,
        normals: npt.ArrayLike | None = None,
        threads: int | None = None,
    ) -> npt.NDArray[np.float32]:
        """Compute values at points of the plane, or of the solid texture.

        A value depends on its point alone, not on the other points nor their order. At the middles
        of the pixels that `render` makes (as float32, not tileable) it has the same bits, at those
        of the voxels of `solid` too. The solid texture has the same statistics as that on the
        plane, but is another one.

        Parameters
        ----------
        points : (..., 2) or (..., 3) array_like
            (x, y), or (x, y, z) in the solid texture, in pixels of the photo, within 1e9. They are
            computed with as float64.
        footprint : float
            Distance of the samples, 0 to 1e6, in pixels of the photo: what is too fine for them is
            faded out (not below 1, which holds all). 0 keeps all.
        keep_contrast : bool
            Whether what remains is strengthened so that the contrast stays.
        normals : (..., 3) array_like, optional
            Normals of a surface at the points, of any length, for points (x, y, z): one for each,
            or one for all. The noise is then projected along them, as a cut through a solid has low
            frequencies that the photo has not (Cook and DeRose 2005, section 3.4).
        threads : int, optional
            Number of worker threads, as for `texforge.tile`; 1 is quickest for a few points.

        Returns
        -------
        (..., C) ndarray of float32
            All channels, full scale 1, not clipped; those of one map are
            ``values[..., texture.channels[name]]``. Normals are not brought to unit length.

        Raises
        ------
        ParameterError
            For points of another shape or not finite, or if an argument is out of range (also a
            ValueError).
        OutOfMemory
            If it would not fit into memory; checked first (also a MemoryError).

        Examples
        --------
        >>> import numpy as np
        >>> import texforge
        >>> photo = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
        >>> texture = texforge.fit_noise(photo)
        >>> y, x = np.mgrid[:20, :30] + 0.5
        >>> values = texture.at(np.stack([x, y], axis=-1))
        >>> bool(np.all(values == texture.render((20, 30), dtype="float32")))
        True
        >>> ball = np.random.default_rng(1).normal(size=(100, 3))
        >>> texture.at(50 * ball, normals=ball).shape
        (100, 3)
        """
        places = _vectors("points", points, (2, 3))
        axes = places.shape[-1]
        directions = None
        if normals is not None:
            if axes == 2:
                raise ParameterError(
                    "`normals` must be left out for points (x, y), got some",
                    fields={"name": "normals"},
                )
            directions = _vectors("normals", normals, (3,))
            try:
                directions = np.ascontiguousarray(np.broadcast_to(directions, places.shape))
            except ValueError:
                raise ParameterError(
                    f"`normals` must be one for all points or one for each of {places.shape[:-1]}, "
                    f"got {directions.shape[:-1]}",
                    fields={"name": "normals"},
                ) from None
        values = self._core.at(
            points=_bytes(places),
            count=places.size // axes,
            axes=axes,
            normals=None if directions is None else _bytes(directions),
            footprint=_arrays.real("footprint", footprint),
            keep_contrast=bool(keep_contrast),
            threads=_threads(threads),
        )
        n_channels = len(self._facts["mean"])
        return np.frombuffer(values, np.float32).reshape(*places.shape[:-1], n_channels)

    def render(
        self,
        size: int | tuple[int, int],
        *,
        scale: float = 1.0,
        origin: tuple[float, float] = (0.0, 0.0),
        tileable: bool = False,
        keep_contrast: bool = False,
        dtype: SampleType = "uint8",
        map: str | None = None,  # noqa: A002 (as `--map` and `maps`)
        threads: int | None = None,
        progress: Progress = None,
    ) -> Image:
        """Make a picture of a part of the texture.

        Parameters
        ----------
        size : int or (int, int)
            **(height, width)** in pixels, at most 65536; one number makes a square.
        scale : float
            Distance of pixels in pixels of the photo, 0.001 to 10000: 0.5 magnifies twice. Above 1
            what is too fine for the pixels is faded out.
        origin : (float, float)
            Where the upper left corner lies, **(to the right, downwards)**, in pixels of the photo,
            within 1e9. Parts of one texture fit each other.
        tileable : bool
            Whether right fits left and bottom top. It is then another texture with the same
            statistics, but for what is coarser than a quarter of the picture, which is left out.
        keep_contrast : bool
            Whether what `scale` takes away is made up for, so that the contrast stays.
        dtype : {"uint8", "uint16", "float32"}
            The samples. Integers are clipped, floats have full scale 1 and are not.
        map : str, optional
            Which map: see `maps`. By default the first.
        threads : int, optional
            Number of worker threads, as for `texforge.tile`.
        progress : bool, callable or bar, optional
            As for `texforge.tile`.

        Returns
        -------
        (H, W) or (H, W, C) Image
            The picture: an array that remembers its encoding. Normals have unit length.

        Raises
        ------
        ParameterError
            If an argument is out of range (also a ValueError).
        OutOfMemory
            If it would not fit into memory; checked first (also a MemoryError).
        Cancelled
            If `progress` returned False.
        """
        names = self.maps
        chosen = names[0] if map is None else map
        if chosen not in names:
            raise ParameterError(
                f"`map` must be one of {', '.join(names)}, got {map!r}", fields={"name": "map"}
            )
        pictures = self._render(
            chosen,
            size,
            scale=scale,
            origin=origin,
            tileable=tileable,
            keep_contrast=keep_contrast,
            dtype=dtype,
            threads=threads,
            progress=progress,
        )
        return pictures[chosen]

    def render_maps(
        self,
        size: int | tuple[int, int],
        *,
        scale: float = 1.0,
        origin: tuple[float, float] = (0.0, 0.0),
        tileable: bool = False,
        keep_contrast: bool = False,
        dtype: SampleType = "uint8",
        threads: int | None = None,
        progress: Progress = None,
    ) -> dict[str, Image]:
        """Make a picture of every map, by name: see `render`."""
        return self._render(
            None,
            size,
            scale=scale,
            origin=origin,
            tileable=tileable,
            keep_contrast=keep_contrast,
            dtype=dtype,
            threads=threads,
            progress=progress,
        )

    def _render(
        self,
        only: str | None,
        size: int | tuple[int, int],
        *,
        scale: float,
        origin: tuple[float, float],
        tileable: bool,
        keep_contrast: bool,
        dtype: SampleType,
        threads: int | None,
        progress: Progress,
    ) -> dict[str, Image]:
        sides = size if isinstance(size, tuple | list) else (size, size)
        height, width = (
            _arrays.integer("size", side, 1, _MOST_SIDE)
            for side in _several("size", sides, 2, "one number or (height, width)")
        )
        with reporting(progress) as callback:
            pictures = self._core.render(
                size=(width, height),
                scale=_arrays.real("scale", scale),
                origin=_place(origin, "(x, y)"),
                tileable=bool(tileable),
                keep_contrast=bool(keep_contrast),
                dtype=_arrays.word("dtype", dtype),
                only=only,
                threads=_threads(threads),
                progress=callback,
            )
        return {name: _image(parts) for name, parts in pictures}

    def solid(
        self,
        shape: int | tuple[int, int, int],
        *,
        scale: float = 1.0,
        origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
        keep_contrast: bool = False,
        threads: int | None = None,
        progress: Progress = None,
    ) -> npt.NDArray[np.float32]:
        """Compute a block of the solid texture. A slice is a block of which one side is 1.

        Parameters
        ----------
        shape : int or (int, int, int)
            **(depth, height, width)** in voxels, at most 65536 each; one number makes a cube.
        scale : float
            Distance of voxels in pixels of the photo, as for `render`.
        origin : (float, float, float)
            Where the corner of the first voxel lies, **(x, y, z)**, in pixels of the photo, within
            1e9.
        keep_contrast : bool
            As for `render`.
        threads : int, optional
            Number of worker threads, as for `texforge.tile`.
        progress : bool, callable or bar, optional
            As for `texforge.tile`.

        Returns
        -------
        (D, H, W, C) ndarray of float32
            All channels, as `at` returns them.

        Raises
        ------
        ParameterError
            If an argument is out of range, or the texture has directions and so no third axis
            (also a ValueError).
        OutOfMemory
            If it would not fit into memory; checked first (also a MemoryError).
        Cancelled
            If `progress` returned False.

        Examples
        --------
        >>> import numpy as np
        >>> import texforge
        >>> photo = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
        >>> texforge.fit_noise(photo).solid((4, 20, 30)).shape
        (4, 20, 30, 3)
        """
        sides = shape if isinstance(shape, tuple | list) else (shape,) * 3
        depth, height, width = (
            _arrays.integer("shape", side, 1, _MOST_SIDE)
            for side in _several("shape", sides, 3, "one number or (depth, height, width)")
        )
        with reporting(progress) as callback:
            values = self._core.volume(
                shape=[depth, height, width],
                scale=_arrays.real("scale", scale),
                origin=_place(origin, "(x, y, z)"),
                keep_contrast=bool(keep_contrast),
                threads=_threads(threads),
                progress=callback,
            )
        return np.frombuffer(values, np.float32).reshape(depth, height, width, -1)

    def morph(self, other: NoiseTexture, t: float) -> NoiseTexture:
        """Return a texture between this one and another of the same maps.

        Means, weights and histograms go straight, the colours' directions turn the shortest way.
        The noise is this texture's up to ``t=1``, which is the other itself; so with one seed,
        values change smoothly.

        Parameters
        ----------
        other : NoiseTexture
            The other texture.
        t : float
            0 (this texture) to 1 (the other).

        Returns
        -------
        NoiseTexture
            The texture between.

        Raises
        ------
        ParameterError
            If `t` is out of range, or the textures have other maps or models (also a ValueError).

        Notes
        -----
        Source: "Procedural Textures by Example" (2009), section 8.

        Examples
        --------
        >>> import numpy as np
        >>> import texforge
        >>> rng = np.random.default_rng(0)
        >>> dark, light = (
        ...     texforge.fit_noise(rng.integers(low, low + 60, (64, 64, 3), dtype=np.uint8))
        ...     for low in (10, 150)
        ... )
        >>> dark.morph(light, 0.5).render(64).mean().round(-1)
        np.float64(110.0)
        """
        if not isinstance(other, NoiseTexture):
            raise ParameterError(
                f"`other` must be a NoiseTexture, got {type(other).__name__}",
                fields={"name": "other"},
            )
        return NoiseTexture(self._core.morph(other=other._core, t=_arrays.real("t", t)))

    def edit(
        self,
        *,
        contrast: float = 1.0,
        saturation: float = 1.0,
        brightness: float = 0.0,
        feature_size: float = 1.0,
        histogram: Histogram = "kept",
        gains: Sequence[float] = (),
        means: Mapping[str, float | Sequence[float]] | None = None,
        seed: int | None = None,
    ) -> NoiseTexture:
        """Return the texture with changes; the defaults change nothing.

        Parameters
        ----------
        contrast : float
            Factor of the contrast of all maps, 0 to 10.
        saturation : float
            Factor of how far colours are from grey, 0 (grey) to 10. Maps that are no colours stay.
        brightness : float
            What is added to colours, -1 to 1, where 1 is white.
        feature_size : float
            Factor of the width of features, a power of two from 0.0625 to 16. For what is between,
            choose another `scale` when rendering.
        histogram : {"kept", "normal"}
            Whether the histograms are kept, or become normal distributions.
        gains : sequence of float
            Factors of the octaves' weights, 0 to 100, the finest first; those beyond stay.
        means : mapping of str to float or sequence of float, optional
            New means by the maps' names, one number or one for each channel, with full scale 1;
            `brightness` and `saturation` do not change them.
        seed : int, optional
            Another seed, 0 to 2**32 - 1: the same statistics elsewhere.

        Returns
        -------
        NoiseTexture
            The changed texture.

        Raises
        ------
        ParameterError
            If an argument is out of range, there are more gains than octaves, a mean is of no map,
            or no band would be left (also a ValueError).

        Examples
        --------
        >>> import numpy as np
        >>> import texforge
        >>> photo = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
        >>> texture = texforge.fit_noise(photo)
        >>> grey = texture.edit(saturation=0, contrast=0.5, means={"basecolor": 0.4})
        >>> grey.document["mean"]
        [0.4, 0.4, 0.4]
        """
        values = dict(locals())
        texts = [
            (param["name"], _api.parameter_text(param, values[param["name"]]))
            for param in _texforge.schema("edit")
        ]
        core = self._core.edit(
            params=texts,
            gains=_reals("gains", gains),
            means=[(name, _reals("means", mean)) for name, mean in _items("means", means)],
            seed=None if seed is None else _arrays.integer("seed", seed, 0, 2**32 - 1),
        )
        return NoiseTexture(core)

    def export(self, target: ExportTarget, *, name: str = "texture") -> dict[str, bytes]:
        """Write the texture on the plane for another program: a shader that computes the same.

        Parameters
        ----------
        target : {"glsl", "glsl-es", "wgsl", "hlsl", "osl", "materialx", "blender"}
            The language: for desktop OpenGL and Vulkan; for WebGL 2, Three.js and Godot; for
            WebGPU; for Unity and Unreal; for Cycles and other renderers; for Houdini, Maya, Unreal
            and USD; or a Python script that builds a node group in Blender.
        name : str
            What files and functions are called; what cannot stand in a name becomes ``_``.

        Returns
        -------
        dict of str to bytes
            The files by name.

        Raises
        ------
        ParameterError
            If the target is unknown (also a ValueError).
        """
        return dict(
            self._core.export(
                target=_arrays.word("target", target), name=_arrays.word("name", name)
            )
        )

    def export_to(
        self,
        folder: PathType,
        target: ExportTarget,
        *,
        name: str = "texture",
        overwrite: bool = False,
    ) -> list[Path]:
        """Write the files of `export` into a folder that exists: all of them or none.

        Parameters
        ----------
        folder : path
            The folder.
        target : {"glsl", "glsl-es", "wgsl", "hlsl", "osl", "materialx", "blender"}
            As for `export`.
        name : str
            As for `export`.
        overwrite : bool
            Whether existing files may be replaced. If not, and there is one, none is written.

        Returns
        -------
        list of Path
            The files.

        Raises
        ------
        ParameterError
            If the target is unknown (also a ValueError).
        OutputExistsError
            If a file exists and `overwrite` is False (also a FileExistsError).
        MissingFileError, AccessError, FileError
            If the operating system refuses (also FileNotFoundError, PermissionError, OSError).
        """
        base = Path(_arrays.path(folder))
        files = [(base / file, data) for file, data in self.export(target, name=name).items()]
        _texforge.write_files(
            files=[(str(path), data) for path, data in files], overwrite=bool(overwrite)
        )
        return [path for path, _ in files]

    def __eq__(self, other: object) -> bool:
        """Compare the documents."""
        if not isinstance(other, NoiseTexture):
            return NotImplemented
        return self.to_json() == other.to_json()

    def __hash__(self) -> int:
        """Hash the document."""
        return hash(self.to_json())

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as the document."""
        return _rebuilt, (self.to_json(), self.report)

    def __repr__(self) -> str:
        """Say what it is in one line."""
        height, width = self.size
        (model,) = self._facts["model"]
        maps = ", ".join(self.maps)
        return f"NoiseTexture({model} noise like {height} x {width} of {maps}, seed {self.seed})"

    def _repr_png_(self) -> bytes | None:
        """Return a picture of the first map, for notebooks."""
        image = self.render(256)
        return _api.preview_png(image, image.encoding, (1, 1))


def _rebuilt(text: str, report: dict[str, Any]) -> NoiseTexture:
    return NoiseTexture(_texforge.Noise.from_json(text), report)


def _image(parts: tuple[bytearray, str, tuple[int, int, int], str]) -> Image:
    array = _arrays.unpacked(parts)
    flat = array[:, :, 0] if array.shape[2] == 1 else array
    return Image.tagged(flat, _arrays.array_encoding(parts[3]))


def _threads(threads: int | None) -> int:
    return _arrays.integer("threads", threads or 0, high=1024)


def _reals(name: str, value: Any) -> list[float]:
    """Return a number, or any number of them."""
    if isinstance(value, str | bytes | Mapping):
        raise ParameterError(f"`{name}` must be numbers, got {value!r}", fields={"name": name})
    try:
        values = list(value)
    except TypeError:
        values = [value]
    return [_arrays.real(name, one) for one in values]


def _items(name: str, value: Any) -> list[tuple[str, Any]]:
    """Return what a mapping has by name; nothing of None."""
    if value is None:
        return []
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise ParameterError(
            f"`{name}` must be a mapping with names as keys, got {value!r}", fields={"name": name}
        )
    return list(value.items())


def _several(name: str, value: Any, count: int, expected: str) -> list[Any]:
    if not isinstance(value, tuple | list) or len(value) != count:
        raise ParameterError(f"`{name}` must be {expected}, got {value!r}", fields={"name": name})
    return list(value)


def _place(origin: Any, expected: str) -> list[float]:
    axes = expected.count(",") + 1
    return [_arrays.real("origin", v) for v in _several("origin", origin, axes, expected)]


def _vectors(name: str, value: Any, axes: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """Return vectors of so many numbers, contiguous."""
    shapes = " or ".join(f"(..., {n})" for n in axes)
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:
        raise ParameterError(
            f"`{name}` must be numbers of shape {shapes}, got what is no array ({error})",
            fields={"name": name},
        ) from None
    if array.dtype.kind not in "iuf" or array.ndim == 0 or array.shape[-1] not in axes:
        raise ParameterError(
            f"`{name}` must be numbers of shape {shapes}, "
            f"got {array.dtype.name} of shape {array.shape}",
            fields={"name": name},
        )
    return np.ascontiguousarray(array, np.float64)


def _bytes(array: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    return array.reshape(-1).view(np.uint8)
