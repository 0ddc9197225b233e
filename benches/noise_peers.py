"""Noise side by side: texforge and FastNoiseSIMD (pyfastnoisesimd). See benches/README.md.

Time of calls, start-up left out (CPU time on one thread, wall time on more): ours in the program
`octaves`, theirs from Python, where a call of a million values hides the interpreter. Processes
alternate (A B C A B C ...). Counted are values of one octave: a picture of eight octaves has eight
to a pixel. Theirs needs an environment of its own, as it does not compile with numpy 2; it is made
in cargo's target directory.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import peers

if TYPE_CHECKING:
    from pathlib import Path

SIDE = 1024
OURS = {
    "texforge, picture of 8 octaves": "picture",
    "texforge, picture of 1 octave": "picture-1",
    "texforge, points of the plane": "plane",
    "texforge, points in space": "space",
}
THEIRS = {
    "FastNoiseSIMD, grid of simplex noise": "Simplex",
    "FastNoiseSIMD, grid of value noise": "Value",
    "FastNoiseSIMD, grid of Perlin noise": "Perlin",
    "FastNoiseSIMD, simplex noise at points in space": "points",
}


def help_theirs(what: str, threads: str, runs: str) -> None:
    """Print the number of values and the seconds of every run, as benches/octaves.rs does."""
    import warnings

    import numpy as np
    import pyfastnoisesimd as fns

    warnings.simplefilter("ignore", DeprecationWarning)
    noise = fns.Noise(seed=1, numWorkers=int(threads))
    noise.noiseType = getattr(fns.NoiseType, "Simplex" if what == "points" else what)
    noise.frequency = 0.05
    shape = (SIDE * SIDE,) if what == "points" else (SIDE, SIDE)
    points = fns.empty_coords(SIDE * SIDE)
    points[:3, : SIDE * SIDE] = np.random.default_rng(3).uniform(0, 42950, (3, SIDE * SIDE))
    values = np.zeros(0)
    now = time.process_time if threads == "1" else time.perf_counter
    seconds = []
    for _ in range(1 + int(runs)):
        start = now()
        values = noise.genFromCoords(points) if what == "points" else noise.genAsGrid(shape)
        seconds.append(now() - start)
        assert values.shape == shape
    assert np.isfinite(values).all()
    assert values.std() > 0.01
    print(SIDE * SIDE, seconds[1:])


def environment(folder: Path) -> str:
    """Return the interpreter of an environment with theirs; make it if it is not there."""
    python = str(folder / "bin" / "python")
    ready = folder / "ready"
    if not ready.exists():
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        install = [python, "-m", "pip", "install", "--quiet"]
        subprocess.run([*install, "numpy<2", "setuptools", "wheel"], check=True)
        command = [python, "-c", "import numpy; print(numpy.get_include())"]
        said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        flags = dict(os.environ, CFLAGS=f"-I{said.stdout.strip()}")
        command = [*install, "--no-build-isolation", "pyfastnoisesimd==0.4.2"]
        subprocess.run(command, check=True, env=flags)
        ready.touch()
    return python


def rates(command: list[str], threads: int, runs: int) -> list[float]:
    """Return million values of one octave a second, of every run of a process."""
    with peers.cores_for(threads):
        said = subprocess.run(
            [*command, str(threads), str(runs)], check=True, stdout=subprocess.PIPE, text=True
        )
    values, seconds = said.stdout.split(" ", 1)
    return [int(values) / 1e6 / s for s in json.loads(seconds)]


def table(commands: dict[str, list[str]], threads: int, rounds: int, runs: int) -> list[str]:
    """Measure in turns; return a Markdown table."""
    found: dict[str, list[float]] = {name: [] for name in commands}
    for _ in range(rounds):
        for name, command in commands.items():
            print(f"  {name} ...", file=sys.stderr, flush=True)
            found[name] += rates(command, threads, runs)
    grid = statistics.median(found["FastNoiseSIMD, grid of simplex noise"])
    points = statistics.median(found["FastNoiseSIMD, simplex noise at points in space"])
    plural = "thread" if threads == 1 else "threads"
    lines = [
        f"| {SIDE} x {SIDE}, {threads} {plural} | million values of one octave a second: median "
        "| most | over their simplex grid | over their simplex points |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for name, all_rates in found.items():
        median = statistics.median(all_rates)
        lines.append(
            f"| {name} | {median:.0f} | {max(all_rates):.0f} | {median / grid:.2f} "
            f"| {median / points:.2f} |"
        )
    return [*lines, ""]


def main() -> int:
    """Measure and print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="processes of each (default 5)")
    parser.add_argument("--runs", type=int, default=5, help="runs in a process (default 5)")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    args = parser.parse_args()
    cargo = os.environ.get("CARGO", "cargo")
    ours = peers.bench_program(cargo, "octaves")
    python = environment(peers.target_directory(cargo) / "noise-peers")
    theirs = [python, __file__, "--helper"]
    commands = {name: [ours, what] for name, what in OURS.items()}
    commands |= {name: [*theirs, what] for name, what in THEIRS.items()}
    _, about = peers.machine()
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    lines = [f"Machine: {about}; load before: {load}; commit {peers.revision()}.", ""]
    for threads in args.threads:
        print(f"{threads} threads", file=sys.stderr)
        lines += table(commands, threads, args.rounds, args.runs)
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--helper"]:
        help_theirs(*sys.argv[2:])
        sys.exit(0)
    sys.exit(main())
