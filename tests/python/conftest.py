"""What every test may use: small pictures, and quick settings."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import hypothesis
import numpy as np
import pytest

if TYPE_CHECKING:
    import numpy.typing as npt
    import texforge

# The first call in a process is slow; time is judged by nobody here.
hypothesis.settings.register_profile("default", deadline=None, max_examples=25)
hypothesis.settings.register_profile("thorough", deadline=None, max_examples=500)
hypothesis.settings.register_profile("ci", deadline=None, max_examples=25, derandomize=True)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))

QUICK: dict[str, Any] = {"size": (24, 32), "patch": 5, "quality": "draft"}
"""Settings with which a tile takes some hundredths of a second."""


def noise(
    height: int = 48, width: int = 64, channels: int | None = 3, seed: int = 0
) -> npt.NDArray[np.uint8]:
    """Return a picture in which nearly every pixel is unlike every other."""
    shape = (height, width) if channels is None else (height, width, channels)
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def source_map_of(tile: texforge.Tile) -> npt.NDArray[np.int32]:
    """Return the tile's source map, which it must have."""
    assert tile.source_map is not None
    return tile.source_map


@pytest.fixture
def photo() -> npt.NDArray[np.uint8]:
    """Return an RGB picture."""
    return noise()
