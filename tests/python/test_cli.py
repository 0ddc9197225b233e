"""The wheel's command, as a process. What it does is tested in Rust."""

from __future__ import annotations

import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import numpy as np
import pytest
import texforge

from .conftest import noise

SCRIPT = Path(sysconfig.get_path("scripts")) / "texforge"


def run(*arguments: str | Path, module: bool = False) -> subprocess.CompletedProcess[str]:
    program = [sys.executable, "-m", "texforge"] if module else [str(SCRIPT)]
    return subprocess.run(
        [*program, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=60
    )


@pytest.mark.parametrize("module", [False, True])
def test_version(module: bool) -> None:
    result = run("--version", module=module)
    assert result.returncode == 0, result.stderr
    assert texforge.__version__ in result.stdout


def test_usage_errors_exit_with_2() -> None:
    for arguments in (("--no-such-flag",), ("tile", "--patch", "many"), ("no-such-verb",)):
        result = run(*arguments)
        assert result.returncode == 2, result
        assert "Traceback" not in result.stderr
        assert result.stderr


def test_the_command_and_the_function_give_the_same_tile(tmp_path: Path) -> None:
    photo = noise(80, 90)
    texforge.write_image(tmp_path / "photo.png", photo)
    out = tmp_path / "tile.png"
    result = run(
        "tile", tmp_path / "photo.png", "-o", out, "--size", "48x32", "--seed", "3", "--quality",
        "draft",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    tile = texforge.tile(photo, size=(32, 48), seed=3, quality="draft")
    assert np.array_equal(texforge.read_image(out), tile.image)
    tile.save(tmp_path / "same.png")
    assert (tmp_path / "same.png").read_bytes() == out.read_bytes()


def test_what_cannot_be_done_exits_with_1(tmp_path: Path) -> None:
    result = run("tile", tmp_path / "nowhere.png", "-o", tmp_path / "tile.png")
    assert result.returncode == 1, result
    assert "nowhere.png" in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc for the worker thread")
def test_ctrl_c_exits_with_130_and_writes_nothing(tmp_path: Path) -> None:
    texforge.write_image(tmp_path / "photo.png", noise(1100, 1100))
    command = [str(SCRIPT), "tile", str(tmp_path / "photo.png"), "-o", str(tmp_path / "tile.png")]
    options = ["--size", "1024x1024", "--quality", "best", "--threads", "1"]
    with subprocess.Popen([*command, *options], stderr=subprocess.PIPE, text=True) as process:
        names = Path(f"/proc/{process.pid}/task")
        deadline = time.monotonic() + 30
        while not any(
            (task / "comm").read_text().startswith("texforge-") for task in names.iterdir()
        ):
            assert time.monotonic() < deadline
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert [p.name for p in tmp_path.iterdir()] == ["photo.png"]
