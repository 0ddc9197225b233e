"""What the tables come to: medians, ratios to the baseline, confidence intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from texforge._study.table import Key, Row, key

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from texforge._study.runs import Settings, Variant

Floats: TypeAlias = npt.NDArray[np.float64]

COSTS = ("c_text", "c_stat", "total")
RESAMPLES = 2000
"""Draws of a bootstrap; with ten times as many, bounds move in the third digit."""


class Data:
    """The exemplars of which every run is there, as arrays.

    Attributes
    ----------
    exemplars : list of str
        Their names.
    names : list of str
        The ways to tile; the baseline is the first.
    rows : list of dict
        The rows of ``costs.csv`` that count.
    """

    def __init__(
        self,
        rows: list[Row],
        steps: dict[Key, list[Row]],
        photos: list[str],
        variants: list[Variant],
        seeds: range,
    ) -> None:
        by_key = {key(row): row for row in rows}
        wanted = {
            name: [(name, v.method, v.measure, seed) for v in variants for seed in seeds]
            for name in photos
        }
        self.exemplars = [name for name, runs in wanted.items() if all(r in by_key for r in runs)]
        self.names = [variant.name for variant in variants]
        self.n_seeds = len(seeds)
        self._runs = [run for name in self.exemplars for run in wanted[name]]
        self.rows = [by_key[run] for run in self._runs]
        self._steps = steps

    def values(self, column: str) -> Floats:
        """Return a column of ``costs.csv``: ways x exemplars x seeds."""
        flat = np.array([row[column] for row in self.rows], dtype=np.float64)
        shape = (len(self.exemplars), len(self.names), self.n_seeds)
        return flat.reshape(shape).transpose(1, 0, 2)

    def traces(self, column: str) -> Floats:
        """Return a column of ``iterations.csv``: ways x exemplars x seeds x iterations.

        Photos too small for all levels have fewer iterations; their last value goes on.
        """
        lines = [[step[column] for step in self._steps[run]] for run in self._runs]
        longest = max(map(len, lines))
        full = np.array([line + line[-1:] * (longest - len(line)) for line in lines])
        shape = (len(self.exemplars), len(self.names), self.n_seeds, longest)
        return full.reshape(shape).transpose(1, 0, 2, 3)

    def levels(self) -> list[int]:
        """Return the level of each iteration, of the run that has most of them."""
        longest = max((self._steps[run] for run in self._runs), key=len)
        return [step["level"] for step in longest]


def bootstrap(values: Floats, statistic: Callable[[Floats], Floats]) -> tuple[Any, Any, Any]:
    """Return a statistic of the exemplars (the first axis) and its 95 % confidence interval.

    Exemplars are drawn with putting back, the draws' percentiles are the bounds. Always the same
    draws for the same number of exemplars. `statistic` is of the second axis: it is given many
    draws at once.
    """
    n = len(values)
    draws = np.random.default_rng(0).integers(n, size=(RESAMPLES, n))
    # Some megabytes at a time.
    blocks = np.array_split(draws, 1 + RESAMPLES * values.size // 1_000_000)
    drawn = np.concatenate([statistic(values[block]) for block in blocks])
    low, high = np.percentile(drawn, [2.5, 97.5], axis=0)
    return statistic(values[np.newaxis])[0], low, high


def median(draws: Floats) -> Floats:
    """Return the median over the exemplars of each draw."""
    return np.asarray(np.median(draws, axis=1))


def _told(values: Floats, statistic: Callable[[Floats], Floats] = median) -> dict[str, float]:
    middle, low, high = bootstrap(values, statistic)
    return {"value": float(middle), "low": float(low), "high": float(high)}


def _ratio_of_means(draws: Floats) -> Floats:
    """Return the ratio of the means of two columns."""
    total = draws.sum(axis=1)
    return _over(total[:, 0], total[:, 1])


def summary(data: Data, settings: Settings, skipped: dict[str, str]) -> dict[str, Any]:
    """Return what the study comes to; every number as value, low, high (95 %)."""
    ways: dict[str, Any] = {}
    for i, name in enumerate(data.names):
        way: dict[str, Any] = {}
        for cost in COSTS:
            means = data.values(cost).mean(axis=2)
            way[cost] = _told(means[i])
            if i > 0:
                way[f"{cost}_over_baseline"] = _told(_over(means[i], means[0]))
        way["seconds"] = float(np.median(data.values("seconds")[i]))
        if data.n_seeds > 1:
            variances = data.values("c_stat").var(axis=2, ddof=1)
            way["c_stat_variance"] = _told(variances[i])
            deviations = _over(np.sqrt(variances), data.values("c_stat").mean(axis=2))
            way["c_stat_relative_deviation"] = _told(deviations[i])
            if i > 0:
                way["baseline_variance_over_c_stat_variance"] = _told(
                    _over(variances[0], variances[i])
                )
                both = np.stack([variances[0], variances[i]], axis=1)
                way["mean_baseline_variance_over_mean_c_stat_variance"] = _told(
                    both, _ratio_of_means
                )
        ways[name] = way
    return {
        "version": settings.version,
        "size": settings.size,
        "seeds": data.n_seeds,
        "samples": settings.samples,
        "exemplars": len(data.exemplars),
        "runs": len(data.rows),
        "baseline": data.names[0],
        "ways": ways,
        "skipped": skipped,
    }


def _over(a: Floats, b: Floats) -> Floats:
    """Return a / b, where 0 / 0 is 1: no difference."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = a / b
    return np.where((a == 0) & (b == 0), 1.0, ratio)


def write(path: Path, data: Data, told: dict[str, Any]) -> None:
    """Write the summary for people, in Markdown."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text("\n".join(_lines(data, told)) + "\n", encoding="utf-8")
    partial.replace(path)


def _lines(data: Data, told: dict[str, Any]) -> list[str]:
    def number(entry: dict[str, float] | None) -> str:
        if entry is None:
            return ""
        return f"{entry['value']:.3g} ({entry['low']:.3g} to {entry['high']:.3g})"

    lines = [
        f"texforge {told['version']}, {told['exemplars']} exemplars, {told['seeds']} seeds, tiles "
        f"of {told['size']} x {told['size']}, texture costs from {told['samples']} patches.",
        "",
        "Medians over the exemplars of the mean over the seeds, with the 95 % confidence interval "
        "(bootstrap over the exemplars). `x baseline`: the median of the ratio to the baseline, "
        f"`{told['baseline']}`. Variance: of c_stat over the seeds; deviation: its root over the "
        "mean. The two columns behind say how many times larger the baseline's variance is, as the "
        "median of the ratios and as the ratio of the means.",
        "",
        "| | c_text | c_stat | total | c_text x baseline | c_stat x baseline | total x baseline "
        "| variance | deviation | median ratio | ratio of means | seconds |",
        "| --- |" + " ---: |" * 11,
    ]
    columns = [
        *COSTS,
        *(f"{cost}_over_baseline" for cost in COSTS),
        "c_stat_variance",
        "c_stat_relative_deviation",
        "baseline_variance_over_c_stat_variance",
        "mean_baseline_variance_over_mean_c_stat_variance",
    ]
    for name, way in told["ways"].items():
        cells = [number(way.get(column)) for column in columns]
        lines.append(f"| {name} | {' | '.join(cells)} | {way['seconds']:.2f} |")
    lines += ["", "Each exemplar: mean over the seeds, and variance of c_stat over the seeds.", ""]
    heads = [f"{name} {what}" for name in data.names for what in ("c_text", "c_stat", "variance")]
    lines += [f"| exemplar | {' | '.join(heads)} |", "| --- |" + " ---: |" * len(heads)]
    text, even = data.values("c_text").mean(axis=2), data.values("c_stat")
    for j, exemplar in enumerate(data.exemplars):
        cells = []
        for i in range(len(data.names)):
            spread = even[i, j].var(ddof=1) if data.n_seeds > 1 else float("nan")
            cells += [f"{text[i, j]:.3g}", f"{even[i, j].mean():.3g}", f"{spread:.2g}"]
        lines.append(f"| {exemplar.replace('|', ' ')} | {' | '.join(cells)} |")
    if told["skipped"]:
        lines += ["", "Skipped:", ""]
        lines += [f"- {name}: {reason}" for name, reason in told["skipped"].items()]
    return lines
