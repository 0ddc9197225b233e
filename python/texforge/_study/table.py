"""The two tables on disk: a row is added when its run is finished, and none is ever half there."""

from __future__ import annotations

import csv
import io
import os
from typing import TYPE_CHECKING, Any

from texforge._errors import FileError, OutputExistsError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path
    from types import TracebackType
    from typing import Self

    from texforge._study.runs import Settings, Variant

_RUN = {"exemplar": str, "method": str, "measure": str, "seed": int}
COSTS: dict[str, type] = {
    **_RUN,
    "c_text": float,
    "c_text_margin": float,
    "c_text_bound": float,
    "c_stat": float,
    "total": float,
    "seconds": float,
    "iterations": int,
    "photo_height": int,
    "photo_width": int,
    "reduction": int,
    "height": int,
    "width": int,
    "sigma": float,
    "patch": int,
    "samples": int,
    "photo_sha256": str,
    "version": str,
}
"""Columns of ``costs.csv`` and what they hold."""
ITERATIONS: dict[str, type] = {
    **_RUN,
    "iteration": int,
    "level": int,
    "c_text_bound": float,
    "c_stat": float,
    "total_bound": float,
}
"""Columns of ``iterations.csv`` and what they hold."""

Row = dict[str, Any]
Key = tuple[str, str, str, int]


def key(row: Row) -> Key:
    """Return which run a row belongs to."""
    return row["exemplar"], row["method"], row["measure"], row["seed"]


class Table:
    """The tables of a folder. Entering reads what is finished, leaving puts all in order."""

    def __init__(self, folder: Path) -> None:
        self._costs = folder / "costs.csv"
        self._iterations = folder / "iterations.csv"
        self._runs: dict[Key, Row] = {}
        self._steps: dict[Key, list[Row]] = {}

    def __enter__(self) -> Self:
        """Read both; what an interruption has left of an unfinished run is dropped."""
        self._runs = {key(row): row for row in _read(self._costs, COSTS)}
        for step in _read(self._iterations, ITERATIONS):
            self._steps.setdefault(key(step), []).append(step)
        for run in [*self._runs, *self._steps]:
            row, steps = self._runs.get(run), self._steps.get(run, [])
            if row is None or [s["iteration"] for s in steps] != [*range(1, row["iterations"] + 1)]:
                self._runs.pop(run, None)
                self._steps.pop(run, None)
        self._rewrite()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Put the rows in order, whatever happened."""
        self._rewrite()

    @property
    def rows(self) -> list[Row]:
        """The finished runs."""
        return [self._runs[run] for run in sorted(self._runs)]

    @property
    def steps(self) -> dict[Key, list[Row]]:
        """The iterations of each finished run."""
        return self._steps

    def missing(
        self, exemplar: str, variants: Iterable[Variant], seeds: range
    ) -> list[tuple[Variant, int]]:
        """Return the runs of an exemplar that are still to be made."""
        wanted = [(variant, seed) for seed in seeds for variant in variants]
        return [
            (variant, seed)
            for variant, seed in wanted
            if (exemplar, variant.method, variant.measure, seed) not in self._runs
        ]

    def check(self, exemplar: str, settings: Settings, digest: str) -> None:
        """Fail if there are runs of this exemplar that do not belong to this study."""
        now = {
            "version": settings.version,
            "height": settings.size,
            "samples": settings.samples,
            "photo_sha256": digest,
        }
        names = {"height": "size", "photo_sha256": "photo"}
        for run, row in self._runs.items():
            for column, value in now.items():
                if run[0] == exemplar and row[column] != value:
                    raise OutputExistsError(
                        f"{self._costs} holds runs of {exemplar} with {names.get(column, column)} "
                        f"{row[column]}, and this study has {value}; choose another folder, or "
                        "remove that file",
                        fields={"path": self._costs},
                    )

    def add(self, row: Row, steps: list[Row]) -> None:
        """Add a finished run."""
        # First here: if Ctrl-C comes between these lines, leaving writes it all.
        self._steps[key(row)] = steps
        self._runs[key(row)] = row
        # On disk a run is finished once its row is whole, which is written last.
        _append(self._iterations, ITERATIONS, steps)
        _append(self._costs, COSTS, [row])

    def _rewrite(self) -> None:
        _replace(
            self._iterations,
            ITERATIONS,
            [s for run in sorted(self._steps) for s in self._steps[run]],
        )
        _replace(self._costs, COSTS, self.rows)


def _read(path: Path, columns: dict[str, type]) -> list[Row]:
    """Return the rows of a file, but for a last line that is not whole; none without a file."""
    try:
        text = path.read_bytes().decode("utf-8", errors="replace")
    except FileNotFoundError:
        return []
    except OSError as error:
        raise _failure("read", path, error) from None
    whole = text[: text.rfind("\n") + 1]
    lines = list(csv.reader(io.StringIO(whole, newline="")))
    if text and (not lines or lines[0] != list(columns)):
        raise OutputExistsError(
            f"{path} is not a table of this version's `study`; choose another folder, or remove it",
            fields={"path": path},
        )
    rows = []
    for line in lines[1:]:
        try:
            pairs = zip(columns.items(), line, strict=True)
            rows.append({name: kind(value) for (name, kind), value in pairs})
        except ValueError:
            raise OutputExistsError(
                f"{path} holds a line that `study` did not write: {','.join(line)[:80]}; choose "
                "another folder, or remove it",
                fields={"path": path},
            ) from None
    return rows


def _text(columns: dict[str, type], rows: list[Row]) -> str:
    out = io.StringIO()
    writer = csv.DictWriter(out, list(columns), lineterminator="\n")
    writer.writerows(rows)
    return out.getvalue()


def _append(path: Path, columns: dict[str, type], rows: list[Row]) -> None:
    try:
        with path.open("ab") as file:
            file.write(_text(columns, rows).encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise _failure("write", path, error) from None


def _replace(path: Path, columns: dict[str, type], rows: list[Row]) -> None:
    """Write the whole file, at once or not at all, if it is not so already."""
    data = (",".join(columns) + "\n" + _text(columns, rows)).encode()
    try:
        if path.exists() and path.read_bytes() == data:
            return
        partial = path.with_name(f".{path.name}.partial")
        partial.write_bytes(data)
        partial.replace(path)
    except OSError as error:
        raise _failure("write", path, error) from None


def _failure(action: str, path: Path, error: OSError) -> FileError:
    return FileError(
        f"cannot {action} {path}: {error.strerror}", fields={"path": path, "errno": error.errno}
    )
