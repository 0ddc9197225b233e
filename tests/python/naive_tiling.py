"""Tiling and blending a second time: values at points, from the document and its description.

Slow and plain, in double precision; shares no code with the core but the reader of PNG files.
"""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import texforge

from . import naive_noise

if TYPE_CHECKING:
    import numpy.typing as npt

Array: TypeAlias = "npt.NDArray[np.float64]"

SIDE = 32


def decoded(text: str) -> Array:
    """Return the samples of a PNG file in base 64, with a last axis of channels."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        path.write_bytes(base64.b64decode(text))
        samples = np.asarray(texforge.read_image(path, kind="data"))
    assert samples.dtype == np.uint16
    return samples.reshape(*samples.shape[:2], -1).astype(float)


def places(size: int, cell: int) -> tuple[int, int]:
    """Return the first place along an axis, and the step to the next."""
    first = cell + 1
    return first, max(1, -(-(size - 2 * first) // 255))


def shaped(channel: dict[str, Any], normals: Array) -> Array:
    """Return a channel's values of standard normal numbers."""
    if "histogram" not in channel:
        return normals * float(channel["weights"][0])
    return naive_noise.histogram_at(channel["histogram"], normals)


class Tiles:
    """The tiles of a document."""

    def __init__(self, document: dict[str, Any]) -> None:
        """Unpack a document."""
        self.document = document
        tiling = document["model"]["tiling"]
        self.layout, self.channels = tiling["layout"], tiling["channels"]
        table = np.frombuffer(base64.b64decode(self.layout["table"]), np.uint8)
        self.table = table.reshape(SIDE, SIDE, 5).astype(int)
        pictures = np.concatenate([decoded(p) for p in self.layout["input"]["png"]], axis=2)
        self.input = (pictures[..., : len(self.channels)] - 32768) / 8192
        height, width = self.input.shape[:2]
        assert [width, height] == self.layout["input"]["size"]

    def place(self, i: int, j: int) -> Array:
        """Return where in the input vertex (i, j) lies."""
        height, width = self.input.shape[:2]
        axes = [places(n, c) for n, c in zip((width, height), self.layout["cell"], strict=True)]
        choice = self.table[j % SIDE, i % SIDE, :2]
        return np.array([first + step * c for (first, step), c in zip(axes, choice, strict=True)])

    def sample(self, at: Array) -> Array:
        """Return the input at a position, linear between pixels."""
        height, width = self.input.shape[:2]
        x, y = at - 0.5
        i, j = int(np.floor(x)), int(np.floor(y))
        total = np.zeros(len(self.channels))
        for k, across in ((i, 1 - (x - i)), (i + 1, x - i)):
            for m, down in ((j, 1 - (y - j)), (j + 1, y - j)):
                pixel = self.input[np.clip(m, 0, height - 1), np.clip(k, 0, width - 1)]
                total += across * down * pixel
        return total

    def normals(self, x: float, y: float) -> Array:
        """Return the independent channels at a point, as standard normal numbers."""
        a, b = self.layout["cell"]
        v = y / b
        u = x / a - v / 2
        i, j = int(np.floor(u)), int(np.floor(v))
        # The weight of a vertex falls straight to nothing at its six neighbours.
        weights = {}
        for p, q in [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]:
            weights[p, q] = 1 - max(abs(u - p), abs(v - q), abs(u - p + v - q))
        around = [vertex for vertex, weight in weights.items() if weight > 0]
        power = {vertex: weights[vertex] ** self.layout["sharpness"] for vertex in around}
        total, variance = np.zeros(len(self.channels)), 0.0
        for p, q in around:
            at = np.array([a * p + a // 2 * q, b * q])
            total += power[p, q] * self.sample(self.place(p, q) + np.array([x, y]) - at)
            variance += power[p, q] ** 2
            for way, (right, down) in enumerate([(1, 0), (0, 1), (-1, 1)]):
                other = (p + right, q + down)
                if other in power:
                    alike = self.table[q % SIDE, p % SIDE, 2 + way] / 255
                    variance += 2 * power[p, q] * power[other] * alike
        return np.asarray(total / np.sqrt(variance))

    def at(self, points: Array) -> Array:
        """Return all channels of the maps at points (x, y)."""
        normals = np.array([self.normals(x, y) for x, y in points])
        pairs = zip(self.channels, normals.T, strict=True)
        independent = np.stack([shaped(channel, u) for channel, u in pairs], axis=1)
        mean, matrix = np.array(self.document["mean"]), np.array(self.document["matrix"])
        return np.asarray(mean + independent @ matrix.T)
