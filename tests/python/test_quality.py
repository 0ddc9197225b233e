"""The goals for stained photographs, on those of ../shared/exemplars/stains (skipped without)."""

from __future__ import annotations

import statistics
from pathlib import Path

import numpy as np
import pytest
import texforge

STAINS = Path(__file__).parents[3] / "shared" / "exemplars" / "stains"
SIDE = 256


def reduced(photo: texforge.Image) -> texforge.Image:
    """Average squares of pixels, so that the photo's shorter side is about four tiles at most."""
    factor = max(1, min(photo.shape[:2]) // (4 * SIDE))
    height, width = (n // factor for n in photo.shape[:2])
    blocks = np.asarray(photo)[: height * factor, : width * factor].reshape(
        height, factor, width, factor, -1
    )
    mean = np.rint(blocks.mean(axis=(1, 3), dtype=np.float64))
    return texforge.Image.tagged(mean.astype(photo.dtype), photo.encoding)


@pytest.mark.skipif(not STAINS.is_dir(), reason="needs the photographs in ../shared/exemplars")
def test_stains_go_and_the_texture_stays() -> None:
    stationarity, texture = [], []
    for path in sorted(STAINS.iterdir()):
        if path.suffix.lower() not in {".png", ".jpg"}:
            continue
        photo = reduced(texforge.read_image(path))
        plain, ours = (
            texforge.tile(photo, size=SIDE, method=method).costs
            for method in ("wrap-only", "stationary")
        )
        stationarity.append(ours.stationarity / plain.stationarity)
        assert ours.texture is not None
        assert plain.texture is not None
        texture.append(ours.texture / plain.texture)
    assert len(texture) >= 10
    assert statistics.median(stationarity) <= 0.5, stationarity
    assert statistics.median(texture) <= 1.25, texture
