"""texforge turns photographs into textures that can be used.

`tile` makes a texture that repeats from a casual photo; the `Tile` it returns holds the picture
and says which pixel of the photo each of its pixels is, so that other maps of the same material
can follow (`apply`). `palette` shows how even it can become. `detect_lattice` finds by which
displacements a photo of bricks, tiles or cloth repeats, `extract` cuts out the tile of such a photo
that stands best for all of it, `regular` makes a texture of any size from it, `regular_to_file`
one larger than memory. `fit_noise` makes a procedural texture of a photo: a kilobyte that has a
value at every point. `texture_cost`
measures how much a texture looks like its photo.
`read_image` and `write_image` keep all the bits that files have. `study` compares the ways to
tile over many photos.
Everything raised on purpose is a `TexforgeError`.
"""

from texforge._api import (
    apply,
    load_source_map,
    read_image,
    tile,
    tile_variants,
    write_image,
)
from texforge._errors import (
    AccessError,
    Cancelled,
    DocumentError,
    FileError,
    FormatError,
    InternalError,
    MissingFileError,
    NoStructureError,
    OutOfMemory,
    OutputExistsError,
    ParameterError,
    PictureError,
    ReadError,
    SameFileError,
    TexforgeError,
)
from texforge._extract import ExtractedTile, Extraction, extract
from texforge._lattice import detect_lattice
from texforge._measure import texture_cost
from texforge._noise import NoiseTexture, fit_noise
from texforge._palette import Palette, palette
from texforge._regular import regular, regular_to_file
from texforge._study import Study, study
from texforge._texforge import __version__
from texforge._types import (
    Axis,
    Bands,
    Costs,
    Encoding,
    ExportTarget,
    Follow,
    Histogram,
    Image,
    ImageLike,
    Lattice,
    MapKind,
    Matching,
    Measure,
    Method,
    Model,
    PathType,
    Progress,
    ProgressBar,
    Quality,
    Regular,
    RegularFile,
    RegularOptions,
    SampleType,
    Scaling,
    Seam,
    Similarity,
    Snap,
    SourceMap,
    Step,
    Straightening,
    Symmetries,
    TextureCost,
    Tile,
    Tileable,
    TileOptions,
    Weights,
)

__all__ = [
    "AccessError",
    "Axis",
    "Bands",
    "Cancelled",
    "Costs",
    "DocumentError",
    "Encoding",
    "ExportTarget",
    "ExtractedTile",
    "Extraction",
    "FileError",
    "Follow",
    "FormatError",
    "Histogram",
    "Image",
    "ImageLike",
    "InternalError",
    "Lattice",
    "MapKind",
    "Matching",
    "Measure",
    "Method",
    "MissingFileError",
    "Model",
    "NoStructureError",
    "NoiseTexture",
    "OutOfMemory",
    "OutputExistsError",
    "Palette",
    "ParameterError",
    "PathType",
    "PictureError",
    "Progress",
    "ProgressBar",
    "Quality",
    "ReadError",
    "Regular",
    "RegularFile",
    "RegularOptions",
    "SameFileError",
    "SampleType",
    "Scaling",
    "Seam",
    "Similarity",
    "Snap",
    "SourceMap",
    "Step",
    "Straightening",
    "Study",
    "Symmetries",
    "TexforgeError",
    "TextureCost",
    "Tile",
    "TileOptions",
    "Tileable",
    "Weights",
    "__version__",
    "apply",
    "detect_lattice",
    "extract",
    "fit_noise",
    "load_source_map",
    "palette",
    "read_image",
    "regular",
    "regular_to_file",
    "study",
    "texture_cost",
    "tile",
    "tile_variants",
    "write_image",
]
