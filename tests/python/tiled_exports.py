"""Tiled textures that exports are tried on.

As a program, `tiled_exports.py FOLDER`, it writes their OSL exports and what these must show:
Blender's environment has no texforge.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import texforge

Values = npt.NDArray[np.floating[Any]]

NAMES = ["grey", "color", "material"]
PHOTO = (112, 144)
SIZE = (56, 72)
"""Height and width of the pictures that the OSL exports must show, the lowest row first."""
OSL_VIEWS = {"photo": (1.0, 0.0), "between": (0.43, 0.0), "filtered": (1.0, 2.9)}
"""Pixels of the photo to a pixel, and the footprint."""


def textures() -> dict[str, texforge.NoiseTexture]:
    """Return a grey texture without its histogram, a colored one, a material of 5 channels."""
    rng = np.random.default_rng(0)
    height, width = PHOTO
    y, x = np.mgrid[:height, :width] + 0.5
    relief = 0.1 * rng.random((height, width))
    # Pebbles upon each other.
    for top in np.linspace(0.2, 0.8, 220):
        at, radius = rng.random(2) * (height, width), 3 + 7 * rng.random()
        dome = 1 - ((y - at[0]) ** 2 + (x - at[1]) ** 2) / radius**2
        relief = np.where(dome > 0, top + 0.2 * dome, relief)
    light = relief + np.roll(relief, 1, 1) - np.roll(relief, -1, 1)
    photo = light[..., None] * (0.8, 0.6, 0.4) + rng.normal(0.15, 0.02, (height, width, 3))
    color = (255 * np.clip(photo, 0, 1)).astype(np.uint8)
    maps = {"height": relief.astype(np.float32), "roughness": (1 - light / 2).astype(np.float32)}
    return {
        "grey": texforge.fit_noise(color[..., 0], model="tiling", histogram="normal", seed=3),
        "color": texforge.fit_noise(color, model="tiling", cell=34, sharpness=1),
        "material": texforge.fit_noise(color, model="tiling", maps=maps, keep=96),
    }


def points(size: tuple[int, int], scale: float, origin: tuple[float, float] = (0, 0)) -> Values:
    """Return the middles of the pixels of a picture, in pixels of the photo."""
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    return np.stack([x, y], axis=-1) * scale + origin


def main(folder: Path) -> None:
    """Write for each texture its export, and for each of its maps and views an array."""
    for name, texture in textures().items():
        place = folder / name
        place.mkdir()
        for file, content in texture.export("osl", name="stones").items():
            (place / file).write_bytes(content)
        for view, (scale, footprint) in OSL_VIEWS.items():
            places = points(SIZE, scale) * (1, -1) + (0, PHOTO[0])
            values = texture.at(places, footprint=footprint)
            for map_name, channels in texture.channels.items():
                np.save(place / f"{map_name}-{view}.npy", values[..., channels])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
