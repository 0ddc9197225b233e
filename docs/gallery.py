"""Tiles every picture below a folder and writes one contact sheet a folder: `make gallery`."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import contact
import texforge

SUFFIXES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".exr"}
OTHER_MAPS = ("normal", "nor_", "rough", "height", "disp", "_ao", "occlusion", "metal")


def row(path: Path, out: Path, arguments: argparse.Namespace) -> list[contact.Cell]:
    """Tile one photograph; return its row of the sheet."""
    photo = texforge.read_image(path)
    side = min(arguments.size, *photo.shape[:2])
    cells = [
        (
            f"{path.name} {photo.shape[1]}x{photo.shape[0]}",
            contact.fitted(contact.shown(photo, photo.encoding), 512),
        )
    ]
    for method in arguments.methods:
        started = time.perf_counter()
        tile = texforge.tile(photo, size=side, method=method, seed=arguments.seed)
        seconds = time.perf_counter() - started
        label = f"{method}: {tile.costs}, {seconds:.1f} s"
        print(f"{path}: {label}", flush=True)
        picture = contact.shown(tile.tiled(3, 3), tile.encoding)
        contact.shown(tile.image, tile.encoding).save(out / f"{path.stem}_{method}.png")
        cells.append((label, contact.fitted(picture, 640)))
    return cells


def main() -> int:
    """Write the sheets; return 1 if a picture failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="pictures, or folders of them")
    parser.add_argument("--out", type=Path, default=Path("gallery"))
    parser.add_argument("--size", type=int, default=384, help="largest side of a tile")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="part of the path that must match")
    parser.add_argument(
        "--methods", nargs="+", default=["stationary", "wrap-only"], help="columns of the sheet"
    )
    arguments = parser.parse_args()
    folders: dict[Path, list[Path]] = {}
    for path in sorted(arguments.folder.rglob("*")):
        wanted = path.suffix.lower() in SUFFIXES and arguments.only in str(path)
        if wanted and not any(word in path.name.lower() for word in OTHER_MAPS):
            folders.setdefault(path.parent, []).append(path)
    n_failed = 0
    for folder, paths in folders.items():
        name = "_".join(folder.relative_to(arguments.folder).parts) or folder.name
        out = arguments.out / name
        out.mkdir(parents=True, exist_ok=True)
        rows = []
        for path in paths:
            try:
                rows.append(row(path, out, arguments))
            except texforge.TexforgeError as error:
                n_failed += 1
                print(f"{path}: {error}", file=sys.stderr)
        if rows:
            contact.sheet(rows).save(arguments.out / f"{name}.png")
            print(f"wrote {arguments.out / name}.png", flush=True)
    return 1 if n_failed else 0


if __name__ == "__main__":
    sys.exit(main())
