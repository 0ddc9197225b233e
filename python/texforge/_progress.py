"""What `progress=` may be."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

from texforge._errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from texforge._types import Progress

_EXPECTED = "None, True, a function of the fraction done, or a bar like tqdm's with `update`"


@contextlib.contextmanager
def reporting(progress: Progress) -> Iterator[Callable[[float], object] | None]:
    """Yield the function that the core calls with the fraction done, or None."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        with _tqdm_bar() as bar:
            yield _updater(bar)
    elif hasattr(progress, "update"):
        yield _updater(progress)
    elif callable(progress):
        yield progress
    else:
        raise ParameterError(
            f"`progress` must be {_EXPECTED}, got {type(progress).__name__}",
            fields={"name": "progress"},
        )


def _tqdm_bar() -> Any:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise ParameterError(
            "`progress=True` needs tqdm; install it or give a function of the fraction done",
            fields={"name": "progress"},
        ) from None
    return tqdm(total=100, desc="texforge", bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed}")


def _updater(bar: Any) -> Callable[[float], None]:
    """Return a function that moves `bar` on to a fraction of its total (1 if it has none)."""
    total = getattr(bar, "total", None) or 1
    shown = 0.0

    def update(fraction: float) -> None:
        nonlocal shown
        bar.update((fraction - shown) * total)
        shown = fraction

    return update
