"""HLSL: compiled to SPIR-V, and from there to GLSL, which is rendered."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from .gl import render_glsl
from .tools import Filtered, Picture, Texture, Uniform, run

if TYPE_CHECKING:
    from collections.abc import Mapping


def compile_hlsl(source: str, entry: str) -> str:
    """Compile a pixel shader; return it as GLSL."""
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "shader.spv"
        run(
            "glslang-tools",
            *("glslangValidator", "--stdin", "-D", "-V", "-S", "frag", "-e", entry),
            *("--auto-map-bindings", "-o", binary),
            source=source,
        )
        return run(
            "spirv-cross",
            *("spirv-cross", binary, "--version", "330", "--no-es"),
            *("--no-420pack-extension", "--glsl-emit-ubo-as-plain-uniforms"),
        )


def render_hlsl(
    source: str,
    entry: str,
    size: tuple[int, int],
    textures: Mapping[str, Texture | Filtered] | None = None,
    uniforms: Mapping[str, Uniform] | None = None,
) -> Picture:
    """Run a pixel shader, as `render_glsl` does."""
    glsl = compile_hlsl(source, entry)
    # One sampler for each pair of a texture and a sampler state, named by both.
    given = textures or {}
    combined = {}
    for sampler in set(re.findall(r"SPIRV_Cross_Combined(\w+)", glsl)):
        name = max((n for n in given if sampler.startswith(n)), key=len, default=None)
        if name is not None:
            combined[f"SPIRV_Cross_Combined{sampler}"] = given[name]
    return render_glsl(glsl, size, combined, uniforms)
