"""OSL exports: compiled, rendered in Cycles, compared with our own values."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from .cycles import render_osl

HERE = Path(__file__).parent
PYTHON = HERE.parent.parent / ".venv" / "bin" / "python"
"""Where texforge is installed."""

MAPS = [
    ("grey", "basecolor"),
    ("color", "basecolor"),
    ("square", "basecolor"),
    ("material", "roughness"),
    ("oriented", "basecolor"),
]


@pytest.fixture(scope="module")
def exports(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a folder for each texture: its shader, and what its maps must show."""
    folder = tmp_path_factory.mktemp("exports")
    made_by("noise_exports.py", "osl", folder)
    return folder


@pytest.fixture(scope="module")
def tiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the same of tiled textures."""
    folder = tmp_path_factory.mktemp("tiled")
    made_by("tiled_exports.py", folder)
    return folder


def made_by(maker: str, *arguments: str | Path) -> None:
    try:
        done = subprocess.run(
            [PYTHON, HERE.parent / "python" / maker, *arguments],
            capture_output=True,
            text=True,
            check=False,
        )
    except FileNotFoundError:
        if os.environ.get("TEXFORGE_CI"):
            raise
        pytest.skip(f"{PYTHON} is missing: make setup")
    assert not done.returncode, done.stderr


def shader(exports: Path, name: str) -> Path:
    # Named after the texture, but that `color` is a word of OSL; tiled ones are all `stones`.
    (file,) = (exports / name).glob("*.osl")
    return file


@pytest.mark.parametrize(("name", "output"), MAPS)
def test_maps_are_ours(exports: Path, name: str, output: str) -> None:
    arrays = [a for a in sorted((exports / name).glob(f"{output}-*.npy")) if a.stem[-1].isdigit()]
    assert len(arrays) == 2
    for array in arrays:
        wanted = np.load(array)
        read = render_osl(
            shader(exports, name),
            wanted.shape[:2],
            {"LinearLight": 0},
            coordinate="UV",
            output=output.capitalize(),
        )[::-1, :, : wanted.shape[-1]]
        np.testing.assert_allclose(np.clip(read, 0, 1), wanted, atol=5e-5)


def test_contrast_and_linear_light(exports: Path) -> None:
    wanted = np.load(exports / "color" / "basecolor-contrast.npy")
    light = np.where(wanted <= 0.04045, wanted / 12.92, ((wanted + 0.055) / 1.055) ** 2.4)
    read = render_osl(
        shader(exports, "color"),
        wanted.shape[:2],
        {"Contrast": 0.5},
        coordinate="UV",
        output="Basecolor",
    )[::-1, :, :3]
    np.testing.assert_allclose(np.clip(read, 0, 1), light, atol=5e-5)


@pytest.mark.parametrize("view", ["photo", "between", "filtered"])
@pytest.mark.parametrize(
    ("name", "output"),
    [("grey", "basecolor"), ("color", "basecolor"), ("material", "roughness")],
)
def test_tiled_maps_are_ours(tiled: Path, name: str, output: str, view: str) -> None:
    # As `tiled_exports.py` has it.
    scale, footprint = {"photo": (1, 0), "between": (0.43, 0), "filtered": (1, 2.9)}[view]
    wanted = np.load(tiled / name / f"{output}-{view}.npy")
    levels = sorted((tiled / name).glob("stones_levels*.png"))
    assert len(levels) == (2 if name == "material" else 1)
    read = render_osl(
        shader(tiled, name),
        wanted.shape[:2],
        {f"input_{m}": str(path) for m, path in enumerate(levels)}
        | {"LinearLight": 0, "Scale": scale / 2, "Footprint": footprint},
        coordinate="UV",
        output=output.capitalize(),
    )[..., : wanted.shape[-1]]
    error = np.abs(read - wanted)
    print(f"osl {name} {view}: {error.mean():.2g}, at most {error.max():.2g}")
    assert error.mean() < 1e-5
    assert error.max() < 1e-4
