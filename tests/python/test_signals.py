"""Progress, Ctrl-C, threads, processes: nothing else stops while the core works."""

from __future__ import annotations

import _thread
import concurrent.futures
import functools
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import texforge
from tqdm import tqdm

from .conftest import QUICK, noise

LONG: dict[str, Any] = {"size": 1024, "quality": "best", "threads": 1}
"""Settings with which a tile takes far longer than any of these tests may."""


def long_photo() -> npt.NDArray[np.uint8]:
    return noise(1100, 1100)


def test_progress_rises_from_0_to_1_on_the_callers_thread() -> None:
    calls: list[float] = []
    threads = set()

    def progress(fraction: float) -> None:
        calls.append(fraction)
        threads.add(threading.get_ident())

    texforge.tile(noise(120, 120), size=96, progress=progress)
    assert calls[0] == 0.0
    assert calls[-1] == 1.0
    assert calls == sorted(set(calls))
    assert threads == {threading.get_ident()}


def test_progress_is_told_between_start_and_end() -> None:
    calls: list[float] = []

    def progress(fraction: float) -> bool:
        calls.append(fraction)
        return len(calls) < 4

    with pytest.raises(texforge.Cancelled):
        texforge.tile(long_photo(), progress=progress, **LONG)
    assert len(calls) == 4
    assert 0 < calls[1] < calls[3] < 1


def test_an_exception_in_the_callback_passes_through() -> None:
    class Own(Exception):
        pass

    error = Own("mine")

    def progress(fraction: float) -> None:
        if fraction > 0:
            raise error

    with pytest.raises(Own) as caught:
        texforge.tile(long_photo(), progress=progress, **LONG)
    assert caught.value is error


def test_returning_false_cancels_at_once(photo: npt.NDArray[np.uint8]) -> None:
    with pytest.raises(texforge.Cancelled) as caught:
        texforge.tile(photo, progress=lambda _: False, **QUICK)
    assert caught.value.kind == "cancelled"
    # Other things that are false do not.
    texforge.tile(photo, progress=lambda _: 0, **QUICK)
    texforge.tile(photo, progress=lambda _: None, **QUICK)


def test_bars_are_moved_to_their_total(photo: npt.NDArray[np.uint8]) -> None:
    with open(os.devnull, "w", encoding="utf-8") as nowhere:  # noqa: PTH123 (a device)
        with tqdm(total=50, file=nowhere) as bar:
            texforge.tile(photo, progress=bar, **QUICK)
            assert bar.n == pytest.approx(50)
        with tqdm(file=nowhere) as bar:
            texforge.tile(photo, progress=bar, **QUICK)
            assert bar.n == pytest.approx(1)


def test_progress_true_shows_tqdm(
    photo: npt.NDArray[np.uint8], capsys: pytest.CaptureFixture[str]
) -> None:
    texforge.tile(photo, progress=True, **QUICK)
    assert "texforge 100%" in capsys.readouterr().err
    texforge.tile(photo, progress=False, **QUICK)
    assert capsys.readouterr().err == ""


def test_progress_true_without_tqdm(
    photo: npt.NDArray[np.uint8], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with pytest.raises(texforge.ParameterError, match="tqdm"):
        texforge.tile(photo, progress=True, **QUICK)


@pytest.mark.parametrize("send", ["interrupt_main", "kill"])
def test_ctrl_c_raises_keyboard_interrupt(send: str) -> None:
    interrupt = {
        "interrupt_main": _thread.interrupt_main,
        "kill": lambda: os.kill(os.getpid(), signal.SIGINT),
    }[send]
    timer = threading.Timer(0.3, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        texforge.tile(long_photo(), **LONG)
    timer.join()
    # All is as before.
    assert texforge.tile(noise(), **QUICK).image.shape == (24, 32, 3)


@pytest.mark.skipif(os.name == "nt", reason="SIGINT cannot be sent to one process")
def test_a_script_stops_on_sigint() -> None:
    script = (
        "import numpy as np, texforge\n"
        "photo = np.random.default_rng(0).integers(0, 256, (1100, 1100, 3), dtype=np.uint8)\n"
        "texforge.tile(photo, size=1024, quality='best', threads=1,\n"
        "              progress=lambda f: print('started', flush=True) if f == 0 else None)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "started\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in err
    assert process.returncode == -signal.SIGINT


def test_other_threads_run_meanwhile() -> None:
    counts: list[int] = [0]
    done = threading.Event()

    def count() -> None:
        while not done.is_set():
            counts[0] += 1
            time.sleep(0)

    seen: list[int] = []

    def progress(_: float) -> bool:
        seen.append(counts[0])
        return len(seen) < 10

    thread = threading.Thread(target=count)
    thread.start()
    try:
        with pytest.raises(texforge.Cancelled):
            texforge.tile(long_photo(), progress=progress, **LONG)
    finally:
        done.set()
        thread.join()
    assert len(set(seen)) > 5


def test_many_threads_at_once(photo: npt.NDArray[np.uint8]) -> None:
    expected = [texforge.tile(photo, seed=seed, **QUICK).image for seed in range(6)]
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        tiles = pool.map(lambda seed: texforge.tile(photo, seed=seed, threads=2, **QUICK), range(6))
        for tile, image in zip(tiles, expected, strict=True):
            assert np.array_equal(tile.image, image)


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork.*:DeprecationWarning")
def test_processes(method: str) -> None:
    # Only what the package itself holds: a started process does not have this file.
    job = functools.partial(texforge.tile, noise(), **QUICK)
    expected = job().image
    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        tiles = [pool.submit(job) for _ in range(2)]
        assert all(np.array_equal(tile.result().image, expected) for tile in tiles)
        with pytest.raises(texforge.ParameterError, match="patch"):
            pool.submit(texforge.tile, noise(), patch=99).result()
