"""Measures lattice detection over the exemplars: `make lattices`.

For each photograph of MANIFEST.json that has a lattice measured by hand: is the detected one the
same, that is, do both generate the same points within the manifest's tolerance? For each of the
class `stochastic`: is it refused? Prints tables in Markdown, failures included, and writes every
photograph with its lattice drawn over it, found or only guessed, to look at.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import texforge

if TYPE_CHECKING:
    from collections.abc import Iterator

KNOWN = ("near_regular", "near_periodic")
REFUSED = "stochastic"


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
    args = parser.parse_args()
    if not (args.exemplars / "MANIFEST.json").is_file():
        parser.error(f"{args.exemplars} holds no MANIFEST.json")
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
