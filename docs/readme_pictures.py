"""Makes the README's pictures from scikit-image's photographs: `make readme-pictures`.

The photographs (512 x 512, grey) come in scikit-image's wheel and are in the public domain (CC0).
They have no stain, so one is painted, the same one each time.
"""

from __future__ import annotations

from pathlib import Path

import contact
import numpy as np
import skimage.data
import texforge
from PIL import Image

OUT = Path(__file__).parent / "pictures"
SCALE = 0.4
SIDE = 384


def stained(photo: texforge.Image) -> texforge.Image:
    """Return the photo with one large, soft, dark stain and a smaller one."""
    y, x = np.mgrid[: photo.shape[0], : photo.shape[1]] / photo.shape[0]
    wobble = 0.04 * np.sin(9 * x + 4 * y) + 0.03 * np.cos(13 * y - 5 * x)
    light = np.ones(photo.shape)
    for (cy, cx), radius, depth in (((0.36, 0.62), 0.2, 0.62), ((0.8, 0.2), 0.08, 0.333)):
        distance = np.hypot(y - cy, x - cx) + wobble
        light *= 1 - depth / (1 + np.exp((distance - radius) / 0.025))
    return texforge.Image.tagged(np.rint(np.asarray(photo) * light).astype(np.uint8), "srgb")


def straightened(photo: texforge.Image) -> texforge.Image:
    """Return the photograph of bricks as if seen from straight above, courses level."""
    width, height = 400, 480
    corners = [(0, 0), (width, 0), (width, height), (0, height)]
    # Between two courses, by eye: they run apart downwards.
    seen = [(73, 0), (428, 0), (527, 511), (14, 511)]
    rows, places = [], []
    for (x, y), (u, v) in zip(corners, seen, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        places += [u, v]
    view = np.linalg.solve(np.array(rows, float), np.array(places, float)).tolist()
    picture = Image.fromarray(np.asarray(photo))
    flat = np.asarray(
        picture.transform(
            (width, height), Image.Transform.PERSPECTIVE, view, Image.Resampling.BICUBIC
        )
    )
    inside = np.rot90(flat[20:470, :385])
    return texforge.Image.tagged(np.ascontiguousarray(inside), "srgb")


def small(image: object, scale: float = SCALE) -> Image.Image:
    """Return an array as a picture of the README's scale."""
    picture = contact.shown(np.asarray(image), "srgb")
    width, height = (round(n * scale) for n in picture.size)
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def save(name: str, rows: list[list[contact.Cell]]) -> None:
    """Write a sheet."""
    OUT.mkdir(exist_ok=True)
    contact.sheet(rows).convert("L").save(OUT / name, quality=72, optimize=True)
    print(f"wrote {OUT / name}: {(OUT / name).stat().st_size // 1000} kB")


def main() -> None:
    """Write the pictures."""
    data = {name: getattr(skimage.data, name)() for name in ("gravel", "brick")}
    photos = {name: texforge.Image.tagged(array, "srgb") for name, array in data.items()}
    rows: list[list[contact.Cell]] = []
    for name, photo in photos.items():
        tile = texforge.tile(photo, size=SIDE)
        print(f"{name}: {tile.costs}")
        rows.append(
            [
                (f"photo: {name}, 512 x 512", small(photo)),
                (f"tile, {SIDE} x {SIDE}", small(tile.image)),
                ("the tile repeated 3 x 3", small(tile.tiled())),
            ]
        )
    save("gravel.jpg", rows[:1])
    for row, name in zip(rows[1:], list(photos)[1:], strict=True):
        save(f"{name}.jpg", [row])

    bricks = straightened(photos["brick"])
    wall = texforge.regular(bricks, size=(512, 640))
    print(f"bricks: {texforge.detect_lattice(bricks)}")
    tile = texforge.tile(bricks, size=(256, 384))
    print(f"bricks, tile: {tile.report['notes']}")
    cells: list[contact.Cell] = [
        (f"photo, straightened, {bricks.shape[1]} x {bricks.shape[0]}", small(bricks, 0.6)),
        ("regular, 640 x 512", small(wall.image, 0.6)),
        ("tile, 384 x 256, repeated 2 x 2", small(tile.tiled(2, 2), 0.6)),
    ]
    save("bricks.jpg", [cells])

    photo = stained(photos["gravel"])
    cells = [("photo with a stain, 512 x 512", small(photo, 0.333))]
    for method, label in (("wrap-only", "wrap-only: no seam"), ("stationary", "stationary")):
        tile = texforge.tile(photo, size=SIDE, method=method)  # type: ignore[arg-type]
        print(f"stained gravel, {method}: {tile.costs}")
        cost = tile.costs.stationarity
        cells.append((f"{label}; cost {cost:.2f}; 3 x 3", small(tile.tiled(), 0.333)))
    save("stain.jpg", [cells])

    cells = [("photo: gravel, 512 x 512", small(photos["gravel"], 0.75))]
    models: tuple[tuple[texforge.Model, str], ...] = (
        ("wavelet", "wavelet noise: a kilobyte"),
        ("tiling", "tiling and blending: 0.7 MB"),
    )
    for model, label in models:
        texture = texforge.fit_noise(photos["gravel"], model=model)
        print(f"gravel, {model}: fit {texture.score:.2f}")
        cells.append((f"{label}; fit {texture.score:.2f}", small(texture.render(512), 0.75)))
    save("noise.jpg", [cells])

    palette = texforge.palette(photo, size=SIDE)
    places = zip(palette.stationarities, palette.tiles, strict=True)
    cells = [
        (f"stationarity {place:.2f}; 2 x 2", small(tile.tiled(2, 2), 0.25))
        for place, tile in places
    ]
    save("palette.jpg", [cells])


if __name__ == "__main__":
    main()
