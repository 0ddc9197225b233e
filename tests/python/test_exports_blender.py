"""Blender exports as text: what can be said without Blender."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import texforge


@pytest.fixture(params=["wavelet", "tiling"])
def script(request: pytest.FixtureRequest) -> bytes:
    photo = np.random.default_rng(0).random((64, 64), np.float32)
    texture = texforge.fit_noise(photo, model=request.param)
    files = texture.export("blender", name="granite")
    assert files == texture.export("blender", name="granite")
    assert list(files) == ["granite.py"]
    return files["granite.py"]


def test_the_script_knows_its_names(script: bytes) -> None:
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--select", "F", "-"]
    done = subprocess.run(command, input=script, capture_output=True, check=False)
    assert not done.returncode, done.stdout.decode()
