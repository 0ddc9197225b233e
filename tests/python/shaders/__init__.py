"""Shaders compiled by the compilers people use, and rendered without a graphics card.

Every picture is float32, height x width x 4; its pixel `[y, x]` is what the shader says at
`(x + 0.5, y + 0.5)`, whichever way up the language counts.
"""

from .examples import EXAMPLES, View, compile_example, render_example
from .gl import compile_glsl, render_glsl
from .hlsl import compile_hlsl, render_hlsl
from .materialx import generate_glsl, generate_text, render_materialx, validate_materialx
from .tools import Filtered, Picture, ShaderError, Texture
from .webgpu import compile_wgsl, render_wgsl

__all__ = [
    "EXAMPLES",
    "Filtered",
    "Picture",
    "ShaderError",
    "Texture",
    "View",
    "compile_example",
    "compile_glsl",
    "compile_hlsl",
    "compile_wgsl",
    "generate_glsl",
    "generate_text",
    "render_example",
    "render_glsl",
    "render_hlsl",
    "render_materialx",
    "render_wgsl",
    "validate_materialx",
]
