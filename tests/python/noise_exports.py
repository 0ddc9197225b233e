"""Textures that node exports are tried on, and what these must show.

As a program, `noise_exports.py TARGET FOLDER`, it writes their exports and what they must show:
Blender's environment has no texforge.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import texforge

Values = npt.NDArray[np.floating[Any]]

SIZES = ((72, 100), (53, 37))
"""Height and width of pictures of the whole photo: at its own pixels, and between."""
CONTRAST = 0.5


def textures() -> dict[str, texforge.NoiseTexture]:
    """Return a grey, a colored, a square-banded and an oriented texture, and a material."""
    rng = np.random.default_rng(0)
    height, width = SIZES[0]
    coarse = np.kron(rng.random((height // 4, width // 4, 1)), np.ones((4, 4, 1)))
    unit = 0.15 + rng.gamma(2, 0.08, (height, width, 1)) + 0.3 * coarse
    photo = np.clip(unit + rng.normal(0, 0.05, (height, width, 3)), 0, 1)
    color = (255 * photo).astype(np.uint8)
    normal = np.stack(
        [0.2 + 0.6 * photo[..., 0], 0.3 + 0.4 * photo[..., 1], 0 * photo[..., 2] + 0.9], 2
    )
    maps = {"roughness": photo[..., 0] ** 2, "normal_dx": normal}
    return {
        "grey": texforge.fit_noise(color[..., 0], seed=3),
        "color": texforge.fit_noise(color),
        "square": texforge.fit_noise(color, bands="square"),
        "material": texforge.fit_noise(
            color, maps={name: values.astype(np.float32) for name, values in maps.items()}
        ),
        "oriented": texforge.NoiseTexture.from_json(json.dumps(ORIENTED)),
    }


ORIENTED = {
    "format": "texforge-noise",
    "version": 1,
    "seed": 5,
    "size": [100, 72],
    "maps": [{"name": "basecolor", "kind": "color", "encoding": "srgb", "channels": 3}],
    "mean": [0.5, 0.4, 0.3],
    "matrix": [[0.6, 0.2, 0.1], [0.5, -0.1, 0.3], [0.4, 0.1, -0.2]],
    "model": {
        "oriented": {
            "angle": 25,
            "bands": [
                {"levels": [0, 3], "parts": ["fine", "low"]},
                {"levels": [1, 3], "parts": ["band", "band"]},
                {"levels": [4, 2], "parts": ["low", "band"]},
            ],
            # The second as the noise is: the others have histograms.
            "channels": [
                {"weights": [0.1, 0.1, 0.15], "histogram": [0.02 * i * i - 0.3 for i in range(11)]},
                {"weights": [0.05, 0.2, 0.1]},
                {"weights": [0.1, 0.1, 0.1], "histogram": [0.06 * (i - 5) for i in range(11)]},
            ],
        }
    },
    "score": {"fit": 1, "recommended": "oriented"},
}


def expected(
    texture: texforge.NoiseTexture, name: str, size: tuple[int, int], contrast: float = 1
) -> Values:
    """Return a map over the photo's area: normals as vectors, green up, others as stored."""
    width, height = texture.document["size"]
    y, x = ((np.arange(n) + 0.5) / n for n in size)
    points = np.stack(np.meshgrid(x * width, y * height), axis=-1).reshape(-1, 2)
    mean = np.asarray(texture.document["mean"])
    values = mean + contrast * (texture.at(points) - mean)
    values = values.reshape(*size, -1)[..., texture.channels[name]]
    if name == "normal_dx":
        vectors: Values = (2 * values - 1) * (1, -1, 1)
        upright: Values = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        return upright
    clipped: Values = np.clip(values, 0, 1)
    return clipped


def main(
    target: texforge.ExportTarget, folder: Path, made: dict[str, texforge.NoiseTexture]
) -> None:
    """Write for each texture its export, and for each of its maps and sizes an array."""
    for name, texture in made.items():
        place = folder / name
        place.mkdir()
        for file, content in texture.export(target, name=name).items():
            (place / file).write_bytes(content)
        for map_name in texture.maps:
            for size in SIZES:
                np.save(place / f"{map_name}-{size[0]}.npy", expected(texture, map_name, size))
            half = expected(texture, map_name, SIZES[0], CONTRAST)
            np.save(place / f"{map_name}-contrast.npy", half)


if __name__ == "__main__":
    main(cast("texforge.ExportTarget", sys.argv[1]), Path(sys.argv[2]), textures())
