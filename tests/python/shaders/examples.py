"""The examples that shader exports come with, compiled and rendered."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from .gl import compile_glsl, render_glsl
from .hlsl import compile_hlsl, render_hlsl
from .webgpu import compile_wgsl, render_wgsl

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .tools import Filtered, Picture, Texture

EXAMPLES = {
    "glsl": "_example.frag",
    "glsl-es": "_example_es.frag",
    "wgsl": "_example.wgsl",
    "hlsl": "_example.hlsl",
}
"""How the name of an example ends, by target."""


@dataclasses.dataclass(frozen=True)
class View:
    """What the example is asked to show."""

    scale: float = 1
    origin: tuple[float, float] = (0, 0)
    contrast: float = 1
    linear_light: bool = False
    which: int | None = None
    """Which of its outputs, if it has several."""


def compile_example(source: str, target: str) -> None:
    """Compile the source of an example."""
    if target == "wgsl":
        compile_wgsl(source)
    elif target == "hlsl":
        compile_hlsl(source, "example")
    else:
        compile_glsl(source)


def render_example(
    source: str,
    target: str,
    size: tuple[int, int],
    images: Mapping[str, Texture | Filtered],
    view: View,
) -> Picture:
    """Compile and render the source of an example with these pictures."""
    compile_example(source, target)
    if target == "wgsl":
        fields: list[tuple[Any, ...]] = [
            ("origin", np.float32, 2),
            ("scale", np.float32),
            ("contrast", np.float32),
            ("linear_light", np.uint32),
            ("shown", np.uint32),
        ]
        numbers = (view.origin, view.scale, view.contrast, view.linear_light, view.which or 0)
        return render_wgsl(source, "example", size, images, {"view": np.array([numbers], fields)})
    uniforms: dict[str, Any] = dataclasses.asdict(view)
    which = uniforms.pop("which")
    if which is not None:
        uniforms["shown"] = which
    if target == "hlsl":
        return render_hlsl(source, "example", size, images, uniforms)
    return render_glsl(source, size, images, uniforms)
