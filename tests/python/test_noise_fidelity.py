"""Procedural textures against the photographs in ../shared/exemplars (skipped without)."""

from __future__ import annotations

import functools
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
import texforge

if TYPE_CHECKING:
    import numpy.typing as npt

PHOTOS = Path(__file__).parents[3] / "shared" / "exemplars" / "stochastic"
SIDE = 256
"""Of the pieces whose spectra are averaged."""
OCTAVES = 6
RENDERS = 4


class Fidelity(NamedTuple):
    """How a texture differs from its photo."""

    octaves: npt.NDArray[np.float64]
    """By how many decibels each octave of each channel is too strong, the finest octave first."""
    covariance: float
    """Of the colours: norm of the difference, as a share of the photo's."""
    histogram: float
    """Earth mover's distance of the worst channel, as a share of full scale."""


def octaves(plane: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the power of each octave, averaged over pieces that overlap by half (Welch)."""
    fade = np.hanning(SIDE + 2)[1:-1]
    pieces = np.lib.stride_tricks.sliding_window_view(plane - plane.mean(), (SIDE, SIDE))
    pieces = pieces[:: SIDE // 2, :: SIDE // 2].reshape(-1, SIDE, SIDE)
    power = np.mean([np.abs(np.fft.fft2(p * np.outer(fade, fade))) ** 2 for p in pieces], axis=0)
    f = np.fft.fftfreq(SIDE)
    # The finest has the corners as well.
    octave = np.maximum(-1 - np.ceil(np.log2(np.maximum(np.hypot(f[:, None], f), 1e-9))), 0)
    return np.array([power[octave == k].sum() for k in range(OCTAVES)])


@functools.cache
def measured(path: Path, weights: Any) -> Fidelity:
    """Compare a photo, reduced to about a megapixel, with renders of its noise."""
    photo = np.asarray(texforge.read_image(path))
    height, width = photo.shape[:2]
    factor = max(1, min(height, width) // 512)
    height, width = height // factor, width // factor
    blocks = photo[: height * factor, : width * factor].reshape(height, factor, width, factor, -1)
    unit = np.rint(blocks.mean((1, 3), dtype=float)).astype(np.uint8) / 255
    texture = texforge.fit_noise(
        (unit * 255).round().astype(np.uint8), model="wavelet", weights=weights
    )
    rng = np.random.default_rng(0)
    # Whole pixels, as in the photo: between them the noise is a little weaker.
    origins = rng.integers(-1_000_000, 1_000_000, (RENDERS, 2))
    renders = [
        np.asarray(texture.render((height, width), origin=(x, y), dtype="float32"), float)
        for x, y in origins.tolist()
    ]
    made = np.stack(renders).reshape(RENDERS, height, width, -1)
    channels = range(unit.shape[2])
    ratio = [
        np.mean([octaves(one[..., c]) for one in made], axis=0) / octaves(unit[..., c])
        for c in channels
    ]
    # Pixels far from each other: the coarsest octaves have few waves in a picture.
    pixels = texture.at(rng.integers(-1_000_000, 1_000_000, (400_000, 2)) + 0.5).astype(float)
    of_photo, of_made = (
        np.atleast_2d(np.cov(v.reshape(-1, len(channels)).T)) for v in (unit, pixels)
    )
    ranks = (np.arange(4096) + 0.5) / 4096
    moved = [
        np.abs(np.quantile(unit[..., c], ranks) - np.quantile(pixels[..., c], ranks)).mean()
        for c in channels
    ]
    return Fidelity(
        octaves=10 * np.log10(ratio),
        covariance=float(np.linalg.norm(of_made - of_photo) / np.linalg.norm(of_photo)),
        histogram=float(max(moved)),
    )


def report() -> str:
    """Return a table of all photos: run this file to see it."""
    lines = ["photo: octave error median, rms (direct: median, rms) dB; covariance; histogram"]
    for path in photos():
        ours, direct = measured(path, "corrected"), measured(path, "direct")
        a, b = np.abs(ours.octaves), np.abs(direct.octaves)
        lines.append(
            f"{path.stem:24} {np.median(a):.2f} {rms(a):.2f} ({np.median(b):.2f} {rms(b):.2f}); "
            f"{100 * ours.covariance:.1f} %; {ours.histogram:.4f}"
        )
        lines.append(f"  by octave {np.round(ours.octaves.mean(0), 2)}")
        lines.append(f"  direct    {np.round(direct.octaves.mean(0), 2)}")
    return "\n".join(lines)


def photos() -> list[Path]:
    return sorted(p for p in PHOTOS.iterdir() if p.suffix in (".png", ".jpg"))


def rms(values: npt.NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.skipif(not PHOTOS.is_dir(), reason="needs the photographs in ../shared/exemplars")
def test_textures_have_the_statistics_of_photographs() -> None:
    ours = {path.stem: measured(path, "corrected") for path in photos()}
    direct = {path.stem: measured(path, "direct") for path in photos()}
    assert len(ours) >= 8
    errors = np.concatenate([np.abs(one.octaves).ravel() for one in ours.values()])
    assert np.median(errors) < 1, report()
    for name, one in ours.items():
        assert rms(one.octaves) < rms(direct[name].octaves), (name, report())
    assert max(one.covariance for one in ours.values()) < 0.02, report()
    assert statistics.median(one.histogram for one in ours.values()) < 0.01, report()


if __name__ == "__main__":
    print(report())
