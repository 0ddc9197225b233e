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
    maker = HERE.parent / "python" / "noise_exports.py"
    try:
        done = subprocess.run(
            [PYTHON, maker, "osl", folder], capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        if os.environ.get("TEXFORGE_CI"):
            raise
        pytest.skip(f"{PYTHON} is missing: make setup")
    assert not done.returncode, done.stderr
    return folder


def shader(exports: Path, name: str) -> Path:
    # Named after the texture, but that `color` is a word of OSL.
    (file,) = (exports / name).glob(f"{name}*.osl")
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
