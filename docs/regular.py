"""Makes near-regular textures of the exemplars: `make regular-gallery`.

For each photograph of MANIFEST.json that has a lattice measured by hand: a texture of twice its
size, and one that repeats. A row of a class's sheet shows the photograph, the first, the corner of
the second where four copies meet, all at full size and cropped, and the second 3 x 3, made smaller.
Prints a table in Markdown, failures included: is the lattice of the texture, detected again, still
the photo's (off by at most half a pixel a period), or finer or coarser but in step with it, how
much of the photo occurs in the texture, and how long did it take.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import contact
import lattices
import numpy as np
import texforge

if TYPE_CHECKING:
    from PIL import Image

HEAD = """\
| photo | lattice | confidence | again | off | used | 2 x 2 | tileable |
| --- | --- | ---: | --- | ---: | ---: | ---: | ---: |"""


def off(got: texforge.Lattice, texture: texforge.Regular) -> str:
    """Say by how many pixels a detected lattice misses the texture's, in the worse vector.

    With how many cells of the one are a cell of the other, if it is finer or coarser: then what
    repeats is still in step. ``inf`` if it is none of these.
    """
    wanted, found = np.array(texture.lattice_of_texture), np.array([got.v1, got.v2])
    for fine, coarse, relation in ((wanted, found, "coarser"), (found, wanted, "finer")):
        whole = np.rint(coarse @ np.linalg.inv(fine))
        cells = round(abs(np.linalg.det(whole)))
        misses = np.linalg.norm(whole @ fine - coarse, axis=1).max()
        # In a lattice that is fine enough anything is.
        if cells > 0 and misses < 0.1 * np.linalg.norm(fine, axis=1).min():
            return f"{misses:.2f}" if cells == 1 else f"{misses:.2f}, {cells} x {relation}"
    return "inf"


def made(photo: texforge.Image, **options: Any) -> tuple[texforge.Regular, float]:
    """Return a texture, and the seconds it took."""
    started = time.perf_counter()
    texture = texforge.regular(photo, **options)
    return texture, time.perf_counter() - started


def cropped(picture: Image.Image, side: int) -> Image.Image:
    """Return at most this much of the picture's upper left corner."""
    return picture.crop((0, 0, min(side, picture.width), min(side, picture.height)))


def row(entry: dict[str, Any], path: Path, out: Path, side: int) -> list[contact.Cell]:
    """Make both textures of a photograph; print its line; return its row of the sheet."""
    photo = texforge.read_image(path)
    height, width = photo.shape[:2]
    follow: Any = texforge.detect_lattice(photo)
    how = f"{follow.confidence:.2f}"
    if not follow.found:
        follow, how = (entry["lattice"]["v1"], entry["lattice"]["v2"]), f"{how}, by hand"
    large, seconds = made(photo, size=(2 * height, 2 * width), lattice=follow)
    tile, tile_seconds = made(photo, tileable="both", lattice=follow)
    again = texforge.detect_lattice(large.image)
    used = len(np.unique(large.source_map.reshape(-1, 2), axis=0)) / (height * width)
    v1, v2 = large.lattice or ((0, 0), (0, 0))
    print(
        f"| {path.name} | {lattices.shown(v1)} {lattices.shown(v2)} | {how} | "
        f"{lattices.shown(again.v1)} {lattices.shown(again.v2)} {again.confidence:.2f} | "
        f"{off(again, large)} | {used:.0%} | {seconds:.1f} s | {tile_seconds:.1f} s |",
        flush=True,
    )
    for name, texture in (("large", large), ("tile", tile)):
        texture.save(out / f"{path.stem}_{name}.png", overwrite=True)
    rows, columns = (n // 2 for n in tile.image.shape[:2])
    meeting = np.roll(tile.image, (rows, columns), (0, 1))
    block, border = large.params["block"], large.params["border"]
    return [
        (f"{path.name} {width} x {height}", cropped(contact.shown(photo, photo.encoding), side)),
        (
            f"twice the size, block {block}, border {border}",
            cropped(contact.shown(large.image, large.encoding), side),
        ),
        (
            f"tileable, {tile.image.shape[1]} x {tile.image.shape[0]}, shifted by half",
            cropped(contact.shown(meeting, tile.encoding), side),
        ),
        ("3 x 3", contact.fitted(contact.shown(tile.tiled(3, 3), tile.encoding), side)),
    ]


def main() -> int:
    """Write the sheets; return 1 if a picture failed."""
    parser = argparse.ArgumentParser(description="Makes near-regular textures of photographs.")
    parser.add_argument("exemplars", type=Path, help="folder with MANIFEST.json")
    parser.add_argument("--out", type=Path, default=Path("regular-gallery"))
    parser.add_argument("--only", default="", help="part of the path that must match")
    parser.add_argument("--size", type=int, default=1024, help="side of what is shown of a picture")
    args = parser.parse_args()
    if not (args.exemplars / "MANIFEST.json").is_file():
        print(f"regular: skipped, {args.exemplars} holds no MANIFEST.json")
        return 0
    failed = False
    print(HEAD, flush=True)
    for name in lattices.KNOWN:
        out = args.out / name
        out.mkdir(parents=True, exist_ok=True)
        rows = []
        for entry in lattices.entries(args.exemplars, (name,)):
            if args.only not in entry["file"]:
                continue
            try:
                rows.append(row(entry, args.exemplars / entry["file"], out, args.size))
            except (texforge.TexforgeError, ValueError, OSError) as error:
                failed = True
                print(f"| {entry['file']} | failed: {error} |", flush=True)
        if rows:
            contact.sheet(rows).save(args.out / f"{name}.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
