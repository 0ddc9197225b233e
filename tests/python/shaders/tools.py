"""Programs and libraries that pip does not install."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import TYPE_CHECKING, NamedTuple, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt
import pytest

if TYPE_CHECKING:
    from pathlib import Path

Picture: TypeAlias = npt.NDArray[np.float32]
Texture: TypeAlias = npt.NDArray[np.generic]
"""Height x width, or height x width x 1, 2 or 4 (OpenGL: 3 too), of uint8, uint16 or float32."""
Uniform: TypeAlias = float | tuple[float, ...] | npt.NDArray[np.generic]


class Filtered(NamedTuple):
    """A texture with mipmaps that is read in between, and whose border goes on outside."""

    texture: Texture


class ShaderError(Exception):
    """A shader was refused; the message is the compiler's."""


def missing(tool: str, packages: str) -> NoReturn:
    """Skip the test; fail it in CI, which installs what is needed."""
    message = f"{tool} is missing; on Debian: apt-get install {packages}"
    if os.environ.get("TEXFORGE_CI"):
        pytest.fail(message)
    pytest.skip(message)


def run(package: str, *command: str | Path, source: str = "") -> str:
    """Run a compiler on a source and return what it prints."""
    program = str(command[0])
    if shutil.which(program) is None:
        missing(program, package)
    done = subprocess.run(command, input=source, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ShaderError((done.stdout + done.stderr).strip())
    return done.stdout


def channels(texture: Texture) -> int:
    """Return how many numbers a pixel has."""
    return 1 if texture.ndim == 2 else texture.shape[2]
