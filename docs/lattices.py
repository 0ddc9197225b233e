"""Measures lattice detection over the exemplars: `make lattices`.

For each photograph of MANIFEST.json that has a lattice measured by hand: is the detected one the
same, that is, do both generate the same points within the manifest's tolerance? For each of the
class `stochastic`: is it refused? Prints tables in Markdown, failures included, and writes every
photograph with its lattice drawn over it, found or only guessed, to look at.

With `--variants` the same of photographs that we do not have: every one also cut, scaled, turned,
unevenly lit, noisy, blurred and poorly compressed.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import texforge
from PIL import Image, ImageFilter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

KNOWN = ("near_regular", "near_periodic")
REFUSED = "stochastic"


# Fewer cells in a variant than this are too few, a shorter vector too fine.
CELLS = 4.0
FINEST = 6.0


def cut(share: float) -> Callable[[Image.Image], Image.Image]:
    """Return what cuts out a share of either side, off the middle."""

    def of(picture: Image.Image) -> Image.Image:
        width, height = (round(share * n) for n in picture.size)
        left, top = (picture.width - width) // 3, 2 * (picture.height - height) // 3
        return picture.crop((left, top, left + width, top + height))

    return of


def sized(scale: float) -> Callable[[Image.Image], Image.Image]:
    """Return what scales by this."""

    def of(picture: Image.Image) -> Image.Image:
        width, height = (max(16, round(scale * n)) for n in picture.size)
        return picture.resize((width, height), Image.Resampling.LANCZOS)

    return of


def turned(degrees: float) -> Callable[[Image.Image], Image.Image]:
    """Return what turns counter-clockwise and cuts off what is empty then."""

    def of(picture: Image.Image) -> Image.Image:
        angle = np.radians(abs(degrees))
        width, height = picture.size
        # The largest rectangle of the same shape inside.
        longer, shorter = max(width, height), min(width, height)
        share = 1 / (np.cos(angle) + longer / shorter * np.sin(angle))
        whole = picture.rotate(degrees, Image.Resampling.BICUBIC)
        left, top = (int(np.ceil(n * (1 - share) / 2)) for n in picture.size)
        return whole.crop((left, top, width - left, height - top))

    return of


def lit(picture: Image.Image) -> Image.Image:
    """Return the picture a third as bright on one corner as on the opposite."""
    y, x = np.linspace(0, 0.5, picture.height)[:, None], np.linspace(0, 0.5, picture.width)
    light = (1 / 3 + 2 / 3 * (x + y))[..., None]
    return Image.fromarray((np.asarray(picture) * light).round().astype(np.uint8))


def noisy(picture: Image.Image) -> Image.Image:
    """Return the picture with the noise of a dim room."""
    noise = np.random.default_rng(1).normal(0, 12, (picture.height, picture.width, 3))
    return Image.fromarray((np.asarray(picture) + noise).clip(0, 255).round().astype(np.uint8))


def blurred(picture: Image.Image) -> Image.Image:
    """Return the picture out of focus."""
    radius = max(1.0, min(picture.size) / 400)
    return picture.filter(ImageFilter.GaussianBlur(radius))


def compressed(picture: Image.Image) -> Image.Image:
    """Return the picture as a poor JPEG file has it."""
    file = io.BytesIO()
    picture.save(file, "JPEG", quality=15)
    return Image.open(file).convert("RGB")


# What is done, and to displacements: the scale, and the degrees that they turn counter-clockwise.
VARIANTS: dict[str, tuple[Callable[[Image.Image], Image.Image], float, float]] = {
    "as it is": (lambda picture: picture, 1, 0),
    "cut to 70 %": (cut(0.7), 1, 0),
    "half size": (sized(0.5), 0.5, 0),
    "1.4 size": (sized(1.4), 1.4, 0),
    "turned 3": (turned(3), 1, 3),
    "turned -7": (turned(-7), 1, -7),
    "turned 20": (turned(20), 1, 20),
    "lit": (lit, 1, 0),
    "noisy": (noisy, 1, 0),
    "blurred": (blurred, 1, 0),
    "compressed": (compressed, 1, 0),
}


def changed(truth: dict[str, Any], scale: float, degrees: float) -> dict[str, Any]:
    """Return the lattice of a variant."""
    angle = np.radians(degrees)
    # Downwards is positive, so counter-clockwise is this.
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    vectors = scale * np.array([truth["v1"], truth["v2"]], dtype=np.float64) @ turn.T
    tolerance = max(1.0, scale * truth["tolerance_px"])
    return {"v1": vectors[0], "v2": vectors[1], "tolerance_px": tolerance}


def visible(truth: dict[str, Any], picture: Image.Image) -> bool:
    """Return whether enough of a lattice is in a picture to be found."""
    vectors = np.array([truth["v1"], truth["v2"]], dtype=np.float64)
    cells = picture.width * picture.height / abs(np.linalg.det(vectors))
    shortest = min(
        np.linalg.norm(a * vectors[0] + b * vectors[1])
        for a, b in [(1, 0), (0, 1), (1, 1), (1, -1)]
    )
    reduced = min(1.0, 1024 / np.sqrt(picture.width * picture.height))
    return bool(cells >= CELLS and shortest * reduced >= FINEST)


def variants(exemplars: Path) -> list[str]:
    """Return the table of all variants of all photographs."""
    names = list(VARIANTS)
    lines = ["| photo | " + " | ".join(names) + " |", "| --- |" + " --- |" * len(names)]
    totals = {name: [0, 0] for name in [*KNOWN, REFUSED]}
    for entry in entries(exemplars, (*KNOWN, REFUSED)):
        with Image.open(exemplars / entry["file"]) as file:
            whole = file.convert("RGB")
        verdicts = []
        for change, scale, degrees in VARIANTS.values():
            picture = change(whole)
            truth = changed(entry["lattice"], scale, degrees) if entry["class"] in KNOWN else None
            if truth and not visible(truth, picture):
                verdicts.append("-")
                continue
            lattice = texforge.detect_lattice(np.asarray(picture))
            if truth:
                ok = lattice.found and same(lattice, truth)
                verdict = "right" if ok else "wrong" if lattice.found else "missed"
            else:
                ok = not lattice.found
                verdict = "refused" if ok else "taken for regular"
            total = totals[entry["class"]]
            total[0], total[1] = total[0] + ok, total[1] + 1
            verdicts.append(f"{verdict} {lattice.confidence:.2f}")
        lines.append(f"| {entry['file']} | " + " | ".join(verdicts) + " |")
    right, known = (sum(totals[name][k] for name in KNOWN) for k in (0, 1))
    refused, others = totals[REFUSED]
    lines += ["", f"Right: {right} of {known}. Refused: {refused} of {others}."]
    return lines


def same(lattice: texforge.Lattice, truth: dict[str, Any]) -> bool:
    """Return whether both lattices have the same points, up to the tolerance.

    Each vector of the one is then nearly a whole combination of the other's, and the whole numbers
    have the determinant 1 or -1.
    """
    wanted = np.array([truth["v1"], truth["v2"]], dtype=np.float64)
    got = np.array([lattice.v1, lattice.v2])
    whole = np.rint(got @ np.linalg.inv(wanted))
    off = np.linalg.norm(whole @ wanted - got, axis=1).max()
    return bool(abs(abs(np.linalg.det(whole)) - 1) < 0.5 and off <= truth["tolerance_px"])


def entries(exemplars: Path, classes: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """Yield what the manifest says of the photographs of some classes."""
    manifest = json.loads((exemplars / "MANIFEST.json").read_text(encoding="utf-8"))
    yield from (entry for entry in manifest if entry["class"] in classes)


def shown(vector: object) -> str:
    """Return a vector as text."""
    x, y = np.asarray(vector, dtype=np.float64)
    return f"({x:.1f}, {y:.1f})"


def main() -> int:
    """Run it; returns the exit status."""
    parser = argparse.ArgumentParser(description="Measures lattice detection.")
    parser.add_argument("exemplars", type=Path, help="folder with MANIFEST.json")
    parser.add_argument("--out", type=Path, default=Path("lattices"), help="folder for overlays")
    parser.add_argument("--variants", action="store_true", help="cut, scaled, turned, noisy, ...")
    args = parser.parse_args()
    if not (args.exemplars / "MANIFEST.json").is_file():
        parser.error(f"{args.exemplars} holds no MANIFEST.json")
    if args.variants:
        sys.stdout.write("\n".join(variants(args.exemplars)) + "\n")
        return 0
    args.out.mkdir(parents=True, exist_ok=True)

    def detect(entry: dict[str, Any]) -> texforge.Lattice:
        path = args.exemplars / entry["file"]
        lattice = texforge.detect_lattice(texforge.read_image(path))
        name = f"{entry['class']}-{path.stem}.jpg"
        texforge.write_image(args.out / name, lattice.overlay(), kind="color", overwrite=True)
        return lattice

    lines = ["| photo | by hand | detected | confidence | |", "| --- | --- | --- | ---: | --- |"]
    right = total = 0
    for entry in entries(args.exemplars, KNOWN):
        truth, lattice = entry["lattice"], detect(entry)
        ok = lattice.found and same(lattice, truth)
        verdict = "right" if ok else "wrong" if lattice.found else "missed"
        right, total = right + ok, total + 1
        lines.append(
            f"| {entry['file']} | {shown(truth['v1'])} {shown(truth['v2'])} | {shown(lattice.v1)} "
            f"{shown(lattice.v2)} | {lattice.confidence:.2f} | {verdict} |"
        )
    lines += ["", f"Right: {right} of {total}.", ""]
    lines += ["| photo without lattice | confidence | |", "| --- | ---: | --- |"]
    refused = total = 0
    for entry in entries(args.exemplars, (REFUSED,)):
        lattice = detect(entry)
        refused, total = refused + (not lattice.found), total + 1
        verdict = "taken for regular" if lattice.found else "refused"
        lines.append(f"| {entry['file']} | {lattice.confidence:.2f} | {verdict} |")
    lines += ["", f"Refused: {refused} of {total}."]
    sys.stdout.write("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
