"""Fits procedural textures to every picture below a folder; a sheet a class: `make noise-gallery`.

A row shows the middle of the photo, wavelet noise, oriented noise, and tiling and blending, all at
the same scale, with how well each is said to fit and what is recommended.
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

MODELS: tuple[texforge.Model, ...] = ("wavelet", "oriented", "tiling")


def middle(photo: texforge.Image, side: int) -> texforge.Image:
    """Return at most this much of the photo's middle."""
    top, left = (max(0, n - side) // 2 for n in photo.shape[:2])
    window = np.asarray(photo)[top : top + side, left : left + side]
    return texforge.Image.tagged(window, photo.encoding)


def row(path: Path, side: int, seed: int) -> list[contact.Cell]:
    """Fit one photograph in every way; return its row of the sheet."""
    photo = photos.reduced(texforge.read_image(path), side)
    height, width = photo.shape[:2]
    shown = middle(photo, side)
    cells: list[contact.Cell] = []
    for model in MODELS:
        started = time.perf_counter()
        texture = texforge.fit_noise(photo, model=model, seed=seed)
        seconds = time.perf_counter() - started
        if not cells:
            label = f"{path.name} {width} x {height}: {texture.recommended}"
            cells.append((label, contact.shown(shown, shown.encoding)))
        caption = f"{model}: fit {texture.score:.2f}, {seconds:.1f} s"
        print(f"{path}: {caption}", flush=True)
        picture = texture.render(shown.shape[:2])
        cells.append((caption, contact.shown(picture, picture.encoding)))
    return cells


def main() -> int:
    """Write the sheets; return 1 if a picture failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of folders of pictures")
    parser.add_argument("--out", type=Path, default=Path("noise-gallery"))
    parser.add_argument("--class", dest="classes", nargs="+", default=[], help="only these")
    parser.add_argument("--only", default="", help="part of the path that must match")
    parser.add_argument("--size", type=int, default=384, help="side of a picture, at most")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    failed = False
    found = photos.by_class(arguments.folder, arguments.classes, arguments.only)
    for name, paths in found.items():
        rows = []
        for path in paths:
            try:
                rows.append(row(path, arguments.size, arguments.seed))
            except texforge.TexforgeError as error:
                failed = True
                print(f"{path}: {error}", file=sys.stderr)
        if rows:
            contact.sheet(rows).save(arguments.out / f"{name}.png")
            print(f"wrote {arguments.out / name}.png")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
