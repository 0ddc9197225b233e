"""WGSL: checked by naga and rendered by Vulkan, both through wgpu."""

from __future__ import annotations

import functools
import re
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np
import wgpu

from .tools import Filtered, Picture, ShaderError, Texture, Uniform, channels, missing

if TYPE_CHECKING:
    from collections.abc import Mapping

BINDING = re.compile(
    r"@group\((\d+)\)\s*@binding\((\d+)\)\s*var(?:<([\w, ]+)>)?\s+(\w+)\s*:\s*([^;]+);"
)
"""Group, binding, address space, name, type."""

SCALARS = {"f": np.float32, "i": np.int32, "u": np.uint32}

WHOLE_PICTURE = """
@vertex fn main(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
"""


def compile_wgsl(source: str) -> Any:
    """Check a shader; return the module."""
    try:
        return _device().create_shader_module(code=source)
    except wgpu.GPUError as error:
        raise ShaderError(str(error)) from error


def render_wgsl(
    source: str,
    entry: str,
    size: tuple[int, int],
    textures: Mapping[str, Texture | Filtered] | None = None,
    uniforms: Mapping[str, Uniform] | None = None,
) -> Picture:
    """Run a fragment shader on a picture of `size`, which is height and width.

    A `texture_2d<f32>` reads integers as fractions of the greatest, a `texture_2d<u32>` as they
    are. Uniforms and storage buffers that are no scalars or vectors are given as their bytes lie.
    A `sampler` is linear, also between levels, and goes on with the border.
    """
    device = _device()
    height, width = size
    target = device.create_texture(
        size=(width, height, 1),
        format="rgba32float",
        usage=wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC,
    )
    pipeline = device.create_render_pipeline(
        layout="auto",
        vertex={"module": compile_wgsl(WHOLE_PICTURE), "entry_point": "main"},
        primitive={"topology": "triangle-list"},
        fragment={
            "module": compile_wgsl(source),
            "entry_point": entry,
            "targets": [{"format": "rgba32float"}],
        },
    )
    encoder = device.create_command_encoder()
    drawing = encoder.begin_render_pass(
        color_attachments=[
            {"view": target.create_view(), "load_op": "clear", "store_op": "store"},
        ]
    )
    drawing.set_pipeline(pipeline)
    for group, entries in _resources(source, textures or {}, uniforms or {}).items():
        layout = pipeline.get_bind_group_layout(group)
        drawing.set_bind_group(group, device.create_bind_group(layout=layout, entries=entries))
    drawing.draw(3)
    drawing.end()
    device.queue.submit([encoder.finish()])
    pixels = device.queue.read_texture(
        {"texture": target}, {"bytes_per_row": 16 * width}, (width, height, 1)
    )
    return np.frombuffer(pixels, np.float32).reshape(height, width, 4)


@functools.cache
def _device() -> Any:
    """Return a device on the processor, the same for everybody."""
    found = [a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan"]
    for adapter in found:
        if adapter.info["adapter_type"] == "CPU":
            return adapter.request_device_sync(required_features=["texture-format16bit-norm"])
    return missing("Vulkan on the processor", "mesa-vulkan-drivers")


def _resources(
    source: str, textures: Mapping[str, Texture | Filtered], uniforms: Mapping[str, Uniform]
) -> dict[int, list[dict[str, Any]]]:
    """Return what to bind, by group."""
    found = {m[4]: m for m in BINDING.finditer(source)}
    unknown = (textures.keys() | uniforms.keys()) - found.keys()
    if unknown:
        raise ValueError(f"the shader has no binding named {', '.join(sorted(unknown))}")
    groups = defaultdict(list)
    for name, texture in textures.items():
        resource = _texture(texture, integers="<u32>" in found[name][5])
        groups[int(found[name][1])].append({"binding": int(found[name][2]), "resource": resource})
    for name, value in uniforms.items():
        buffer = _buffer(value, found[name][5].strip(), storage="storage" in found[name][3])
        groups[int(found[name][1])].append(
            {"binding": int(found[name][2]), "resource": {"buffer": buffer}}
        )
    for binding in found.values():
        if binding[5].strip() == "sampler":
            linear = dict.fromkeys(["mag_filter", "min_filter", "mipmap_filter"], "linear")
            resource = _device().create_sampler(**linear)
            groups[int(binding[1])].append({"binding": int(binding[2]), "resource": resource})
    return groups


def _texture(given: Texture | Filtered, *, integers: bool) -> Any:
    """Upload a texture and return a view of it."""
    levels = _halves(given.texture) if isinstance(given, Filtered) else [given]
    texture = levels[0]
    bits = 8 * texture.dtype.itemsize
    kind = "float" if texture.dtype.kind == "f" else "uint" if integers else "unorm"
    height, width = texture.shape[:2]
    depth = channels(texture)
    made = _device().create_texture(
        size=(width, height, 1),
        format=f"{'rgba'[:depth]}{bits}{kind}",
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST,
        mip_level_count=len(levels),
    )
    for level, pixels in enumerate(levels):
        height, width = pixels.shape[:2]
        _device().queue.write_texture(
            {"texture": made, "mip_level": level},
            np.ascontiguousarray(pixels),
            {"bytes_per_row": width * depth * bits // 8},
            (width, height, 1),
        )
    return made.create_view()


def _halves(texture: Texture) -> list[Texture]:
    """Return a texture of integers and its halves, as long as its sides are even."""
    levels, exact = [texture], texture.astype(np.float64)
    while not any(n % 2 for n in exact.shape[:2]):
        exact = (exact[::2, ::2] + exact[1::2, ::2] + exact[::2, 1::2] + exact[1::2, 1::2]) / 4
        levels.append(np.rint(exact).astype(texture.dtype))
    return levels


def _buffer(value: Uniform, declared: str, *, storage: bool) -> Any:
    """Upload a uniform or a storage buffer."""
    if not isinstance(value, np.ndarray):
        number = re.fullmatch(r"(?:vec[234]<)?([fiu])32>?|vec[234]([fiu])", declared)
        if number is None:
            raise ValueError(f"{declared} takes an array with the bytes as they lie")
        value = np.array(value, SCALARS[number[1] or number[2]])
    data = value.tobytes()
    usage = wgpu.BufferUsage.STORAGE if storage else wgpu.BufferUsage.UNIFORM
    return _device().create_buffer_with_data(data=data + bytes(-len(data) % 16), usage=usage)
