"""MaterialX: validated by its own library, generated as GLSL, which is compiled and rendered.

OSL and MDL are generated only.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import MaterialX
import moderngl
import numpy as np
import texforge
from MaterialX import (
    PyMaterialXGenGlsl,
    PyMaterialXGenMdl,
    PyMaterialXGenOsl,
    PyMaterialXGenShader,
)
from PIL import Image

from .gl import bind, compile_glsl, context, draw, link
from .tools import Picture, ShaderError, Texture

if TYPE_CHECKING:
    from pathlib import Path

TARGETS = {
    "genglsl": PyMaterialXGenGlsl.GlslShaderGenerator,
    "essl": PyMaterialXGenGlsl.EsslShaderGenerator,
    "genosl": PyMaterialXGenOsl.OslShaderGenerator,
    "genmdl": PyMaterialXGenMdl.MdlShaderGenerator,
}

CLOSEST, PERIODIC = 0, 2
"""Numbers of `filtertype` and of an `addressmode`."""

MINIFIED = {
    moderngl.NEAREST: moderngl.NEAREST_MIPMAP_NEAREST,
    moderngl.LINEAR: moderngl.LINEAR_MIPMAP_LINEAR,
}
"""How a picture with mipmaps is read, by how it is without."""


class Generated(NamedTuple):
    """Shaders of one element, and the files that the samplers of the pixel shader read."""

    vertex: str
    pixel: str
    files: dict[str, Sampled]


class Sampled(NamedTuple):
    """A picture's file and how it is read."""

    path: Path
    closest: bool
    repeated: tuple[bool, bool]


def validate_materialx(path: Path) -> None:
    """Check a document by MaterialX's own rules."""
    valid, message = _read(path).validate()
    if not valid:
        raise ShaderError(message)


def generate_glsl(
    path: Path, element: str, target: Literal["genglsl", "essl"] = "genglsl"
) -> Generated:
    """Generate and compile the shaders of an element: a material, or `graph/output`."""
    shader = _generate(path, element, target)
    vertex, pixel = (shader.getSourceCode(stage) for stage in ("vertex", "pixel"))
    compile_glsl(vertex, "vert")
    compile_glsl(pixel, "frag")
    return Generated(vertex, pixel, _files(shader, path.parent))


def generate_text(path: Path, element: str, target: Literal["genosl", "genmdl"]) -> str:
    """Generate an element in a language that is not compiled here."""
    return str(_generate(path, element, target).getSourceCode("pixel"))


def render_materialx(
    path: Path, element: str, size: tuple[int, int], *, mipmaps: bool = False
) -> Picture:
    """Render an element with texture coordinates `(x + 0.5) / width` and `(y + 0.5) / height`.

    As MaterialX has it, the last row of a file has the coordinate 0. With `mipmaps` all pictures
    have them, as in many hosts.
    """
    made = generate_glsl(path, element)
    with context() as gl:
        program = link(made.vertex, made.pixel)
        for unit, (name, sampled) in enumerate(made.files.items()):
            texture = bind(program, name, _pixels(sampled.path), unit)
            texture.repeat_x, texture.repeat_y = sampled.repeated
            magnified = moderngl.NEAREST if sampled.closest else moderngl.LINEAR
            texture.filter = (magnified, magnified)
            if mipmaps:
                texture.build_mipmaps()
                texture.filter = (MINIFIED[magnified], magnified)
        columns = {
            "i_position": np.array([(-1, -1, 0), (3, -1, 0), (-1, 3, 0)], np.float32),
            "i_texcoord_0": np.array([(0, 0), (2, 0), (0, 2)], np.float32),
        }
        buffers = [
            (gl.buffer(values.tobytes()), f"{values.shape[1]}f", name)
            for name, values in columns.items()
            if name in program
        ]
        return draw(gl.vertex_array(program, buffers), size)


@functools.cache
def _library() -> Any:
    """Return the standard nodes."""
    library = MaterialX.createDocument()
    MaterialX.loadLibraries(
        MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library
    )
    return library


def _read(path: Path) -> Any:
    document = MaterialX.createDocument()
    try:
        MaterialX.readFromXmlFile(document, str(path))
    except MaterialX.ExceptionParseError as error:
        raise ShaderError(str(error)) from error
    document.setDataLibrary(_library())
    return document


def _generate(path: Path, element: str, target: str) -> Any:
    document = _read(path)
    found = document.getDescendant(element)
    if found is None:
        raise ValueError(f"{path} has no element {element}")
    generator = TARGETS[target].create()
    colors = PyMaterialXGenShader.DefaultColorManagementSystem.create(target)
    colors.loadLibrary(_library())
    generator.setColorManagementSystem(colors)
    generator.registerTypeDefs(document)
    settings = PyMaterialXGenShader.GenContext(generator)
    settings.registerSourceCodeSearchPath(MaterialX.getDefaultDataSearchPath())
    settings.registerSourceCodeSearchPath(str(path.parent))
    try:
        return generator.generate(found.getName(), found, settings)
    except PyMaterialXGenShader.ExceptionShaderGenError as error:
        raise ShaderError(str(error)) from error


def _files(shader: Any, folder: Path) -> dict[str, Sampled]:
    """Return what the samplers read; how to read it is told beside, in uniforms."""
    ports = {
        port.getVariable(): port
        for block in shader.getStage("pixel").getUniformBlocks().values()
        for port in block
    }

    def number(name: str, otherwise: int) -> int:
        value = ports[name].getValue() if name in ports else None
        return otherwise if value is None else int(value.getData())

    files = {}
    for name, port in ports.items():
        # The light around a material has no file.
        if port.getType().getName() == "filename" and port.getValue() is not None:
            node = name.removesuffix("file")
            files[name] = Sampled(
                folder / port.getValue().getData(),
                number(f"{node}filtertype", 1) == CLOSEST,
                (
                    number(f"{node}uaddressmode", PERIODIC) == PERIODIC,
                    number(f"{node}vaddressmode", PERIODIC) == PERIODIC,
                ),
            )
    return files


def _pixels(path: Path) -> Texture:
    """Return a file's pixels, the last row first."""
    if path.suffix == ".exr":
        read = texforge.read_image(path, kind="data")
        return np.ascontiguousarray(read[::-1], np.float32)
    with Image.open(path) as image:
        wanted = image.mode if image.mode in {"L", "LA", "RGB", "RGBA", "I;16"} else "RGBA"
        return np.ascontiguousarray(np.asarray(image.convert(wanted))[::-1])
