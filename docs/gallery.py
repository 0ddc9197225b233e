"""Tiles every picture below a folder; one contact sheet a class, one page for all: `make gallery`.

The classes are the folders in the folder. A row of a sheet shows the photo, the baseline
`wrap-only` and the stationary tile repeated 3 x 3 (all at the same scale), and the middle of the
tile at full size, shifted by half so that the corner where four copies meet is in the middle.
"""

from __future__ import annotations

import argparse
import dataclasses
import html
import sys
import time
from pathlib import Path

import contact
import numpy as np
import photos
import texforge
from PIL import Image

METHODS: tuple[texforge.Method, ...] = ("wrap-only", "stationary")


@dataclasses.dataclass
class Page:
    """What the page shows of one class."""

    name: str
    sheet: str = ""
    rows: list[tuple[str, ...]] = dataclasses.field(default_factory=list)
    failures: list[str] = dataclasses.field(default_factory=list)


def middle(picture: Image.Image, width: int, height: int) -> Image.Image:
    """Return at most this much of the picture's middle."""
    left, top = (max(0, a - b) // 2 for a, b in zip(picture.size, (width, height), strict=True))
    right, bottom = (min(a, b) for a, b in zip(picture.size, (width, height), strict=True))
    return picture.crop((left, top, left + right, top + bottom))


def scaled(picture: Image.Image, scale: float) -> Image.Image:
    """Return the picture at this scale."""
    width, height = (max(1, round(n * scale)) for n in picture.size)
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def row(path: Path, out: Path, seed: int, side: int, page: Page) -> list[contact.Cell]:
    """Tile one photograph in every way; return its row of the sheet."""
    whole = texforge.read_image(path)
    photo = photos.reduced(whole, side)
    side = min(side, *photo.shape[:2])
    scale = min(1.0, 0.5 * 384 / side)
    seen = contact.shown(photo, photo.encoding)
    sharp = photos.gradient(seen, photos.opaque(photo))
    height, width = photo.shape[:2]
    label = f"{path.name} {width} x {height}"
    if photo is not whole:
        label += f" (1/{whole.shape[1] // width})"
    limit = round(3 * side * scale)
    shown = scaled(seen, scale)
    if max(shown.size) > limit:
        label += ", its middle"
        shown = middle(shown, limit, limit)
    cells: list[contact.Cell] = [(label, shown)]
    for method in METHODS:
        started = time.perf_counter()
        tile = texforge.tile(photo, size=side, method=method, seed=seed)
        seconds = time.perf_counter() - started
        once = contact.shown(tile.image, tile.encoding)
        ratio = photos.gradient(once, photos.opaque(tile.image)) / sharp if sharp else 1.0
        texture = tile.costs.texture or 0.0
        caption = (
            f"{method}, seed {seed}: texture {texture:.2f}, stationarity "
            f"{tile.costs.stationarity:.2f}, sharpness {ratio:.2f}, {seconds:.1f} s"
        )
        print(f"{path}: {caption}", flush=True)
        once.save(out / f"{path.stem}_{method}_{seed}.png")
        cells.append((caption, scaled(contact.shown(tile.tiled(3, 3), tile.encoding), scale)))
        page.rows.append(
            (
                path.name,
                method,
                str(seed),
                f"{texture:.2f}",
                f"{tile.costs.stationarity:.2f}",
                f"{ratio:.2f}",
                f"{seconds:.1f}",
            )
        )
        if method == METHODS[-1]:
            turned = np.roll(np.asarray(once), (once.height // 2, once.width // 2), (0, 1))
            corner = middle(Image.fromarray(turned), 384, 384)
            cells.append(("the same, the corner where copies meet, 1:1", corner))
    return cells


def gradient_of_sigma(photo: texforge.Image, seed: int, side: int) -> list[contact.Cell]:
    """Tile a photograph with a reach that grows from left to right (the paper's Fig. 10)."""
    ramp = np.geomspace(0.02, 0.6, side, dtype=np.float32)
    cells: list[contact.Cell] = []
    for label, sigma_map in (
        ("sigma 0.1", None),
        ("sigma 0.02 (left) to 0.6 (right)", np.tile(ramp, (side, 1))),
    ):
        tile = texforge.tile(photo, size=side, seed=seed, axis="y", sigma_map=sigma_map)
        cells.append((label, contact.shown(tile.image, tile.encoding)))
    return cells


def repeated(tile: texforge.Tile) -> Image.Image:
    """Return a tile two by two, at half its size."""
    return scaled(contact.shown(tile.tiled(2, 2), tile.encoding), 0.5)


def rarity(photo: texforge.Image, seed: int, side: int) -> list[contact.Cell]:
    """Tile a photograph with single things held back more and more."""
    return [
        (f"rarity {dial}", repeated(texforge.tile(photo, size=side, seed=seed, rarity=dial)))
        for dial in (0.0, 0.5, 1.0, 2.0)
    ]


def palette(photo: texforge.Image, seed: int, side: int) -> list[contact.Cell]:
    """Tile a photograph more and more evenly, in steps that look alike."""
    steps = texforge.palette(photo, size=side, seed=seed)
    places = zip(steps.stationarities, steps.sigmas, steps.tiles, strict=True)
    return [
        (f"stationarity {place:.2f}, sigma {sigma:.3g}", repeated(tile))
        for place, sigma, tile in places
    ]


def lattice(photo: texforge.Image, seed: int, side: int) -> list[contact.Cell]:
    """Tile a photograph that repeats, in step with it and not, in the size that it chooses."""
    del side
    both: tuple[texforge.Follow, ...] = ("auto", "off")
    step = [texforge.tile(photo, seed=seed, lattice=follow) for follow in both]
    places = zip(both, step, strict=True)
    return [
        (f"lattice {follow}, {tile.image.shape[1]} x {tile.image.shape[0]}", repeated(tile))
        for follow, tile in places
    ]


OPTIONS = {
    "gradients": gradient_of_sigma,
    "lattice": lattice,
    "palette": palette,
    "rarity": rarity,
}
"""What an option does to every photo: a sheet of a class each."""


def option_sheet(name: str, paths: list[Path], seed: int, side: int) -> Image.Image:
    """Show what one option does to the photographs of a class."""
    rows = []
    for path in paths:
        photo = photos.reduced(texforge.read_image(path), side)
        fitting = min(side, *photo.shape[:2])
        (label, first), *others = OPTIONS[name](photo, seed, fitting)
        rows.append([(f"{path.name}: {label}", first), *others])
    return contact.sheet(rows)


def write_index(out: Path, pages: list[Page]) -> None:
    """Write the page that shows all sheets and numbers."""
    head = ["photo", "method", "seed", "texture", "stationarity", "sharpness", "seconds"]
    parts = ["<!doctype html><meta charset=utf-8><title>texforge gallery</title>"]
    parts.append(
        "<style>body{font:14px sans-serif;margin:2em}img{max-width:100%}"
        "td,th{text-align:left;padding:0 1em 0 0}</style><h1>Gallery</h1>"
        "<p>Sharpness is the mean absolute difference of L* between neighbouring pixels, of the "
        "tile over that of the photo. Costs: lower is better.</p>"
    )
    for page in pages:
        parts.append(f"<h2>{html.escape(page.name)}</h2>")
        if page.sheet:
            sheet = html.escape(page.sheet)
            parts.append(f'<a href="{sheet}"><img src="{sheet}" alt="contact sheet"></a>')
        parts.extend(f"<p>Failed: {html.escape(failure)}</p>" for failure in page.failures)
        rows = [head, *page.rows]
        cells = ("".join(f"<td>{html.escape(cell)}</td>" for cell in line) for line in rows)
        parts.append("<table>" + "".join(f"<tr>{line}</tr>" for line in cells) + "</table>")
    (out / "index.html").write_text("\n".join(parts) + "\n", encoding="utf-8")


def main() -> int:
    """Write the sheets and the page; return 1 if a picture failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of folders of pictures")
    parser.add_argument("--out", type=Path, default=Path("gallery"))
    parser.add_argument("--class", dest="classes", nargs="+", default=[], help="only these")
    parser.add_argument("--only", default="", help="part of the path that must match")
    parser.add_argument("--size", type=int, default=384, help="side of a tile, at most")
    parser.add_argument(
        "--options", nargs="+", default=[], choices=OPTIONS, help="also sheets of what these do"
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    arguments = parser.parse_args()
    folder: Path = arguments.folder
    if not folder.is_dir():
        print(f"gallery: skipped, there is no folder {folder}")
        return 0
    classes = photos.by_class(folder, arguments.classes, arguments.only)
    pages = []
    for name, paths in classes.items():
        page = Page(name)
        out = arguments.out / name
        out.mkdir(parents=True, exist_ok=True)
        rows = []
        for path in paths:
            for seed in arguments.seeds:
                try:
                    rows.append(row(path, out, seed, arguments.size, page))
                except (texforge.TexforgeError, ValueError, OSError) as error:
                    page.failures.append(f"{path.name}, seed {seed}: {error}")
                    print(f"{path}: failed: {error}", file=sys.stderr, flush=True)
        for option in arguments.options:
            sheet = option_sheet(option, paths, arguments.seeds[0], arguments.size)
            sheet.save(arguments.out / f"{name}_{option}.png")
            print(f"wrote {arguments.out / f'{name}_{option}.png'}", flush=True)
        if rows:
            page.sheet = f"{name}.png"
            contact.sheet(rows).save(arguments.out / page.sheet)
            print(f"wrote {arguments.out / page.sheet}", flush=True)
        pages.append(page)
        write_index(arguments.out, pages)
    if not pages:
        print(f"gallery: nothing to do, no picture in {folder} matches")
        return 0
    print(f"wrote {arguments.out / 'index.html'}")
    return 1 if any(page.failures for page in pages) else 0


if __name__ == "__main__":
    sys.exit(main())
