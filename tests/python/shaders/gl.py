"""GLSL: checked by glslangValidator, rendered by OpenGL through EGL."""

from __future__ import annotations

import functools
import os
import re
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np

from .tools import Filtered, Picture, ShaderError, Texture, Uniform, channels, missing, run

if TYPE_CHECKING:
    from collections.abc import Mapping

UNSIGNED_SAMPLER = 0x8DD2
"""`GL_UNSIGNED_INT_SAMPLER_2D`, the type of a `usampler2D`."""

WHOLE_PICTURE = """
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""


def compile_glsl(source: str, stage: str = "frag") -> None:
    """Check a shader of any version, OpenGL ES or desktop."""
    run("glslang-tools", "glslangValidator", "--stdin", "-S", stage, source=source)


def render_glsl(
    source: str,
    size: tuple[int, int],
    textures: Mapping[str, Texture | Filtered] | None = None,
    uniforms: Mapping[str, Uniform] | None = None,
) -> Picture:
    """Run a fragment shader on a picture of `size`, which is height and width.

    A `sampler2D` reads integers as fractions of the greatest, a `usampler2D` as they are. The
    first row of a texture has the coordinate 0; the nearest texel is taken, repeated outside, but
    of `Filtered` ones.
    """
    with context() as gl:
        program = link(f"{_version(source)}\n{WHOLE_PICTURE}", source)
        for unit, (name, texture) in enumerate((textures or {}).items()):
            bind(program, name, texture, unit)
        for name, value in (uniforms or {}).items():
            plain = value.tolist() if isinstance(value, np.ndarray) else value
            uniform(program, name).value = plain
        return draw(gl.vertex_array(program, []), size)


@functools.cache
def context() -> Any:
    """Return OpenGL without a window, on the processor where there is a choice.

    To be entered before use: wgpu, in the same thread, makes a context of its own current.
    """
    os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
    settings: dict[str, Any] = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    try:
        made = moderngl.create_context(standalone=True, **settings)
    except Exception as error:  # noqa: BLE001 - the backend raises the bare class
        missing(f"OpenGL by EGL ({error})", "libegl1 libgl1 libgl1-mesa-dri")
    made.gc_mode = "context_gc"
    return made


def link(vertex: str, fragment: str) -> Any:
    """Make a program of two shaders."""
    try:
        return context().program(vertex_shader=vertex, fragment_shader=fragment)
    except moderngl.Error as error:
        raise ShaderError(str(error)) from error


def uniform(program: Any, name: str) -> Any:
    """Return a uniform, or a member of one, which the shader must use."""
    found = [program[full] for full in program if full.rpartition(".")[2] == name]
    if len(found) != 1:
        raise ValueError(f"the shader uses {len(found)} uniforms named {name}")
    return found[0]


def bind(program: Any, name: str, given: Texture | Filtered, unit: int) -> Any:
    """Upload a texture and let the sampler of that name read it; return it."""
    texture = given.texture if isinstance(given, Filtered) else given
    sampler = uniform(program, name)
    bits = 8 * texture.dtype.itemsize
    if texture.dtype.kind == "f":
        dtype = "f4"
    elif sampler.gl_type == UNSIGNED_SAMPLER:
        dtype = f"u{bits // 8}"
    else:
        dtype = f"nu{bits // 8}"
    height, width = texture.shape[:2]
    made = context().texture(
        (width, height), channels(texture), texture.tobytes(), alignment=1, dtype=dtype
    )
    made.filter = (moderngl.NEAREST, moderngl.NEAREST)
    if isinstance(given, Filtered):
        made.build_mipmaps()
        made.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        made.repeat_x = made.repeat_y = False
    made.use(unit)
    sampler.value = unit
    return made


def draw(vertices: Any, size: tuple[int, int]) -> Picture:
    """Draw one triangle and return the picture."""
    height, width = size
    target = context().texture((width, height), 4, dtype="f4")
    frame = context().framebuffer(color_attachments=[target])
    frame.use()
    frame.clear()
    vertices.render(moderngl.TRIANGLES, vertices=3)
    pixels = frame.read(components=4, alignment=1, dtype="f4")
    context().gc()
    return np.frombuffer(pixels, np.float32).reshape(height, width, 4)


def _version(source: str) -> str:
    """Return the line that both shaders of a program must share."""
    found = re.match(r"\s*(#version .*)", source)
    if found is None:
        raise ValueError("the shader does not begin with #version")
    return found[1]
