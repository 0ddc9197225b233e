"""Tiles one photograph and shows it repeated: `make demo`, `make demo PHOTO=file`."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import contact
import skimage.data
import texforge

OUT = Path("demo")


def main(arguments: list[str]) -> int:
    """Write the tile, its 3 x 3 tiling and a contact sheet; return the exit status."""
    started = time.perf_counter()
    try:
        if arguments:
            name = Path(arguments[0]).name
            photo = texforge.read_image(arguments[0])
            tile = texforge.tile(photo, progress=sys.stderr.isatty())
        else:
            name = "gravel (scikit-image)"
            gravel = skimage.data.gravel()  # type: ignore[no-untyped-call]
            photo = texforge.Image.tagged(gravel, "srgb")
            tile = texforge.tile(photo, size=384, progress=sys.stderr.isatty())
        seconds = time.perf_counter() - started
        OUT.mkdir(exist_ok=True)
        suffix = ".exr" if tile.encoding == "linear" else ".png"
        tile.save(OUT / f"tile{suffix}", overwrite=True)
    except texforge.TexforgeError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    once = contact.shown(tile.image, tile.encoding)
    repeated = contact.shown(tile.tiled(3, 3), tile.encoding)
    repeated.save(OUT / "tile_3x3.png")
    height, width = tile.image.shape[:2]
    cells = [
        (f"photo: {name}", contact.fitted(contact.shown(photo, photo.encoding), 768)),
        (
            f"tile: {width} x {height}",
            contact.fitted(once, 512),
        ),
        ("tile repeated 3 x 3", contact.fitted(repeated, 768)),
    ]
    contact.sheet([cells]).save(OUT / "contact.png")
    print(f"{tile!r} in {seconds:.1f} s")
    for path in (OUT / f"tile{suffix}", OUT / "tile_3x3.png", OUT / "contact.png"):
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
