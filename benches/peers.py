"""Whole programs side by side: texforge, G'MIC, texture-synthesis. See benches/README.md.

Runs alternate (A B C A B C ...), each on one core with one thread unless stated. What is compared
is CPU time (user + system) of the process, which other work on the machine disturbs least.

This process loads no numpy, so that it stays small: on Linux a child's peak memory is at least
its parent's size. Pictures are made, and fields compared, in processes of their own.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parent.parent
RECORDS = ROOT / "benches" / "record"
README = ROOT / "benches" / "README.md"
BEGIN, END = "<!-- peers: begin -->", "<!-- peers: end -->"
MIB = 1024.0


@dataclass
class Run:
    """What one process took."""

    cpu: float
    wall: float
    peak_mib: float


@dataclass
class Contender:
    """A command line and its runs."""

    name: str
    command: list[str]
    out: Path | None = None
    threads: int = 1
    runs: list[Run] = field(default_factory=list)
    problem: str = ""

    def times(self, what: str) -> list[float]:
        """Return one number of each run."""
        return [getattr(run, what) for run in self.runs]

    def median(self, what: str) -> float:
        """Return the median over the runs."""
        return statistics.median(self.times(what))

    def least(self, what: str) -> float:
        """Return the least over the runs."""
        return min(self.times(what))


@contextmanager
def cores_for(threads: int) -> Iterator[None]:
    """Let processes that are started meanwhile have one core if they have one thread."""
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    if threads == 1 and cores:
        os.sched_setaffinity(0, cores[-1:])  # Inherited by the child.
    try:
        yield
    finally:
        if threads == 1 and cores:
            os.sched_setaffinity(0, cores)


def measure(contender: Contender) -> None:
    """Run the command once; one thread means one core."""
    if contender.out:
        contender.out.unlink(missing_ok=True)
    environment = dict(os.environ, OMP_NUM_THREADS=str(contender.threads))
    with cores_for(contender.threads):
        start = time.perf_counter()
        process = subprocess.Popen(
            contender.command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            env=environment,
        )
        assert process.stderr
        said = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        process.stderr.close()
    if process.returncode != 0 or (contender.out and not contender.out.exists()):
        last = said.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
        contender.problem = f"exit status {process.returncode}: {last[0][:120]}"
        return
    # Kilobytes on Linux, bytes on macOS.
    unit = MIB if sys.platform != "darwin" else MIB * MIB
    cpu = usage.ru_utime + usage.ru_stime
    contender.runs.append(Run(cpu, wall, usage.ru_maxrss / unit))


def alternate(contenders: list[Contender], n: int, budget: float) -> None:
    """Run each `n` times, in turns; one that has spent `budget` seconds is not run again."""
    for _ in range(n):
        for contender in contenders:
            if not contender.problem and sum(contender.times("wall")) <= budget:
                print(f"  {contender.name} ...", file=sys.stderr, flush=True)
                measure(contender)


def table(contenders: list[Contender], what: str) -> list[str]:
    """Return a Markdown table; ratios are to the first contender, of medians of CPU time."""
    first = contenders[0]
    lines = [
        f"| {what} | CPU s: median | least | ratio | wall s: median | least | peak MiB | runs |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for c in contenders:
        if not c.runs:
            lines.append(f"| {c.name} | failed: {c.problem} | | | | | | |")
            continue
        ratio = c.median("cpu") / first.median("cpu") if first.runs else float("nan")
        lines.append(
            f"| {c.name} | {c.median('cpu'):.2f} | {c.least('cpu'):.2f} | {ratio:.1f} "
            f"| {c.median('wall'):.2f} | {c.least('wall'):.2f} | {c.median('peak_mib'):.0f} "
            f"| {len(c.runs)} |"
        )
    return [*lines, ""]


# --- The machine -----------------------------------------------------------------------------


def machine() -> tuple[str, str]:
    """Return a short name of the machine for file names, and a sentence about it."""
    model, flags, text = platform.machine(), "", ""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        text = cpuinfo.read_text()
        if found := re.search(r"^model name\s*: (.*)$", text, re.MULTILINE):
            model = found[1].strip()
        if found := re.search(r"^flags\s*: (.*)$", text, re.MULTILINE):
            flags = found[1]
    numbers = [
        f"{label} {found[1]}"
        for label in ("cpu family", "model")
        if (found := re.search(rf"^{label}\s*: (\d+)$", text, re.MULTILINE))
    ]
    levels = [
        ("avx512_vnni", "AVX-512 VNNI"),
        ("avx512bw", "AVX-512 BW"),
        ("avx2", "AVX2"),
    ]
    level = next((name for flag, name in levels if flag in flags.split()), "no AVX2")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    slug = re.sub(r"[^a-z0-9]+", "-", model.lower()).strip("-")[:40]
    about = f"{model}{' (' + ', '.join(numbers) + ')' if numbers else ''}, {cores} cores, {level}"
    return f"{slug}-{cores}", about


def version(command: list[str], pattern: str) -> str:
    """Return the version that a program says it has."""
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    found = re.search(pattern, said.stdout + said.stderr)
    return found[1] if found else "unknown version"


# --- Pictures and fields (in processes of their own) -----------------------------------------


def helper(*arguments: object) -> str:
    """Call this script in another process, with numpy."""
    command = [sys.executable, __file__, "--helper", *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def help_photo(side: str, seed: str, out: str) -> None:
    """Write scikit-image's gravel at another size, tinted along a fixed ramp of colours."""
    import numpy as np
    import skimage.data
    from PIL import Image

    height, width = (int(n) for n in side.split("x"))
    grey = Image.fromarray(skimage.data.gravel())  # type: ignore[no-untyped-call]
    if max(height, width) > 1024:  # More of it, not larger: a mosaic of mirror images.
        pixels = np.asarray(grey.resize((1024, 1024), Image.Resampling.LANCZOS))
        pixels = np.concatenate([pixels, pixels[:, ::-1]], 1)
        pixels = np.concatenate([pixels, pixels[::-1]], 0)
        pixels = np.tile(pixels, (-(-height // 2048), -(-width // 2048), 1)[:2])
        value = pixels[:height, :width].astype(np.float32)
    else:
        box = (0, 0, min(512, 2 * width), min(512, 2 * height))
        part = grey.crop(box).resize((width, height), Image.Resampling.LANCZOS)
        value = np.asarray(part).astype(np.float32)
    # What a camera adds: grain, and light that is not even.
    random = np.random.default_rng(int(seed))
    value += random.standard_normal(value.shape, dtype=np.float32) * 2.0
    value += 12.0 * np.cos(np.linspace(0, 4, width, dtype=np.float32))[None, :]
    ramp_at = [0, 70, 140, 200, 255]
    ramp = np.array(
        [[14, 16, 24], [70, 58, 52], [138, 128, 104], [206, 190, 150], [252, 250, 244]], np.float32
    )
    image = np.empty((height, width, 3), np.uint8)
    for k in range(3):
        image[..., k] = np.interp(np.clip(value, 0, 255), ramp_at, ramp[:, k]).round()
    Image.fromarray(image).save(out, quality=92)


def help_crop(photo: str, side: str, out: str) -> None:
    """Write a photo of the user's, cut and scaled to a square."""
    from PIL import Image, ImageOps

    image = Image.open(photo).convert("RGB")
    n = int(side)
    ImageOps.fit(image, (n, n), Image.Resampling.LANCZOS).save(out)


def help_pair(photo: str, target: str, source: str) -> None:
    """Write the left and right half of a photo, as pictures and as raw RGB; print their size."""
    from PIL import Image

    image = Image.open(photo).convert("RGB")
    side = min(image.width // 2, image.height, 512)
    for k, out in enumerate((target, source)):
        half = image.crop((k * side, 0, (k + 1) * side, side))
        half.save(out)
        Path(out).with_suffix(".rgb").write_bytes(half.tobytes())
    print(side)


def help_field_error(target: str, source: str, found: str) -> None:
    """Print the error of a field: root mean square difference per channel, 0..255."""
    import numpy as np
    from PIL import Image

    n = 11
    a, b = (np.asarray(Image.open(p).convert("RGB")).astype(np.int32) for p in (target, source))
    height, width = a.shape[0] - n + 1, a.shape[1] - n + 1
    score = None
    if found.endswith(".cimg"):
        header, size, data = Path(found).read_bytes().split(b"\n", 2)
        assert header.startswith(b"1 float little_endian"), header
        assert b"#" not in size, "the field was written compressed"
        w, h, _, c = (int(v) for v in size.split())
        planes = np.frombuffer(data, "<f4", w * h * c).reshape(c, h, w)
        inner = planes[:, n // 2 : n // 2 + height, n // 2 : n // 2 + width]
        x, y = inner[0].astype(int) - n // 2, inner[1].astype(int) - n // 2
        score = inner[2]
    else:
        yx = np.fromfile(found, "<u2").reshape(height, width, 2).astype(int)
        y, x = yx[..., 0], yx[..., 1]
    y = np.clip(y, 0, b.shape[0] - n)
    x = np.clip(x, 0, b.shape[1] - n)
    total = np.zeros((height, width), np.int64)
    for dy in range(n):
        for dx in range(n):
            difference = a[dy : dy + height, dx : dx + width] - b[y + dy, x + dx]
            total += (difference * difference).sum(-1)
    agree = None if score is None else float(np.mean(np.abs(total - score) < 1.0))
    rms = float(np.sqrt(total.mean() / (n * n * 3)))
    print(json.dumps({"rms": rms, "agree": agree}))


# --- Parts of the report -----------------------------------------------------------------------


def tile_command(texforge: str, photo: Path, size: str, out: Path, threads: int) -> list[str]:
    """Return our command line."""
    sizes = ["--size", size, "--threads", str(threads)]
    return [texforge, "tile", str(photo), "-o", str(out), *sizes, "--quiet", "--no-maps", "--force"]


def tiles(args: argparse.Namespace, photo: Path, name: str, side: int, work: Path) -> list[str]:
    """Compare tiles of the photo's own size."""
    size, out = f"{side}x{side}", work / "out.png"
    ours = tile_command(args.texforge, photo, size, out, 1)
    contenders = [Contender("texforge tile", ours, out)]
    if args.draft:
        contenders.append(Contender("texforge tile, draft", [*ours, "--quality", "draft"], out))
    if args.gmic:
        filter_ = [args.gmic, "-v", "-", str(photo), "fx_frame_seamless", "32,9,0,0,0"]
        contenders.append(Contender("G'MIC fx_frame_seamless", [*filter_, "-o", str(out)], out))
    if args.texture_synthesis:
        command = [args.texture_synthesis, "--tiling", "--no-progress", "--threads", "1"]
        command += ["--out-size", str(side), "--out", str(out), "generate", str(photo)]
        contenders.append(Contender("texture-synthesis --tiling", command, out))
    alternate(contenders, args.runs, args.budget)
    return table(contenders, f"{name}, {size}, one thread")


def scaling(args: argparse.Namespace, photos: dict[int, Path], work: Path) -> list[str]:
    """Compare one thread with two by wall time."""
    lines = [
        "| our wall s, threads | 1: median | least | 2: median | least | ratio: medians | leasts |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for side, photo in photos.items():
        size, out = f"{side}x{side}", work / "out.png"
        one, two = (
            Contender(f"{n} threads", tile_command(args.texforge, photo, size, out, n), out, n)
            for n in (1, 2)
        )
        alternate([one, two], args.runs, args.budget)
        if one.runs and two.runs:
            cells = [
                c.median("wall") if k == 0 else c.least("wall") for c in (one, two) for k in (0, 1)
            ]
            medians, leasts = cells[0] / cells[2], cells[1] / cells[3]
            numbers = " | ".join(f"{cell:.2f}" for cell in cells)
            lines.append(f"| {size} | {numbers} | {medians:.2f} | {leasts:.2f} |")
    return [*lines, ""]


def startup(args: argparse.Namespace, photo: Path, work: Path) -> list[str]:
    """Compare a whole small tile of ours with a start of G'MIC."""
    out = work / "out.png"
    ours = tile_command(args.texforge, photo, "256x256", out, 0)
    contenders = [
        Contender("texforge tile, 256x256, all cores", ours, out, threads=2),
        Contender("texforge --version", [args.texforge, "--version"], threads=2),
    ]
    if args.gmic:
        nothing = [args.gmic, "-v", "-", str(photo), "-o", str(out)]
        contenders.append(Contender("G'MIC: read and write, no filter", nothing, out, threads=2))
    alternate(contenders, args.runs, args.budget)
    return table(contenders, "start-up")


def fields(args: argparse.Namespace, work: Path) -> list[str]:
    """Compare nearest-neighbour fields: error and CPU time, start-up subtracted."""
    photo, target, source = work / "pair.png", work / "target.png", work / "source.png"
    if args.photo:
        shutil.copy(args.photo[0], photo)
    else:
        helper("photo", "512x1024", 1, photo)
    side = helper("pair", photo, target, source).strip()
    raw = [str(p.with_suffix(".rgb")) for p in (target, source)]

    def ours(passes: int, n_random: int) -> Contender:
        out = work / f"field-{passes}-{n_random}.bin"
        command = [args.field, *raw, side, side, str(passes), str(n_random), str(out)]
        return Contender(f"texforge, {passes} passes, {n_random} random", command, out)

    def gmic(passes: int, n_random: int) -> Contender:
        out = work / f"field-{passes}-{n_random}.cimg"
        search = ["matchpatch..", f"[-1],11,11,1,{passes},{n_random},0,1", "keep.."]
        command = [args.gmic, "-v", "-", str(target), str(source), *search, "-o", f"{out},float"]
        return Contender(f"G'MIC matchpatch, {passes} passes, {n_random} random", command, out)

    empty, contenders = [ours(0, 8)], [ours(*n) for n in ((2, 8), (3, 8), (5, 4), (5, 8), (8, 8))]
    if args.gmic:
        empty.append(gmic(0, 5))
        contenders += [gmic(5, 5), gmic(5, 8)]
    alternate(empty + contenders, args.runs, args.budget)
    lines = [
        f"| nearest-neighbour field, {side}x{side}, 11x11, one thread "
        "| rms error a channel (0..255) | CPU s less start-up: median | least | peak MiB |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for c in contenders:
        start = empty[0] if c.name.startswith("texforge") else empty[1]
        if not c.runs or not start.runs:
            lines.append(f"| {c.name} | failed: {c.problem or start.problem} | | | |")
            continue
        result = json.loads(helper("field_error", target, source, c.out))
        if result["agree"] is not None and result["agree"] < 0.99:
            print(f"  {c.name}: its scores agree at {result['agree']:.0%} only", file=sys.stderr)
        base = start.median("cpu")
        lines.append(
            f"| {c.name} | {result['rms']:.2f} | {c.median('cpu') - base:.2f} "
            f"| {c.least('cpu') - base:.2f} | {c.median('peak_mib'):.0f} |"
        )
    return [*lines, ""]


def large(args: argparse.Namespace, work: Path) -> list[str]:
    """Measure a 4096 x 4096 tile from 24 megapixels."""
    photo, out = work / "large.jpg", work / "large.png"
    helper("photo", "4000x6000", 2, photo)
    contenders = []
    for threads in (2,):
        command = tile_command(args.texforge, photo, "4096x4096", out, threads)
        contenders.append(Contender(f"texforge tile, {threads} threads", command, out, threads))
    alternate(contenders, 1, args.budget)
    return table(contenders, "4096x4096 from 6000x4000")


def built(args: argparse.Namespace) -> None:
    """Find or build our programs."""
    cargo = os.environ.get("CARGO", "cargo")
    if args.texforge is None:
        subprocess.run(
            [cargo, "build", "--release", "--locked", "--bin", "texforge"], cwd=ROOT, check=True
        )
        args.texforge = str(target_directory(cargo) / "release" / "texforge")
    if args.fields and args.field is None:
        args.field = bench_program(cargo, "field")


def bench_program(cargo: str, name: str) -> str:
    """Build one of our small programs for a script; return where it is."""
    command = [cargo, "bench", "--locked", "--bench", name, "--no-run", "--message-format", "json"]
    said = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    messages = [json.loads(line) for line in said.stdout.splitlines() if line.startswith("{")]
    # The command is built, too.
    made = [m for m in messages if m.get("executable") and m["target"]["name"] == name]
    return str(made[-1]["executable"])


def target_directory(cargo: str) -> Path:
    """Return where cargo builds."""
    command = [cargo, "metadata", "--format-version", "1", "--no-deps", "--locked"]
    said = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return Path(json.loads(said.stdout)["target_directory"])


def revision() -> str:
    """Return the commit that is measured."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return said.stdout.strip() or "unknown"


def record(args: argparse.Namespace, slug: str, report: str) -> None:
    """Append to the machine's record of that day and renew the README's copy."""
    RECORDS.mkdir(exist_ok=True)
    file = RECORDS / f"{args.record}_{args.machine or slug}.md"
    before = file.read_text() + "\n" if file.exists() else ""
    file.write_text(before + report)
    text = README.read_text()
    head, rest = text.split(BEGIN, 1)
    _, tail = rest.split(END, 1)
    README.write_text(f"{head}{BEGIN}\n{report}{END}{tail}")
    print(f"recorded in {file.relative_to(ROOT)} and benches/README.md", file=sys.stderr)


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photo", nargs="*", help="photos; default: a tinted one from scikit-image")
    parser.add_argument("--sizes", type=int, nargs="+", default=[256, 512, 1024])
    parser.add_argument("--runs", type=int, default=5, help="runs of each program (default 5)")
    parser.add_argument(
        "--budget",
        type=float,
        default=90,
        help="seconds after which a slow program is not run again",
    )
    parser.add_argument("--no-fields", dest="fields", action="store_false")
    parser.add_argument("--no-scaling", dest="scaling", action="store_false")
    parser.add_argument("--draft", action="store_true", help="also our draft quality")
    parser.add_argument("--large", action="store_true", help="also 4096x4096 from 24 megapixels")
    parser.add_argument("--texforge", help="our program; default: build it")
    parser.add_argument("--field", help="the program of benches/field.rs; default: build it")
    parser.add_argument("--gmic", default=shutil.which("gmic"))
    parser.add_argument("--texture-synthesis", default=shutil.which("texture-synthesis"))
    parser.add_argument("--kernels", type=Path, help="a table of `make bench` for the record")
    parser.add_argument("--record", metavar="DATE", help="keep the report, under this date")
    parser.add_argument("--machine", metavar="NAME", help="name in the record; default: the CPU's")
    args = parser.parse_args()
    if args.record and not re.fullmatch(r"\d{4}-\d\d-\d\d", args.record):
        parser.error("--record takes a date as 2026-01-31")
    return args


def main() -> int:
    """Measure and print the report."""
    args = arguments()
    built(args)
    slug, about = machine()
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    lines = [f"### {args.record or 'Today'}, commit {revision()}", ""]
    lines += [f"Machine: {about}; load before: {load}."]
    programs = ["texforge " + version([args.texforge, "--version"], r"(\d+\.\d+\S*)")]
    if args.gmic:
        programs.append("G'MIC " + version([args.gmic, "version"], r"[Vv]ersion ([0-9.]+)"))
    if args.texture_synthesis:
        found = version([args.texture_synthesis, "--version"], r"(\d+\.\d+\S*)")
        programs.append(f"texture-synthesis {found}")
    lines += [f"Programs: {', '.join(programs)}."]
    missing = [
        n for n, p in (("gmic", args.gmic), ("texture-synthesis", args.texture_synthesis)) if not p
    ]
    if missing:
        lines += [f"Not installed, so not compared: {', '.join(missing)}."]
    lines += [""]
    with tempfile.TemporaryDirectory(prefix="texforge-peers-") as folder:
        work = Path(folder)
        first: dict[int, Path] = {}
        for photo in args.photo or [None]:
            for side in args.sizes:
                made = work / f"photo-{side}.png"
                if photo is None:
                    helper("photo", f"{side}x{side}", 0, made)
                else:
                    helper("crop", photo, side, made)
                name = "tinted gravel" if photo is None else Path(photo).name
                kept = work / f"first-{side}.png"
                if side not in first:
                    shutil.copy(made, kept)
                    first[side] = kept
                print(f"{name}, {side}", file=sys.stderr)
                lines += tiles(args, made, name, side, work)
        small = first.get(256) or next(iter(first.values()))
        print("start-up", file=sys.stderr)
        lines += startup(args, small, work)
        if args.scaling:
            print("threads", file=sys.stderr)
            if not args.photo:  # What start-up and files take shows less in a larger one.
                side = 2 * max(first)
                first[side] = work / f"first-{side}.png"
                helper("photo", f"{side}x{side}", 0, first[side])
            lines += scaling(args, first, work)
        if args.fields:
            print("fields", file=sys.stderr)
            lines += fields(args, work)
        if args.large:
            print("large", file=sys.stderr)
            lines += large(args, work)
    if args.kernels:
        lines += [args.kernels.read_text()]
    report = "\n".join(lines)
    print(report)
    if args.record:
        record(args, slug, report)
    return 0


HELPERS = {
    "photo": help_photo,
    "crop": help_crop,
    "pair": help_pair,
    "field_error": help_field_error,
}

if __name__ == "__main__":
    if sys.argv[1:2] == ["--helper"]:
        HELPERS[sys.argv[2]](*sys.argv[3:])
        sys.exit(0)
    sys.exit(main())
