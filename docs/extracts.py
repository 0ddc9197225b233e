"""Extracts the tile of every exemplar that repeats: `make extracts`.

A row of a class's sheet shows the photograph, the best tile repeated over as much, and the same
with a border made anew, all at full size, so that seams show. Prints how each period was found,
what was refused, and how long it took; of a class that does not repeat, what passes for a period.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import contact
import numpy as np
import photos
import texforge
from PIL import Image

CLASSES = ("near_periodic", "near_regular")


def repeated(tile: texforge.ExtractedTile, side: int) -> Image.Image:
    """Return the tile repeated over a square of this side."""
    height, width = tile.image.shape[:2]
    tiled = tile.tiled(-(-side // height), -(-side // width))
    return contact.shown(np.asarray(tiled)[:side, :side], tile.encoding)


def row(path: Path, out: Path, side: int, periods: int) -> list[contact.Cell]:
    """Extract the tile of one photograph; return its row of the sheet."""
    photo = texforge.read_image(path)
    started = time.perf_counter()
    found = texforge.extract(photo, count=4, periods=periods)
    seconds = time.perf_counter() - started
    (down, _), (_, across) = found.period
    tile = found.tiles[0]
    height, width = tile.image.shape[:2]
    label = (
        f"{path.name}: {across:.1f} x {down:.1f} by {found.found_by}, confidence "
        f"{found.confidence or 0:.2f}, tile {width} x {height}, {seconds:.2f} s"
    )
    print(label, flush=True)
    Image.fromarray(found.sheet).save(out / f"{path.stem}.png")
    seen = contact.shown(photo, photo.encoding)
    cropped = seen.crop((0, 0, min(side, seen.width), min(side, seen.height)))
    cells: list[contact.Cell] = [(label, cropped)]
    cells.append((f"h {tile.continuity:.1f}, SSDN {tile.resemblance:.1f}", repeated(tile, side)))
    band = min(32, min(height, width) // 4)
    if band >= 5:
        (banded,) = texforge.extract(photo, count=1, periods=periods, band=band).tiles
        cells.append((f"band {band}", repeated(banded, side)))
    return cells


def main() -> int:
    """Write the sheets; return 1 if a picture failed."""
    parser = argparse.ArgumentParser(description="Extracts tiles of photographs that repeat.")
    parser.add_argument("exemplars", type=Path, help="folder of folders of pictures")
    parser.add_argument("--out", type=Path, default=Path("extracts"))
    parser.add_argument("--class", dest="classes", nargs="+", default=CLASSES, help="only these")
    parser.add_argument("--only", default="", help="part of the path that must match")
    parser.add_argument("--size", type=int, default=640, help="side of what is shown of a picture")
    parser.add_argument("--periods", type=int, default=1, help="periods in a tile")
    args = parser.parse_args()
    if not args.exemplars.is_dir():
        print(f"extracts: skipped, there is no folder {args.exemplars}")
        return 0
    failed = False
    for name, paths in photos.by_class(args.exemplars, args.classes, args.only).items():
        out = args.out / name
        out.mkdir(parents=True, exist_ok=True)
        rows = []
        for path in paths:
            try:
                rows.append(row(path, out, args.size, args.periods))
            except texforge.NoStructureError as error:
                print(f"{path.name}: refused, {error}", flush=True)
            except (texforge.TexforgeError, ValueError, OSError) as error:
                failed = True
                print(f"{path}: failed: {error}", file=sys.stderr, flush=True)
        if rows:
            contact.sheet(rows).save(args.out / f"{name}.png")
            print(f"wrote {args.out / f'{name}.png'}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
