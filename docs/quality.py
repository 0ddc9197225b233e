"""Measures stationary tiles of every photograph below a folder: `make quality`.

For each photograph, at the same seed as the baseline `wrap-only`:

- both costs as multiples of the baseline's;
- sharpness (mean absolute difference of L* between neighbours) as a multiple of the photo's, and of
  that of the photo's pixels that the tile is made of (this leaves out that a tile without the
  stains holds more of what is sharper or softer than they are);
- how much of the tile is copied in one piece: side of the largest square, and area of the largest
  connected region, whose pixels are neighbours in the photo as well.

Prints a table and the medians, in Markdown.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import contact
import numpy as np
import photos
import texforge

if TYPE_CHECKING:
    import numpy.typing as npt

HEAD = (
    "photo",
    "seed",
    "stationarity / wrap-only's",
    "texture / wrap-only's",
    "sharpness / photo's",
    "sharpness / used pixels'",
    "verbatim square",
    "verbatim region",
)


def largest_square(same: npt.NDArray[np.bool_]) -> int:
    """Return the side of the largest square that is all true, on the torus."""
    side = np.tile(same, (2, 2)).astype(np.int32)
    for y in range(1, side.shape[0]):
        for x in range(1, side.shape[1]):
            if side[y, x]:
                side[y, x] = 1 + min(side[y - 1, x], side[y, x - 1], side[y - 1, x - 1])
    height, width = len(same), len(same[0])
    return min(int(side.max()), height, width)


def verbatim(source_map: npt.NDArray[np.integer[Any]]) -> tuple[float, float]:
    """Return side and area of the largest verbatim square and region, as shares of the tile."""
    height, width = source_map.shape[:2]
    down = source_map[..., 0].astype(np.int64) - np.arange(height)[:, None]
    right = source_map[..., 1].astype(np.int64) - np.arange(width)
    key = down * (1 << 32) + right
    values, labels = np.unique(key, return_inverse=True)
    labels = labels.reshape(height, width)
    counts = np.bincount(labels.ravel(), minlength=len(values))
    square = region = 0
    for label in np.argsort(counts)[::-1]:
        # No region of this offset can be larger than all its pixels together.
        if counts[label] <= region and counts[label] <= square * square:
            break
        same = labels == label
        region = max(region, largest_region(same))
        if counts[label] > square * square:
            square = max(square, largest_square(same))
    return square / min(height, width), region / (height * width)


def largest_region(same: npt.NDArray[np.bool_]) -> int:
    """Return the size of the largest 4-connected region that is true, on the torus."""
    height, width = same.shape
    left = same.copy()
    best = 0
    for start in zip(*np.nonzero(same), strict=True):
        if not left[start]:
            continue
        left[start] = False
        stack, size = [start], 0
        while stack:
            y, x = stack.pop()
            size += 1
            for ny, nx in ((y + 1, x), (y - 1, x), (y, x + 1), (y, x - 1)):
                wrapped = (ny % height, nx % width)
                if left[wrapped]:
                    left[wrapped] = False
                    stack.append(wrapped)
        best = max(best, size)
    return best


def measured(path: Path, side: int, seed: int, options: dict[str, Any]) -> list[float]:
    """Return the numbers of one photograph; the options are for the stationary tile alone."""
    photo = photos.reduced(texforge.read_image(path), side)
    side = min(side, *photo.shape[:2])
    tiles = [
        texforge.tile(photo, size=side, seed=seed, method="wrap-only"),
        texforge.tile(photo, size=side, seed=seed, **options),
    ]
    baseline, ours = (tile.costs for tile in tiles)
    if baseline.texture is None or ours.texture is None:
        raise ValueError("a tile without texture cost")
    seen, made = (contact.shown(image, photo.encoding) for image in (photo, tiles[1].image))
    sharp = photos.gradient(seen, photos.opaque(photo))
    sharp_made = photos.gradient(made, photos.opaque(tiles[1].image))
    source = np.asarray(tiles[1].source_map)
    return [
        ours.stationarity / max(baseline.stationarity, 1e-9),
        ours.texture / max(baseline.texture, 1e-9),
        sharp_made / max(sharp, 1e-9),
        sharp_made / max(gradient_of_used(photos.lightness(seen), source), 1e-9),
        *verbatim(source),
    ]


def gradient_of_used(
    plane: npt.NDArray[np.float64], source_map: npt.NDArray[np.integer[Any]]
) -> float:
    """Return the photo's mean absolute difference to the next pixel, over the pixels named."""
    y, x = source_map[..., 0], source_map[..., 1]
    down = np.abs(np.diff(plane, axis=0, append=plane[-2:-1]))
    right = np.abs(np.diff(plane, axis=1, append=plane[:, -2:-1]))
    return float((down[y, x].mean() + right[y, x].mean()) / 2)


def main() -> int:
    """Print the table; return 1 if a picture failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of folders of pictures")
    parser.add_argument("--class", dest="classes", nargs="+", default=[], help="only these")
    parser.add_argument("--only", default="", help="part of the path that must match")
    parser.add_argument("--size", type=int, default=512, help="side of a tile, at most")
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE", help="tile options")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    arguments = parser.parse_args()
    if not arguments.folder.is_dir():
        print(f"quality: skipped, there is no folder {arguments.folder}")
        return 0
    options = dict(pair.split("=", 1) for pair in arguments.set)
    options = {name: json.loads(value) for name, value in options.items()}
    failed = False
    for name, paths in photos.by_class(arguments.folder, arguments.classes, arguments.only).items():
        print(f"\n{name}, tiles of {arguments.size} pixels\n")
        print(f"| {' | '.join(HEAD)} |\n| --- {'| ---: ' * (len(HEAD) - 1)}|", flush=True)
        rows = []
        for path in paths:
            for seed in arguments.seeds:
                try:
                    rows.append(measured(path, arguments.size, seed, options))
                except (texforge.TexforgeError, ValueError, OSError) as error:
                    print(f"{path}: failed: {error}", file=sys.stderr, flush=True)
                    failed = True
                    continue
                numbers = " | ".join(f"{value:.2f}" for value in rows[-1])
                print(f"| {path.name} | {seed} | {numbers} |", flush=True)
        if rows:
            medians = (statistics.median(column) for column in zip(*rows, strict=True))
            print(f"| **median** | | {' | '.join(f'{value:.2f}' for value in medians)} |")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
