"""The noise format a second time: values at points, from the document and the format's description.

Slow and plain, in double precision; shares no code with the core and none of its shortcuts.
"""

from __future__ import annotations

import functools
import itertools
import math
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

Array: TypeAlias = "npt.NDArray[np.float64]"
Kind: TypeAlias = tuple[str, ...]
"""Which frequencies a band has: ``("square",)``, ``("round",)``, ``("round-fine",)`` or the parts
along both axes of oriented noise."""

SIDE, SOLID_SIDE = 256, 64
KNOTS = np.array([-3.2, -2.3, -1.6, -1.0, -0.5, 0.0, 0.5, 1.0, 1.6, 2.3, 3.2])
STEPS = (97, 61, 41)
LOWER_END = 0.21022410381342864

# The appendix of Cook and DeRose 2005.
DOWN = [
    *(0.000334, -0.001528, 0.000410, 0.003546, -0.000938, -0.008233, 0.002172, 0.019120),
    *(-0.005040, -0.044412, 0.011655, 0.103311, -0.025936, -0.243780, 0.033979, 0.655340),
]
DOWN += DOWN[::-1]
UP = [0.25, 0.75, 0.75, 0.25]


def mixed(x: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the hash "lowbias32" of words."""
    with np.errstate(over="ignore"):
        x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D)
        x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B)
        return np.asarray(x ^ (x >> np.uint32(16)))


def word(x: int) -> int:
    return int(mixed(np.array([x % 2**32], np.uint32))[0])


def white(stream: int, index: npt.NDArray[np.uint32]) -> Array:
    """Return Irwin-Hall noise: twelve halves of six hashed words."""
    total = np.zeros(index.shape)
    with np.errstate(over="ignore"):
        key = np.uint32(word(stream + 0x9E3779B9)) + index * np.uint32(6)
        for i in range(6):
            bits = mixed(key + np.uint32(i))
            total += (bits & np.uint32(0xFFFF)).astype(float) + (bits >> np.uint32(16))
    return total - 6 * 65535


def rise(f: Array) -> Array:
    octaves = np.log2(np.maximum(f / LOWER_END, 1e-9))
    return np.asarray(np.sin(np.pi / 2 * np.clip(octaves / 0.5 + 0.5, 0, 1)))


def fall(f: Array) -> Array:
    octaves = np.log2(np.maximum(f / (2 * LOWER_END), 1e-9))
    return np.asarray(np.cos(np.pi / 2 * np.clip(octaves / 0.5 + 0.5, 0, 1)))


def spline_transfer(f: Array) -> Array:
    return np.asarray(np.sinc(f) ** 3)


def knot_transfer(f: Array) -> Array:
    return np.asarray(0.75 + 0.25 * np.cos(2 * np.pi * f))


def amplitude(kind: Kind, axes: list[Array]) -> Array:
    """Return the amplitude of coefficients at frequencies, those of x last."""
    radius = np.sqrt(sum(f * f for f in axes))
    if kind == ("round",):
        transfer = functools.reduce(np.multiply, [spline_transfer(f) for f in axes])
        return rise(radius) * fall(radius) / transfer
    if kind == ("round-fine",):
        transfer = functools.reduce(np.multiply, [knot_transfer(f) for f in axes])
        return rise(radius) / transfer

    def part(name: str, f: Array) -> Array:
        if name == "low":
            return fall(f) / spline_transfer(f)
        if name == "band":
            return rise(f) * fall(f) / spline_transfer(f)
        return rise(f) / knot_transfer(f)

    y, x = axes
    return part(kind[0], x) * part(kind[1], y)


def frequencies(side: int, axes: int) -> list[Array]:
    f = np.abs(np.fft.fftfreq(side))
    return [np.asarray(a) for a in np.meshgrid(*[f] * axes, indexing="ij")]


def hold_matrix(n: int) -> Array:
    """Return what of a line half the resolution can hold: down, then up, round a torus."""
    down = np.zeros((n // 2, n))
    up = np.zeros((n, n // 2))
    for k in range(n // 2):
        for m, tap in enumerate(DOWN):
            down[k, (2 * k + m - 15) % n] += tap
        for m, tap in enumerate(UP):
            up[(2 * k + m - 1) % n, k] += tap
    return up @ down


def held(noise: Array) -> Array:
    """Return what half the resolution along all axes holds."""
    hold = hold_matrix(noise.shape[0])
    for axis in range(noise.ndim):
        noise = np.moveaxis(np.tensordot(hold, noise, (1, axis)), 0, axis)
    return noise


def bspline(x: Array) -> Array:
    """Return the quadratic B-spline around 0."""
    x = np.abs(x)
    outer = np.where(x < 1.5, 0.5 * (1.5 - x) ** 2, 0.0)
    return np.asarray(np.where(x < 0.5, 0.75 - x * x, outer))


@functools.cache
def coefficients(kind: Kind, axes: int) -> Array:
    """Return a torus of coefficients whose spline has unit variance."""
    side = SIDE if axes == 2 else SOLID_SIDE
    places = np.indices((side,) * axes).astype(np.uint32)
    index = places[0] * np.uint32(65536) + places[1]
    if axes == 3:
        index = (places[0] * np.uint32(side) + places[1]) * np.uint32(side) + places[2]
    first = 0 if axes == 2 else 16
    if kind == ("square",):
        one, two = (w - held(w) for w in (white(first, index), white(first + 1, index)))
        by = -((side // 2) | 1)
        plane = one + np.roll(two, (by,) * axes, tuple(range(axes)))
    else:
        spectrum = np.fft.fftn(white(first + 2, index))
        plane = np.fft.ifftn(spectrum * amplitude(kind, frequencies(side, axes))).real
    step = np.sqrt(np.mean(plane**2)) / 4096
    integers = np.clip(np.copysign(np.floor(np.abs(plane / step) + 0.5), plane), -32767, 32767)
    # The spline's own correlation, along every axis.
    around = integers
    for axis in range(axes):
        taps = ((-2, 1), (-1, 26), (0, 66), (1, 26), (2, 1))
        around = sum(w / 120 * np.roll(around, lag, axis) for lag, w in taps)
    variance = np.mean(integers * around)
    if axes == 2:
        variance -= np.mean(integers) ** 2
    return np.asarray(integers / np.sqrt(variance))


@functools.cache
def at_pixels(kind: Kind, levels: tuple[int, int]) -> float:
    """Return the variance at the photo's pixels of noise with unit variance everywhere.

    The format takes levels above 2 for 2.
    """
    n = 256
    if kind == ("square",):
        # Averaged over both parities.
        hold = hold_matrix(n)
        lags = (np.arange(n)[:, None] + np.arange(n)) % n
        rows = np.arange(n)[:, None]
        shared = (hold[rows, lags] + hold.T[rows, lags]).mean(0) / 2
        both = (hold @ hold.T)[rows, lags].mean(0)
        # Of the sum over x and y together the symmetric part.
        cross = hold[rows, lags].mean(0)
        assert np.allclose(cross, shared)
        correlation = np.outer(both, both) - 2 * np.outer(cross, cross)
        correlation[0, 0] += 1
    else:
        correlation = np.fft.ifft2(amplitude(kind, frequencies(n, 2)) ** 2).real
    lags = np.arange(-2, 3)
    block = correlation[np.ix_(lags, lags)]

    def products(level: int) -> Array:
        phases = np.arange(2**level) / 2**level
        k = np.arange(-4, 5)
        return np.array(
            [np.mean([np.sum(bspline(p - k) * bspline(p - k - d)) for p in phases]) for d in lags]
        )

    everywhere = np.array([1, 26, 66, 26, 1]) / 120
    down, across = (products(min(level, 2)) for level in reversed(levels))
    return float((down @ block @ across) / (everywhere @ block @ everywhere))


def noise_at(kind: Kind, places: Array) -> Array:
    """Return the spline at positions (..., axes), x first."""
    axes = places.shape[-1]
    torus = coefficients(kind, axes)
    middle = np.floor(places + 0.5).astype(np.int64)
    total = np.zeros(places.shape[:-1])
    for steps in itertools.product((-1, 0, 1), repeat=axes):
        index = middle + steps
        weight = bspline(places - index).prod(axis=-1)
        total += (
            weight * torus[tuple(index[..., i] % torus.shape[0] for i in reversed(range(axes)))]
        )
    return total


def projected_at(kind: Kind, places: Array, normals: Array) -> Array:
    """Return the noise in space, integrated along normals, before its own normalisation."""
    torus = coefficients(kind, 3)
    total = np.zeros(len(places))
    for i, (place, normal) in enumerate(zip(places, normals, strict=True)):
        reach = 3 * np.abs(normal) + 3 * np.sqrt(np.maximum(1 - normal**2, 0) / 2)
        ranges = [
            np.arange(math.ceil(p - r), math.floor(p + r) + 1)
            for p, r in zip(place, reach, strict=True)
        ]
        cells = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
        ahead = (place - cells) @ normal
        weights = bspline(cells + np.outer(ahead, normal) / 2 - place).prod(axis=-1)
        x, y, z = (cells % SOLID_SIDE).T
        total[i] = weights @ torus[z, y, x]
    return total


@functools.cache
def projected_deviation(kind: Kind) -> float:
    counters = np.arange(5 * 4096, dtype=np.uint32).reshape(-1, 5)
    numbers = (mixed(counters) >> np.uint32(8)) / 2**24
    z, angle = 2 * numbers[:, 3] - 1, 2 * np.pi * numbers[:, 4]
    r = np.sqrt(1 - z**2)
    normals = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)
    return float(np.sqrt(np.mean(projected_at(kind, numbers[:, :3] * SOLID_SIDE, normals) ** 2)))


def histogram_at(values: list[float], u: Array) -> Array:
    """Return the monotone cubic spline of Fritsch and Carlson through values at the knots."""
    v = np.array(values)
    secants = np.diff(v) / np.diff(KNOTS)
    slopes = np.concatenate([secants[:1], (secants[:-1] + secants[1:]) / 2, secants[-1:]])
    for k, secant in enumerate(secants):
        if secant <= 0:
            slopes[k : k + 2] = 0
            continue
        length = np.hypot(slopes[k] / secant, slopes[k + 1] / secant)
        if length > 3:
            slopes[k : k + 2] *= 3 / length
    u = np.clip(u, KNOTS[0], KNOTS[-1])
    i = np.clip(np.searchsorted(KNOTS, u, side="right") - 1, 0, len(secants) - 1)
    h = KNOTS[i + 1] - KNOTS[i]
    t = (u - KNOTS[i]) / h
    # The Hermite basis.
    return np.asarray(
        (1 + 2 * t) * (1 - t) ** 2 * v[i]
        + t * (1 - t) ** 2 * h * slopes[i]
        + t**2 * (3 - 2 * t) * v[i + 1]
        + t**2 * (t - 1) * h * slopes[i + 1]
    )


def terms(model: dict[str, Any]) -> list[tuple[Kind, tuple[int, int]]]:
    """Return what each weight weighs: the kind of band, and its levels along x and y."""
    if "oriented" in model:
        bands = model["oriented"]["bands"]
        return [(tuple(b["parts"]), (b["levels"][0], b["levels"][1])) for b in bands]
    shape = model["wavelet"]["bands"]
    count = len(model["wavelet"]["channels"][0]["weights"])
    fine = "round-fine" if shape == "round" else shape
    return [((shape if level else fine,), (level, level)) for level in range(count)]


def values_at(
    document: dict[str, Any],
    points: Array,
    *,
    normals: Array | None = None,
    footprint: float = 0.0,
    keep_contrast: bool = False,
) -> Array:
    """Return all channels at points (n, 2) or (n, 3)."""
    model = document["model"]
    all_terms = terms(model)
    if model.get("oriented", {}).get("angle"):
        angle = math.radians(model["oriented"]["angle"])
        turn = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        points = points @ np.array(turn)
    axes = points.shape[1]
    (inner,) = model.values()
    key = word(document["seed"])
    out = np.tile(np.array(document["mean"], float), (len(points), 1))
    for c, channel in enumerate(inner["channels"]):
        noise = np.zeros(len(points))
        whole = left = 0.0
        for t, ((kind, levels), weight) in enumerate(
            zip(all_terms, channel["weights"], strict=True)
        ):
            kept = 1.0
            if footprint > 0:
                share = min(max(1 + min(levels) - math.log2(footprint), 0), 1)
                kept = share**2 * (3 - 2 * share)
            variance = weight**2 * at_pixels(kind, levels)
            whole += variance
            left += variance * kept**2
            spacing = np.array([2 ** levels[0], 2 ** levels[1], 2 ** levels[0]][:axes])
            offset = [
                (word(key + 3 * t + a) + STEPS[a] * c * int(spacing[a]))
                % 2**32
                % (SIDE * int(spacing[a]))
                for a in range(axes)
            ]
            places = (points - 0.5 + offset) / spacing
            if axes == 2:
                noise += weight * kept * noise_at(kind, places)
                continue
            if normals is None:
                value = noise_at(kind, places)
            else:
                value = projected_at(kind, places, normals) / projected_deviation(kind)
            noise += weight * kept * math.sqrt(at_pixels(kind, levels)) * value
        lost = max(whole - left, 0.0)
        if keep_contrast and left > 0:
            noise *= math.sqrt(whole / left)
            lost = 0.0
        if "histogram" in channel:
            u = noise / math.sqrt(whole) if whole > 0 else noise * 0
            side = math.sqrt(3 * lost / whole) if whole > 0 else 0.0
            # Gauss-Hermite quadrature over what was taken away.
            below, here, above = (
                histogram_at(channel["histogram"], u + s) for s in (-side, 0.0, side)
            )
            noise = (below + 4 * here + above) / 6
        out += np.outer(noise, np.array(document["matrix"])[:, c])
    return out
