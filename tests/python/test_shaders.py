"""The harness of tests/python/shaders, on a subject with one right answer: a 32-bit hash."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from .shaders import (
    ShaderError,
    compile_glsl,
    compile_hlsl,
    compile_wgsl,
    generate_glsl,
    render_glsl,
    render_hlsl,
    render_materialx,
    render_wgsl,
    validate_materialx,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Render = Callable[..., npt.NDArray[np.float32]]

SIZE = (37, 53)
"""Odd, so that a swapped or padded row shows."""
SEED = 7


def hashed(seed: int = SEED) -> npt.NDArray[np.float32]:
    """Return what every shader below must say."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.uint32)
    h = x * np.uint32(374761393) + y * np.uint32(668265263) + np.uint32(seed)
    h = (h ^ (h >> np.uint32(13))) * np.uint32(1274126177)
    h ^= h >> np.uint32(16)
    top = (h >> np.uint32(8)).astype(np.float32) / np.float32(1 << 24)
    low = (h & np.uint32(255)).astype(np.float32)
    return np.stack([top, low, x.astype(np.float32), y.astype(np.float32)], axis=2)


GLSL_BODY = """
uniform int seed;
out vec4 color;
void main() {
    uvec2 p = uvec2(gl_FragCoord.xy);
    uint h = p.x * 374761393u + p.y * 668265263u + uint(seed);
    h = (h ^ (h >> 13)) * 1274126177u;
    h = h ^ (h >> 16);
    color = vec4(float(h >> 8) / 16777216.0, float(h & 255u), float(p.x), float(p.y));
}
"""
PRECISION = "precision highp float; precision highp int; precision highp usampler2D;"
GLSL = {
    "300 es": f"#version 300 es\n{PRECISION}\n{GLSL_BODY}",
    "330": f"#version 330\n{GLSL_BODY}",
    "450": f"#version 450\n{GLSL_BODY}",
}
HLSL = """
int seed;
float4 pixel(float4 at : SV_Position) : SV_Target {
    uint2 p = uint2(at.xy);
    uint h = p.x * 374761393u + p.y * 668265263u + uint(seed);
    h = (h ^ (h >> 13)) * 1274126177u;
    h = h ^ (h >> 16);
    return float4(float(h >> 8) / 16777216.0, float(h & 255u), float(p.x), float(p.y));
}
"""
WGSL = """
@group(0) @binding(0) var<uniform> seed: i32;
@fragment fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2u(at.xy);
    var h = p.x * 374761393u + p.y * 668265263u + u32(seed);
    h = (h ^ (h >> 13u)) * 1274126177u;
    h = h ^ (h >> 16u);
    return vec4f(f32(h >> 8u) / 16777216.0, f32(h & 255u), f32(p.x), f32(p.y));
}
"""
MATERIALX = """<?xml version="1.0"?>
<materialx version="1.39">
  <nodedef name="ND_hash" node="hash">
    <input name="at" type="vector2" value="0, 0"/>
    <input name="size" type="vector2" value="1, 1"/>
    <input name="seed" type="integer" value="0"/>
    <output name="out" type="color4"/>
  </nodedef>
  <implementation name="IM_hash" nodedef="ND_hash" target="genglsl" file="hash.glsl"
                  function="hash"/>
  <nodegraph name="graph">
    <texcoord name="uv" type="vector2"/>
    <hash name="hash" type="color4">
      <input name="at" type="vector2" nodename="uv"/>
      <input name="size" type="vector2" value="53, 37"/>
      <input name="seed" type="integer" value="7"/>
    </hash>
    <output name="out" type="color4" nodename="hash"/>
  </nodegraph>
</materialx>
"""
MATERIALX_GLSL = """
void hash(vec2 at, vec2 size, int seed, out vec4 result) {
    uvec2 p = uvec2(floor(at * size));
    uint h = p.x * 374761393u + p.y * 668265263u + uint(seed);
    h = (h ^ (h >> 13)) * 1274126177u;
    h = h ^ (h >> 16);
    result = vec4(float(h >> 8) / 16777216.0, float(h & 255u), float(p.x), float(p.y));
}
"""


@pytest.mark.parametrize("version", GLSL)
def test_glsl_hashes(version: str) -> None:
    compile_glsl(GLSL[version])
    np.testing.assert_array_equal(
        render_glsl(GLSL[version], SIZE, uniforms={"seed": SEED}), hashed()
    )


def test_hlsl_hashes() -> None:
    np.testing.assert_array_equal(
        render_hlsl(HLSL, "pixel", SIZE, uniforms={"seed": SEED}), hashed()
    )


def test_wgsl_hashes() -> None:
    compile_wgsl(WGSL)
    np.testing.assert_array_equal(
        render_wgsl(WGSL, "pixel", SIZE, uniforms={"seed": SEED}), hashed()
    )


def test_materialx_hashes(tmp_path: Path) -> None:
    document = tmp_path / "hash.mtlx"
    document.write_text(MATERIALX)
    (tmp_path / "hash.glsl").write_text(MATERIALX_GLSL)
    validate_materialx(document)
    generate_glsl(document, "graph/out", "essl")
    np.testing.assert_array_equal(render_materialx(document, "graph/out", SIZE), hashed())


@pytest.mark.parametrize("version", GLSL)
def test_refused_glsl_says_why(version: str) -> None:
    broken = GLSL[version].replace("p.x *", "q.x *")
    with pytest.raises(ShaderError, match="'q' : undeclared identifier"):
        compile_glsl(broken)
    with pytest.raises(ShaderError, match="`q' undeclared"):
        render_glsl(broken, SIZE)


def test_refused_hlsl_says_why() -> None:
    with pytest.raises(ShaderError, match="'q' : unknown variable"):
        compile_hlsl(HLSL.replace("p.x *", "q.x *"), "pixel")


def test_refused_wgsl_says_why() -> None:
    with pytest.raises(ShaderError, match="no definition in scope for identifier: `q`"):
        compile_wgsl(WGSL.replace("p.x *", "q.x *"))


def test_refused_materialx_says_why(tmp_path: Path) -> None:
    document = tmp_path / "hash.mtlx"
    (tmp_path / "hash.glsl").write_text(MATERIALX_GLSL.replace("p.x *", "q.x *"))
    document.write_text(MATERIALX)
    with pytest.raises(ShaderError, match="'q' : undeclared identifier"):
        generate_glsl(document, "graph/out")
    document.write_text(MATERIALX.replace('type="integer" value="7"', 'type="float" value="7"'))
    with pytest.raises(ShaderError, match="hash"):
        validate_materialx(document)
    document.write_text(MATERIALX[:200])
    with pytest.raises(ShaderError, match="XML"):
        validate_materialx(document)


TEXTURES: dict[str, npt.DTypeLike] = {"uint8": np.uint8, "uint16": np.uint16, "float32": np.float32}


def tile(dtype: npt.DTypeLike, channels: int) -> npt.NDArray[np.generic]:
    """Return a texture of SIZE in which every pixel is unlike every other."""
    shape = SIZE if channels == 1 else (*SIZE, channels)
    numbers = np.random.default_rng(channels).integers(0, 65536, shape)
    return (numbers % 256 if dtype == np.uint8 else numbers).astype(dtype)


def as_read(texture: npt.NDArray[np.generic], *, whole: bool) -> npt.NDArray[np.float64]:
    """Return the four numbers that a shader reads from each pixel."""
    texture = texture.reshape(*SIZE, -1)
    fraction = not whole and texture.dtype.kind == "u"
    scale = np.iinfo(texture.dtype).max if fraction else 1  # type: ignore[type-var]
    read = np.zeros((*SIZE, 4))
    read[..., 3] = 1
    read[..., : texture.shape[2]] = texture.astype(np.float64) / scale
    return read


def glsl_reader(sampler: str) -> tuple[Render, tuple[str, ...]]:
    source = f"""#version 300 es
{PRECISION} precision highp sampler2D;
uniform {sampler} tile;
out vec4 color;
void main() {{ color = vec4(texelFetch(tile, ivec2(gl_FragCoord.xy), 0)); }}
"""
    return render_glsl, (source,)


def hlsl_reader(sampler: str) -> tuple[Render, tuple[str, ...]]:
    number = "uint4" if sampler[0] == "u" else "float4"
    source = f"""
Texture2D<{number}> tile;
float4 pixel(float4 at : SV_Position) : SV_Target {{
    return float4(tile.Load(int3(at.xy, 0)));
}}
"""
    return render_hlsl, (source, "pixel")


def wgsl_reader(sampler: str) -> tuple[Render, tuple[str, ...]]:
    number = "u32" if sampler[0] == "u" else "f32"
    source = f"""
@group(0) @binding(0) var tile: texture_2d<{number}>;
@fragment fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {{
    return vec4f(textureLoad(tile, vec2i(at.xy), 0));
}}
"""
    return render_wgsl, (source, "pixel")


@pytest.mark.parametrize("reader", [glsl_reader, hlsl_reader, wgsl_reader])
@pytest.mark.parametrize("channels", [1, 2, 4])
@pytest.mark.parametrize(
    ("dtype", "sampler"),
    [
        ("uint8", "sampler2D"),
        ("uint16", "sampler2D"),
        ("float32", "sampler2D"),
        ("uint8", "usampler2D"),
        ("uint16", "usampler2D"),
    ],
)
def test_texels_arrive(
    reader: Callable[[str], tuple[Render, tuple[str, ...]]],
    channels: int,
    dtype: str,
    sampler: str,
) -> None:
    texture = tile(TEXTURES[dtype], channels)
    render, arguments = reader(sampler)
    read = render(*arguments, SIZE, textures={"tile": texture})
    expected = as_read(texture, whole=sampler[0] == "u")
    # A fraction is a quotient that may be rounded twice; times the greatest it is still whole.
    np.testing.assert_allclose(read, expected, rtol=2e-7, atol=0)


def test_a_buffer_arrives_as_its_bytes_lie() -> None:
    source = """
struct Scale { offset: vec3f, factor: f32 }
@group(0) @binding(0) var<uniform> scale: Scale;
@group(1) @binding(3) var<storage, read> table: array<i32>;
@fragment fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let value = f32(table[i32(at.x) + 53 * i32(at.y)]);
    return vec4f(scale.offset + value * scale.factor, 1.0);
}
"""
    table = np.random.default_rng(0).integers(-1000, 1000, SIZE, dtype=np.int32)
    scale = np.array([1, 2, 3, 0.5], np.float32)
    read = render_wgsl(source, "pixel", SIZE, uniforms={"scale": scale, "table": table})
    expected = np.ones((*SIZE, 4), np.float32)
    expected[..., :3] = scale[:3] + table[..., np.newaxis] * scale[3]
    np.testing.assert_array_equal(read, expected)


@pytest.mark.parametrize("element", ["graph/out", "material"])
@pytest.mark.parametrize("mode", ["L", "RGB", "I;16"])
def test_materialx_reads_the_closest_texel(tmp_path: Path, element: str, mode: str) -> None:
    dtype = np.uint16 if mode == "I;16" else np.uint8
    texture = tile(dtype, 4)[..., :3] if mode == "RGB" else tile(dtype, 1)
    Image.fromarray(texture).save(tmp_path / "tile.png")
    document = tmp_path / "tile.mtlx"
    document.write_text("""<?xml version="1.0"?>
<materialx version="1.39">
  <nodegraph name="graph">
    <image name="tile" type="color3">
      <input name="file" type="filename" value="tile.png"/>
      <input name="filtertype" type="string" value="closest"/>
    </image>
    <output name="out" type="color3" nodename="tile"/>
  </nodegraph>
  <surface_unlit name="unlit" type="surfaceshader">
    <input name="emission_color" type="color3" nodegraph="graph" output="out"/>
  </surface_unlit>
  <surfacematerial name="material" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="unlit"/>
  </surfacematerial>
</materialx>
""")
    validate_materialx(document)
    read = render_materialx(document, element, SIZE)
    expected = as_read(texture, whole=False)[::-1]
    shown = 3 if mode == "RGB" else 1
    np.testing.assert_allclose(read[..., :shown], expected[..., :shown], rtol=2e-7, atol=0)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(ValueError, match="0 uniforms named sede"):
        render_glsl(GLSL["330"], SIZE, uniforms={"sede": 0})
    with pytest.raises(ValueError, match="no binding named sede"):
        render_wgsl(WGSL, "pixel", SIZE, uniforms={"sede": 0})


@pytest.mark.parametrize(("ci", "outcome"), [("", pytest.skip), ("1", pytest.fail)])
def test_what_is_missing_is_named_and_fails_in_ci(
    monkeypatch: pytest.MonkeyPatch, ci: str, outcome: Any
) -> None:
    monkeypatch.setenv("TEXFORGE_CI", ci)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(outcome.Exception, match="apt-get install glslang-tools"):
        compile_glsl(GLSL["330"])
