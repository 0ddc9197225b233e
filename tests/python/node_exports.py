"""Textures that node exports are tried on: noise, and tiled ones.

As a program, `python -m tests.python.node_exports TARGET FOLDER`, it writes their exports and what
they must show: Blender's environment has no texforge.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

from . import noise_exports, tiled_exports

if TYPE_CHECKING:
    import texforge


def textures() -> dict[str, texforge.NoiseTexture]:
    """Return all by name; those that are tiled begin with `tiled_`."""
    tiled = {f"tiled_{name}": texture for name, texture in tiled_exports.textures().items()}
    return noise_exports.textures() | tiled


if __name__ == "__main__":
    noise_exports.main(cast("texforge.ExportTarget", sys.argv[1]), Path(sys.argv[2]), textures())
