"""The study: the baseline against every measure, over photos and seeds, with tables and plots."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texforge import _arrays, _texforge
from texforge._errors import FileError, FormatError, PictureError, ReadError
from texforge._progress import reporting
from texforge._study import plots, report, runs
from texforge._study.runs import BASELINE, Settings, Variant
from texforge._study.table import Table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from texforge._types import PathType, Progress

__all__ = ["Study", "study"]


@dataclasses.dataclass(frozen=True)
class Study:
    """What a study has found.

    Attributes
    ----------
    out : Path
        The folder of its tables and plots.
    rows : list of dict
        One for every run: the columns of ``costs.csv``, as numbers where they are numbers.
    summary : dict
        Medians, ratios to the baseline and their 95 % confidence intervals: what ``texforge study
        --json`` writes.
    skipped : dict
        The photos that could not be used, and why: path in the folder to one sentence.
    """

    out: Path
    rows: list[dict[str, Any]]
    summary: dict[str, Any]
    skipped: dict[str, str]


def study(
    folder: PathType,
    out: PathType,
    *,
    seeds: int = 10,
    size: int = 256,
    measures: Sequence[str] | None = None,
    samples: int = 200,
    threads: int | None = None,
    progress: Progress = None,
) -> Study:
    """Compare the baseline with every measure over a folder of photos and several seeds.

    Every photo is tiled in every way with every seed: by toroidal PatchMatch alone
    (``wrap-only``, the baseline) and by the method ``stationary`` with each measure. Into `out`
    go ``costs.csv`` (a row for every run), ``iterations.csv`` (a row for every iteration of every
    run), ``summary.md``, and the plots of the paper's Fig. 3 and 4, ``fig3.png`` and ``fig4.png``.

    Finished runs that `out` holds already are kept and not repeated: an interrupted study goes on
    where it was, and more seeds, measures or photos are added to it.

    Parameters
    ----------
    folder : path
        The photos: every picture in it and, recursively, in its folders, but in no hidden one and
        not in `out`. A photo whose shorter side is longer than four tiles is averaged over
        squares of pixels first, since a tile would show too little of it.
    out : path
        The folder to write; made if it is not there.
    seeds : int
        How many tiles are made of each photo in each way, with the seeds 0, 1, ...; 1 to 1000.
    size : int
        Height and width of the tiles in pixels, 11 to 4096.
    measures : sequence of str, optional
        The measures to compare with the baseline; by default all that `tile` has.
    samples : int
        How many patches of a tile are compared with all of the photo's for its texture cost (see
        `texture_cost`), 2 to 1000000.
    threads : int, optional
        Number of worker threads, as for `tile`. Does not change the result.
    progress : bool, callable or bar, optional
        As for `tile`, with the fraction of the runs that are still to be made.

    Returns
    -------
    Study
        The table, what it comes to, and which photos could not be used.

    Raises
    ------
    ParameterError
        If an argument is out of range or a measure unknown, or matplotlib is missing; checked
        before anything is computed (also a ValueError).
    FileError
        If `folder` is no folder, a photo may not be read, or `out` cannot be written (also an
        OSError).
    OutputExistsError
        If `out` holds runs of another version, size, number of samples or of other photos by the
        same name (also a FileExistsError).
    PictureError
        If there is no picture in `folder`, or none of them could be used (also a ValueError).
    Cancelled
        If `progress` returned False. Finished runs are kept.

    Notes
    -----
    The same arguments give the same tables but for the seconds, and the same plots.

    Columns of ``costs.csv``: `c_text` is the texture cost by its definition (eq. 5 of the paper),
    estimated from `samples` patches that were compared with all of the photo's, and
    `c_text_margin` the half width of its 95 % confidence interval; `c_text_bound` is the upper
    bound that `Tile.costs` has. `c_stat` is the stationarity cost as `Tile.costs` has it, and
    `total` is `c_text` + `c_stat`. ``iterations.csv`` has what `Tile.trace` has: there the texture
    cost is the bound, and both are of the iteration's own resolution.

    Source: Moritz et al. 2017 (see `tile`), Sec. 5.2 and 5.3.
    """
    plots.require()
    settings = Settings(
        size=_arrays.integer("size", size, 11, 4096),
        samples=_arrays.integer("samples", samples, 2, 1_000_000),
        threads=_arrays.integer("threads", threads or 0, high=1024),
        version=_texforge.__version__,
    )
    variants = [BASELINE, *runs.variants(measures)]
    numbers = range(_arrays.integer("seeds", seeds, 1, 1000))
    root, target = Path(_arrays.path(folder)), Path(_arrays.path(out))
    photos = runs.photos(root, target)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            f"cannot make the folder {target}: {error.strerror}",
            fields={"path": target, "errno": error.errno},
        ) from None
    with Table(target) as table, reporting(progress) as callback:
        skipped = _run(root, photos, variants, numbers, settings, table, callback)
    data = report.Data(table.rows, table.steps, photos, variants, numbers)
    if not data.exemplars:
        name, reason = next(iter(skipped.items()))
        raise PictureError(f"none of the pictures in {root} could be used; {name}: {reason}")
    summary = report.summary(data, settings, skipped)
    report.write(target / "summary.md", data, summary)
    plots.figure3(data, target / "fig3.png")
    plots.figure4(data, target / "fig4.png")
    return Study(target, data.rows, summary, skipped)


def _run(
    root: Path,
    photos: list[str],
    variants: list[Variant],
    seeds: range,
    settings: Settings,
    table: Table,
    callback: Callable[[float], object] | None,
) -> dict[str, str]:
    """Make the runs that the table lacks; return the photos that could not be used, and why."""
    skipped: dict[str, str] = {}
    digests = {name: runs.digest(root / name) for name in photos}
    for name, digest in digests.items():
        table.check(name, settings, digest)
    missing = {name: table.missing(name, variants, seeds) for name in photos}
    done, total = 0, sum(map(len, missing.values()))
    for name in photos:
        if not missing[name]:
            continue
        try:
            exemplar = runs.Exemplar.read(root, name, digests[name], settings)
            for variant, seed in missing[name]:
                row, steps = exemplar.run(variant, seed, settings, _part(callback, done, total))
                table.add(row, steps)
                done += 1
        except (FormatError, PictureError, ReadError) as error:
            skipped[name] = str(error)
            total -= len(missing[name])
    return skipped


def _part(
    callback: Callable[[float], object] | None, done: int, total: int
) -> Callable[[float], object] | None:
    """Return a callback for one of several runs."""
    if callback is None:
        return None
    return lambda fraction: callback((done + fraction) / total)
