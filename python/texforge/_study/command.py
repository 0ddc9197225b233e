"""``texforge study``: the command around `texforge.study`."""

from __future__ import annotations

import json
import sys
import time
from typing import TYPE_CHECKING, Any, TextIO

from texforge import _texforge
from texforge._errors import ParameterError, TexforgeError
from texforge._study import plots, study

if TYPE_CHECKING:
    from collections.abc import Callable

DONE, CANNOT, USAGE, INTERRUPTED = 0, 1, 2, 130


def main(arguments: list[str]) -> int:
    """Run ``texforge study ...``; return the exit status."""
    status, asked = _texforge.cli_study(arguments)
    if asked is None:
        return status
    try:
        plots.require()
    except ParameterError as error:
        return _fail(CANNOT, str(error))
    as_json, quiet = asked.pop("json"), asked.pop("quiet")
    line = Line(sys.stderr) if sys.stderr.isatty() and not quiet else None
    try:
        return _study(asked, as_json=as_json, quiet=quiet, line=line)
    finally:
        if line is not None:
            line.clear()


def _study(asked: dict[str, Any], *, as_json: bool, quiet: bool, line: Line | None) -> int:
    try:
        result = study(progress=line, **asked)
    except KeyboardInterrupt:
        return _fail(INTERRUPTED, "interrupted; the same command goes on where it was", line)
    except ParameterError as error:
        return _fail(USAGE, str(error), line)
    except TexforgeError as error:
        return _fail(CANNOT, str(error), line)
    if line is not None:
        line.clear()
    for name, reason in result.skipped.items():
        _say(f"skipped {name}: {reason}")
    if as_json:
        sys.stdout.write(json.dumps(result.summary, indent=2) + "\n")
        sys.stdout.flush()
    if not quiet:
        _say(
            f"{result.summary['runs']} runs over {result.summary['exemplars']} photos; see "
            f"{result.out / 'summary.md'}"
        )
    # All else is done, but a script should know.
    return CANNOT if result.skipped else DONE


def _say(sentence: str) -> None:
    # One line, whatever a file is called.
    sys.stderr.write(f"texforge: {' '.join(sentence.split())}\n")


def _fail(status: int, sentence: str, line: Line | None = None) -> int:
    if line is not None:
        line.clear()
    _say(sentence)
    return status


class Line:
    """One line on a terminal that says how far it is; called with the fraction done."""

    def __init__(self, out: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._out = out
        self._clock = clock
        self._started = clock()
        self._next = 0.0

    def __call__(self, fraction: float) -> None:
        """Write the line anew, at most five times a second."""
        now = self._clock()
        if now < self._next:
            return
        self._next = now + 0.2
        left = (now - self._started) * (1 - fraction) / fraction if fraction > 0.005 else None
        rest = "" if left is None else f", about {_span(left)} left"
        self._out.write(f"\r\x1b[Kstudy {100 * fraction:.0f} %{rest}")
        self._out.flush()

    def clear(self) -> None:
        """Take the line away."""
        self._out.write("\r\x1b[K")
        self._out.flush()


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
