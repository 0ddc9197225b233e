"""The plots of the paper's Fig. 3 and 4."""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING, Any

import numpy as np

from texforge._errors import ParameterError
from texforge._study.report import bootstrap, median

if TYPE_CHECKING:
    from pathlib import Path

    from texforge._study.report import Data, Floats

_COLORS = ("tab:orange", "tab:blue", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:pink")
"""The baseline and our measures; the first two are the paper's."""
_BINS = 16


def require() -> None:
    """Fail if the plots cannot be drawn."""
    if importlib.util.find_spec("matplotlib") is None:
        raise ParameterError(
            "`study` draws its plots with matplotlib, which is not installed; install it: pip "
            "install 'texforge-textures[study]'",
            fields={"name": "study"},
        )


def figure3(data: Data, path: Path) -> None:
    """Draw the costs over the iterations, and the distributions of the final ones."""
    figure, axes = _figure(4, [2.2, 1, 1, 1])
    _over_iterations(data, axes[0])
    for panel, column, title in zip(
        axes[1:],
        ("total", "c_stat", "c_text"),
        ("b) total", "c) stationarity", "d) texture"),
        strict=True,
    ):
        _distribution(panel, data.values(column).mean(axis=2), data.names)
        panel.set_title(title)
        panel.set_xlabel("exemplars")
    axes[1].set_ylabel("cost, mean over the seeds")
    axes[0].legend(*_handles(data.names), fontsize=8)
    _save(figure, path)


def figure4(data: Data, path: Path) -> None:
    """Draw the distributions of mean and variance of the stationarity cost over the seeds."""
    even = data.values("c_stat")
    figure, axes = _figure(2, [1, 1])
    _distribution(axes[0], even.mean(axis=2), data.names)
    axes[0].set_title("a) mean over the seeds")
    axes[0].set_ylabel("stationarity cost")
    axes[1].set_title("b) variance over the seeds")
    if data.n_seeds > 1:
        _distribution(axes[1], even.var(axis=2, ddof=1), data.names)
    else:
        axes[1].text(0.5, 0.5, "one seed has none", ha="center", transform=axes[1].transAxes)
    for panel in axes:
        panel.set_xlabel("exemplars")
    axes[0].legend(*_handles(data.names), fontsize=8)
    _save(figure, path)


def _figure(n: int, widths: list[float]) -> tuple[Any, Any]:
    # Not pyplot: it has a global state and looks for a screen.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(1.2 + 2.4 * sum(widths), 4.2), dpi=100, layout="constrained")
    return figure, figure.subplots(1, n, width_ratios=widths)


def _handles(names: list[str]) -> tuple[list[Any], list[str]]:
    from matplotlib.lines import Line2D

    return [Line2D([], [], color=_color(i)) for i in range(len(names))], names


def _color(i: int) -> str:
    return _COLORS[i % len(_COLORS)]


def _over_iterations(data: Data, panel: Any) -> None:
    totals = data.traces("total_bound")
    iterations = np.arange(1, totals.shape[3] + 1)
    for i in range(len(data.names)):
        color = _color(i)
        middle, low, high = bootstrap(totals[i], _median_of_tiles)
        ends = np.percentile(totals[i].reshape(-1, totals.shape[3]), [5, 95], axis=0)
        panel.plot(iterations, middle, color=color, linewidth=2)
        panel.fill_between(iterations, low, high, color=color, alpha=0.2, linewidth=0)
        for end in ends:
            panel.plot(iterations, end, color=color, linewidth=0.7)
    levels = data.levels()
    for at in range(1, len(levels)):
        if levels[at] != levels[at - 1]:
            panel.axvline(at + 0.5, color="0.85", linewidth=0.7, zorder=0)
    panel.set_yscale("log")
    panel.set_title("a) total: median, 95 % of it (shaded), 90 % of the tiles")
    panel.set_xlabel("iteration (grey: next level)")
    panel.set_ylabel("cost (texture: upper bound)")


def _median_of_tiles(draws: Floats) -> Floats:
    """Return the median over exemplars and seeds of each draw."""
    return np.asarray(np.median(draws, axis=(1, 2)))


def _distribution(panel: Any, values: Floats, names: list[str]) -> None:
    """Draw a lying histogram of each row of ways x exemplars, its median and 95 % of that."""
    positive = values[values > 0]
    low, high = (positive.min(), positive.max()) if positive.size else (0.1, 1.0)
    edges = np.geomspace(low / 1.01, high * 1.01, _BINS + 1)
    for i in range(len(names)):
        counts, _ = np.histogram(np.clip(values[i], low, high), edges)
        panel.stairs(counts, edges, orientation="horizontal", color=_color(i), linewidth=1.5)
        middle, below, above = bootstrap(values[i], median)
        panel.axhline(middle, color=_color(i), linewidth=1, linestyle="--")
        panel.axhspan(below, above, color=_color(i), alpha=0.12, linewidth=0)
    panel.set_yscale("log")


def _save(figure: Any, path: Path) -> None:
    partial = path.with_name(f".{path.name}.partial")
    # Without the version of matplotlib, which would be another file for the same picture.
    figure.savefig(partial, format="png", metadata={"Software": None})
    partial.replace(path)
