"""`texforge.study` and ``texforge study``, as a whole, on two tiny photos."""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import texforge
from texforge import _texforge
from texforge._study import command, report, runs
from texforge._study.command import Line

if TYPE_CHECKING:
    from collections.abc import Callable

SCRIPT = Path(sysconfig.get_path("scripts")) / "texforge"
TINY: dict[str, Any] = {"seeds": 2, "size": 16, "samples": 30, "measures": ["histogram"]}
FLAGS = ["--seeds", "2", "--size", "16", "--samples", "30", "--measures", "histogram"]


def picture(seed: int, height: int = 44, width: int = 50) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return grain with a stain in one corner."""
    grain = np.random.default_rng(seed).integers(90, 160, (height, width, 3), dtype=np.uint8)
    grain[: height // 3, : width // 3] //= 2
    return grain


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a photo in it and one in a folder of it."""
    folder = tmp_path_factory.mktemp("photos")
    (folder / "inner").mkdir()
    (folder / ".hidden").mkdir()
    texforge.write_image(folder / "a.png", picture(1))
    texforge.write_image(folder / "inner" / "b.png", picture(2))
    texforge.write_image(folder / ".hidden" / "c.png", picture(3))
    (folder / "notes.txt").write_text("no picture")
    return folder


@pytest.fixture(scope="module")
def done(photos: Path, tmp_path_factory: pytest.TempPathFactory) -> texforge.Study:
    """Return a finished study of the two."""
    return texforge.study(photos, tmp_path_factory.mktemp("done") / "out", **TINY)


@pytest.fixture
def again(done: texforge.Study, tmp_path: Path) -> Path:
    """Return a copy of the finished study's folder."""
    return Path(shutil.copytree(done.out, tmp_path / "again"))


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def without_seconds(path: Path) -> list[dict[str, str]]:
    return [{name: v for name, v in row.items() if name != "seconds"} for row in table(path)]


def counting(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, int]]:
    """Note every run that is made."""
    made: list[tuple[str, str, int]] = []
    run = runs.Exemplar.run

    def noted(self: runs.Exemplar, variant: runs.Variant, seed: int, *rest: Any) -> Any:
        made.append((self.name, variant.name, seed))
        return run(self, variant, seed, *rest)

    monkeypatch.setattr(runs.Exemplar, "run", noted)
    return made


def test_every_row_is_what_tile_and_texture_cost_say(photos: Path, done: texforge.Study) -> None:
    rows, steps = table(done.out / "costs.csv"), table(done.out / "iterations.csv")
    expected, expected_steps, counts = [], [], []
    for name in ("a.png", "inner/b.png"):
        photo = texforge.read_image(photos / name)
        for method in ("stationary", "wrap-only"):
            for seed in (0, 1):
                tile = texforge.tile(photo, size=16, method=method, seed=seed, trace=True)
                text = texforge.texture_cost(tile, photo, samples=30, seed=seed)
                measure = "histogram" if method == "stationary" else "none"
                run = (name, method, measure, str(seed))
                values = (text.mean, text.margin, tile.costs.texture, tile.costs.stationarity)
                sizes = ("44", "50", "1", "16", "16", "0.1", "11", "30")
                expected.append((*run, *map(repr, values), *sizes, texforge.__version__))
                # So small a tile is one level: its iterations count on.
                n = len(tile.trace)
                assert [(s.iteration, s.level) for s in tile.trace] == [
                    (i, 0) for i in range(1, n + 1)
                ]
                counts.append(str(n))
                expected_steps += [
                    (*run, str(i), "0", *map(repr, (s.texture, s.stationarity)))
                    for i, s in enumerate(tile.trace, 1)
                ]
    run_columns = ("exemplar", "method", "measure", "seed")
    columns = (
        *run_columns, "c_text", "c_text_margin", "c_text_bound", "c_stat", "photo_height",
        "photo_width", "reduction", "height", "width", "sigma", "patch", "samples", "version",
    )  # fmt: skip
    assert [tuple(row[c] for c in columns) for row in rows] == expected
    for row in rows:
        assert float(row["total"]) == float(row["c_text"]) + float(row["c_stat"])
        assert 0 <= float(row["seconds"]) < 60
    assert [row["iterations"] for row in rows] == counts
    step_columns = (*run_columns, "iteration", "level", "c_text_bound", "c_stat")
    assert [tuple(step[c] for c in step_columns) for step in steps] == expected_steps
    for step in steps:
        total = float(step["c_text_bound"]) + float(step["c_stat"])
        assert float(step["total_bound"]) == total
    assert len({row["photo_sha256"] for row in rows}) == 2


def test_the_summary_is_what_the_rows_come_to(done: texforge.Study) -> None:
    def means(method: str, column: str) -> list[float]:
        values = [float(r[column]) for r in table(done.out / "costs.csv") if r["method"] == method]
        return [(values[0] + values[1]) / 2, (values[2] + values[3]) / 2]

    def variances(method: str) -> list[float]:
        values = [
            float(r["c_stat"]) for r in table(done.out / "costs.csv") if r["method"] == method
        ]
        return [(values[0] - values[1]) ** 2 / 2, (values[2] - values[3]) ** 2 / 2]

    summary = done.summary
    assert (summary["exemplars"], summary["seeds"], summary["runs"]) == (2, 2, 8)
    assert list(summary["ways"]) == ["wrap-only", "histogram"]
    ours, base = summary["ways"]["histogram"], summary["ways"]["wrap-only"]
    for column in ("c_text", "c_stat", "total"):
        mine, theirs = means("stationary", column), means("wrap-only", column)
        assert base[column]["value"] == pytest.approx(np.mean(theirs))
        assert ours[column]["value"] == pytest.approx(np.mean(mine))
        assert [ours[column]["low"], ours[column]["high"]] == pytest.approx(sorted(mine))
        ratios = [a / b for a, b in zip(mine, theirs, strict=True)]
        assert ours[f"{column}_over_baseline"]["value"] == pytest.approx(np.mean(ratios))
        assert f"{column}_over_baseline" not in base
    mine, theirs = variances("stationary"), variances("wrap-only")
    assert ours["c_stat_variance"]["value"] == pytest.approx(np.mean(mine))
    relative = [v**0.5 / m for v, m in zip(mine, means("stationary", "c_stat"), strict=True)]
    assert ours["c_stat_relative_deviation"]["value"] == pytest.approx(np.mean(relative))
    ratios = [b / a for a, b in zip(mine, theirs, strict=True)]
    assert ours["baseline_variance_over_c_stat_variance"]["value"] == pytest.approx(np.mean(ratios))
    both = ours["mean_baseline_variance_over_mean_c_stat_variance"]["value"]
    assert both == pytest.approx(sum(theirs) / sum(mine))
    text = (done.out / "summary.md").read_text()
    assert f"| histogram | {ours['c_text']['value']:.3g} (" in text
    assert "| inner/b.png |" in text
    assert done.rows[0]["c_text"] == means_of(done, "a.png", "wrap-only", 0)


def means_of(done: texforge.Study, exemplar: str, method: str, seed: int) -> float:
    for row in table(done.out / "costs.csv"):
        if (row["exemplar"], row["method"], row["seed"]) == (exemplar, method, str(seed)):
            return float(row["c_text"])
    raise AssertionError(exemplar)


def test_both_plots_are_pictures(done: texforge.Study) -> None:
    for name in ("fig3.png", "fig4.png"):
        plot = texforge.read_image(done.out / name)
        assert plot.shape[0] > 200
        assert plot.shape[1] > 300
        # Lines in both colours of the paper: orange and blue.
        for color in ((255, 127, 14), (31, 119, 180)):
            near = np.abs(np.asarray(plot, dtype=int)[:, :, :3] - color).max(axis=2) < 8
            assert near.sum() > 50, (name, color)


def test_only_what_is_missing_is_made(
    photos: Path, done: texforge.Study, again: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = counting(monkeypatch)
    texforge.study(photos, again, **TINY)
    assert made == []
    lines = (again / "costs.csv").read_text().splitlines(keepends=True)
    (again / "costs.csv").write_text("".join(lines[:1] + lines[2:8:2]))
    texforge.study(photos, again, **TINY)
    # Rows 1, 3, 5, 7 and 8 of exemplar, method, seed.
    assert sorted(made) == [
        ("a.png", "histogram", 0),
        ("a.png", "wrap-only", 0),
        ("inner/b.png", "histogram", 0),
        ("inner/b.png", "wrap-only", 0),
        ("inner/b.png", "wrap-only", 1),
    ]
    for name in ("costs.csv", "iterations.csv"):
        assert without_seconds(again / name) == without_seconds(done.out / name)
    for name in ("fig3.png", "fig4.png"):
        assert (again / name).read_bytes() == (done.out / name).read_bytes()


@pytest.mark.parametrize("file", ["costs.csv", "iterations.csv"])
@pytest.mark.parametrize("cut", [3, 40])
def test_a_line_that_was_cut_off_is_made_again(
    photos: Path,
    done: texforge.Study,
    again: Path,
    monkeypatch: pytest.MonkeyPatch,
    file: str,
    cut: int,
) -> None:
    whole = (again / file).read_bytes()
    (again / file).write_bytes(whole[:-cut])
    made = counting(monkeypatch)
    texforge.study(photos, again, **TINY)
    assert made == [("inner/b.png", "wrap-only", 1)]
    assert without_seconds(again / file) == without_seconds(done.out / file)


def test_more_seeds_are_added_and_fewer_leave_the_rest(
    photos: Path, again: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = counting(monkeypatch)
    more = texforge.study(photos, again, **{**TINY, "seeds": 3})
    assert {seed for _, _, seed in made} == {2}
    assert more.summary["runs"] == 12
    fewer = texforge.study(photos, again, **{**TINY, "seeds": 1})
    assert fewer.summary["runs"] == 4
    assert "c_stat_variance" not in fewer.summary["ways"]["histogram"]
    assert len(table(again / "costs.csv")) == 12
    assert len(made) == 4


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"size": 20}, "with size 16, and this study has 20"),
        ({"samples": 31}, "with samples 30, and this study has 31"),
    ],
)
def test_another_setting_is_told(
    photos: Path, again: Path, change: dict[str, Any], sentence: str
) -> None:
    before = {path.name: path.read_bytes() for path in again.iterdir()}
    with pytest.raises(texforge.OutputExistsError, match=sentence):
        texforge.study(photos, again, **{**TINY, **change})
    assert {path.name: path.read_bytes() for path in again.iterdir()} == before


def test_another_version_or_photo_is_told(photos: Path, again: Path, tmp_path: Path) -> None:
    others = Path(shutil.copytree(photos, tmp_path / "others"))
    texforge.write_image(others / "a.png", picture(9), overwrite=True)
    with pytest.raises(texforge.OutputExistsError, match=r"runs of a\.png with photo "):
        texforge.study(others, again, **TINY)
    text = (again / "costs.csv").read_text()
    (again / "costs.csv").write_text(text.replace(f",{texforge.__version__}\n", ",0.0.1\n"))
    with pytest.raises(texforge.OutputExistsError, match=r"with version 0\.0\.1, and this"):
        texforge.study(photos, again, **TINY)


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "no line"])
def test_a_file_of_somebody_else_is_left_alone(photos: Path, tmp_path: Path, text: str) -> None:
    (tmp_path / "costs.csv").write_text(text)
    with pytest.raises(texforge.OutputExistsError, match="is not a table of"):
        texforge.study(photos, tmp_path, **TINY)
    assert (tmp_path / "costs.csv").read_text() == text


def test_a_line_of_somebody_else_is_told(photos: Path, again: Path) -> None:
    with (again / "costs.csv").open("a") as file:
        file.write("1,2,3\n")
    with pytest.raises(texforge.OutputExistsError, match="did not write: 1,2,3"):
        texforge.study(photos, again, **TINY)


def test_a_damaged_photo_is_skipped_and_named(
    photos: Path, done: texforge.Study, again: Path
) -> None:
    folder = Path(shutil.copytree(photos, again.parent / "with damage"))
    (folder / "damaged.png").write_bytes((folder / "a.png").read_bytes()[:200])
    texforge.write_image(folder / "tiny.png", picture(4, 8, 9))
    result = texforge.study(folder, again, **TINY)
    assert list(result.skipped) == ["damaged.png", "tiny.png"]
    assert "damaged.png" in result.skipped["damaged.png"]
    assert result.summary["exemplars"] == done.summary["exemplars"]
    assert result.summary["skipped"] == result.skipped
    assert "- tiny.png: the photo is 9x8" in (again / "summary.md").read_text()


def test_large_photos_are_made_smaller(tmp_path: Path) -> None:
    large = picture(5, 100, 130)
    blocks = large.reshape(50, 2, 65, 2, 3).mean(axis=(1, 3))
    texforge.write_image(tmp_path / "large.png", large)
    settings = runs.Settings(size=11, samples=10, threads=1, version="")
    read = runs.Exemplar.read(tmp_path, "large.png", "", settings)
    assert read.reduction == 2
    assert read.photo.dtype == np.uint8
    assert np.array_equal(read.photo, np.rint(blocks).astype(np.uint8))
    settings = runs.Settings(size=17, samples=10, threads=1, version="")
    assert runs.Exemplar.read(tmp_path, "large.png", "", settings).reduction == 1


def test_nothing_to_study_is_told(photos: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    out = tmp_path / "out"
    with pytest.raises(texforge.FileError, match="does not exist"):
        texforge.study(tmp_path / "nowhere", out)
    with pytest.raises(texforge.FileError, match="is no folder"):
        texforge.study(tmp_path / "file", out)
    with pytest.raises(texforge.PictureError, match="there is no picture"):
        texforge.study(tmp_path / "empty", out)
    with pytest.raises(texforge.ParameterError, match="another folder than the photos'"):
        texforge.study(photos, photos)
    assert not out.exists()
    with pytest.raises(texforge.FileError, match="cannot make the folder"):
        texforge.study(photos, tmp_path / "file")
    (tmp_path / "empty" / "x.png").write_bytes(b"no picture")
    with pytest.raises(texforge.PictureError, match=r"none of the pictures .* x\.png"):
        texforge.study(tmp_path / "empty", out)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"seeds": 0}, "`seeds` must be"),
        ({"size": 10}, "`size` must be"),
        ({"samples": 1}, "`samples` must be"),
        ({"threads": -1}, "`threads` must be"),
        ({"measures": ["wavelets"]}, "`measures` must be some of histogram.*'wavelets'"),
        ({"measures": ["none"]}, "`measures` must be some of"),
        ({"measures": []}, "got none"),
    ],
)
def test_wrong_arguments_are_named(
    photos: Path, tmp_path: Path, wrong: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(texforge.ParameterError, match=sentence):
        texforge.study(photos, tmp_path / "out", **wrong)
    assert not (tmp_path / "out").exists()


def test_every_measure_of_the_core_is_studied() -> None:
    choices = {p["name"]: p["choices"] for p in _texforge.schema()}["measure"]
    names = {variant.measure.rsplit("-", 1)[0] for variant in runs.variants(None)}
    assert names == set(choices) - {"none"}
    assert all(v.method == "stationary" for v in runs.variants(None))
    assert runs.variants(["histogram"]) == runs.variants("histogram")


def test_an_order_is_studied_value_by_value(monkeypatch: pytest.MonkeyPatch) -> None:
    measure = {"name": "measure", "choices": ["histogram", "moments", "none"], "range": ""}
    order = {"name": "order", "choices": [], "range": "1 to 3"}
    monkeypatch.setattr(_texforge, "schema", lambda: [measure, order])
    found = runs.variants(None)
    assert [v.name for v in found] == ["histogram", "moments-1", "moments-2", "moments-3"]
    assert found[-1].options == (("method", "stationary"), ("measure", "moments"), ("order", 3))
    assert [v.name for v in runs.variants(["moments"])] == ["moments-1", "moments-2", "moments-3"]
    assert [v.name for v in runs.variants(["moments-2"])] == ["moments-2"]


def test_progress_is_of_what_is_missing_and_can_cancel(photos: Path, again: Path) -> None:
    seen: list[float] = []
    lines = (again / "costs.csv").read_text().splitlines(keepends=True)
    (again / "costs.csv").write_text("".join(lines[:-2]))
    stop_at = 0.51

    def stop(fraction: float) -> bool:
        seen.append(fraction)
        return fraction < stop_at

    with pytest.raises(texforge.Cancelled):
        texforge.study(photos, again, progress=stop, **TINY)
    assert seen[0] == 0.0
    assert seen == sorted(seen)
    # The first of the two missing runs is kept.
    assert len(table(again / "costs.csv")) == len(lines) - 2
    seen.clear()
    texforge.study(photos, again, progress=seen.append, **TINY)
    assert seen[-1] == 1.0


@pytest.mark.parametrize(("asked", "used"), [(None, 0), (1, 1), (3, 3)])
def test_threads_are_as_many_as_asked_for(
    photos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: int | None, used: int
) -> None:
    seen: list[object] = []
    for name in ("tile", "texture_cost"):
        function: Callable[..., Any] = getattr(runs, name)

        def noted(*args: Any, function: Callable[..., Any] = function, **options: Any) -> Any:
            seen.append(options["threads"])
            return function(*args, **options)

        monkeypatch.setattr(runs, name, noted)
    texforge.study(photos, tmp_path / "out", threads=asked, **{**TINY, "seeds": 1})
    assert seen == [used] * 8


def test_the_bootstrap_covers_what_it_says() -> None:
    def mean(draws: Any) -> Any:
        return draws.mean(axis=1)

    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(100):
        _, low, high = report.bootstrap(rng.normal(3, 1, 40), mean)
        inside += low <= 3 <= high
    # 95 expected, a little fewer with 40 values.
    assert 86 <= inside <= 99
    assert report.bootstrap(np.array([2.0, 2.0]), mean) == (2, 2, 2)


def test_traces_of_different_lengths_go_on_with_their_last_value() -> None:
    def steps(n: int) -> list[dict[str, Any]]:
        return [{"total_bound": 10.0 * n + i, "level": n - i} for i in range(1, n + 1)]

    variants = [runs.BASELINE]
    rows = [
        {"exemplar": name, "method": "wrap-only", "measure": "none", "seed": 0} for name in "abc"
    ]
    keys = {name: (name, "wrap-only", "none", 0) for name in "ab"}
    data = report.Data(
        rows[:2], {keys["a"]: steps(2), keys["b"]: steps(3)}, ["a", "b", "c"], variants, range(1)
    )
    assert data.exemplars == ["a", "b"]
    assert data.traces("total_bound").tolist() == [[[[21, 22, 22]], [[31, 32, 33]]]]
    assert data.levels() == [2, 1, 0]


# The command.


def run(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    program = [str(SCRIPT), "study", *map(str, arguments)]
    return subprocess.run(
        program, capture_output=True, text=True, check=False, timeout=100, **options
    )


def test_the_command_does_what_the_function_does(
    photos: Path, done: texforge.Study, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = run(photos, "-o", out, *FLAGS, "--threads", "1", "--json")
    assert result.returncode == 0, result.stderr
    assert without_seconds(out / "costs.csv") == without_seconds(done.out / "costs.csv")
    assert {p.name for p in out.iterdir()} == {p.name for p in done.out.iterdir()}
    summary = json.loads(result.stdout)
    for way in summary["ways"].values():
        assert way.pop("seconds") >= 0
    expected = json.loads(json.dumps(done.summary))
    for way in expected["ways"].values():
        del way["seconds"]
    assert summary == expected
    # In a pipe no progress, only where to look.
    assert len(result.stderr.splitlines()) == 1
    assert "8 runs over 2 photos" in result.stderr
    quiet = run(photos, "-o", out, *FLAGS, "-q")
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")


def test_every_flag_arrives_at_the_function(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {}

    def noted(**options: Any) -> None:
        asked.update(options)
        raise texforge.Cancelled("enough")

    monkeypatch.setattr(command, "study", noted)
    flags = ["--seeds", "3", "--size", "64", "--samples", "9", "--threads", "2", "--json", "-q"]
    arguments = ["texforge", "study", "in", "-o", "out", *flags, "--measures", "a,b"]
    assert command.main(arguments) == 1
    assert {**asked, "folder": str(asked["folder"]), "out": str(asked["out"])} == {
        "folder": "in", "out": "out", "seeds": 3, "size": 64, "samples": 9, "threads": 2,
        "measures": ["a", "b"], "progress": None,
    }  # fmt: skip


def test_the_command_lists_study_and_refuses_what_is_wrong(photos: Path, tmp_path: Path) -> None:
    listed = subprocess.run([str(SCRIPT), "--help"], capture_output=True, text=True, check=True)
    assert "\n  study " in listed.stdout
    assert run("--help").returncode == 0
    out = tmp_path / "out"
    for flags, status, said in [
        (["--seeds", "0"], 2, "--seeds"),
        (["--seeds", "-1"], 2, "-1"),
        (["--size", "2"], 2, "--size"),
        (["--measures", "wavelets"], 2, "`measures` must be some of"),
        (["--no-such-flag"], 2, "--no-such-flag"),
    ]:
        result = run(photos, "-o", out, *flags)
        assert result.returncode == status, result.stderr
        assert said in result.stderr
        assert "Traceback" not in result.stderr
    missing = run(tmp_path / "nowhere", "-o", out)
    assert missing.returncode == 1
    assert len(missing.stderr.splitlines()) == 1
    assert not out.exists()


def test_the_command_names_what_it_skips(photos: Path, done: texforge.Study, again: Path) -> None:
    folder = Path(shutil.copytree(photos, again.parent / "with damage"))
    (folder / "z.jpg").write_bytes(b"\xff\xd8\xff no more")
    result = run(folder, "-o", again, *FLAGS)
    assert result.returncode == 1
    assert result.stderr.startswith("texforge: skipped z.jpg: ")
    assert len(result.stderr.splitlines()) == 2
    assert len(table(again / "costs.csv")) == len(done.rows)


def test_without_matplotlib_one_sentence_before_anything(photos: Path, tmp_path: Path) -> None:
    # A module that is not to be found: what `find_spec` says of one that is None.
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda name, *a: None if name == 'matplotlib' else find(name, *a)\n"
    )
    out = tmp_path / "out"
    result = run(photos, "-o", out, env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert result.returncode == 1
    assert "pip install 'texforge-textures[study]'" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not out.exists()


def test_without_matplotlib_the_function_says_so_first(
    photos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(texforge.ParameterError, match=r"pip install 'texforge-textures\[study\]'"):
        texforge.study(photos, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def wait_for(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        assert process.poll() is None, process.communicate()


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal")
def test_ctrl_c_leaves_tables_that_go_on(photos: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    flags = ["--size", "40", "--samples", "30", "--seeds", "40", "--threads", "1"]
    program = [str(SCRIPT), "study", str(photos), "-o", str(out), *flags]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as process:
        path = out / "costs.csv"
        wait_for(lambda: path.exists() and path.read_text().count("\n") > 3, process)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert err == "texforge: interrupted; the same command goes on where it was\n"
    assert sorted(p.name for p in out.iterdir()) == ["costs.csv", "iterations.csv"]
    rows = table(path)
    kept = [(row["exemplar"], row["method"], row["seed"]) for row in rows]
    assert len(kept) >= 3
    assert len(kept) < 160
    steps = table(out / "iterations.csv")
    assert len(steps) == sum(int(row["iterations"]) for row in rows)
    flags[flags.index("40", 2)] = "1"
    goes_on = run(photos, "-o", out, *flags)
    assert goes_on.returncode == 0, goes_on.stderr
    assert [tuple(row.values()) for row in table(path)][:2] == [
        tuple(row.values()) for row in rows if row["seed"] == "0"
    ][:2]


def test_the_line_of_progress_says_how_long() -> None:
    class Terminal:
        text = ""

        def write(self, text: str) -> None:
            self.text += text

        def flush(self) -> None:
            pass

    times = iter([0.0, 0.0, 0.1, 10.0, 400.0])
    terminal: Any = Terminal()
    line = Line(terminal, clock=lambda: next(times))
    for fraction in (0.0, 0.01, 0.25, 0.5):
        line(fraction)
    line.clear()
    said = terminal.text.replace("\r\x1b[K", "\n").splitlines()
    assert said == ["", "study 0 %", "study 25 %, about 30 s left", "study 50 %, about 7 min left"]
    assert terminal.text.endswith("\r\x1b[K")
