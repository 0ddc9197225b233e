"""The examples in docstrings and in the README run."""

from __future__ import annotations

import doctest
import inspect
import os
import tempfile
from pathlib import Path

import pytest
import texforge

ROOT = Path(__file__).parents[2]
PUBLIC = [getattr(texforge, name) for name in texforge.__all__]


@pytest.mark.parametrize(
    "thing",
    [thing for thing in PUBLIC if inspect.isfunction(thing) or inspect.isclass(thing)],
    ids=lambda thing: thing.__name__,
)
def test_examples_in_docstrings(thing: object) -> None:
    # Of a class also its methods'.
    for test in doctest.DocTestFinder().find(thing, getattr(thing, "__name__", "")):
        results = doctest.DocTestRunner().run(test)
        assert results.failed == 0


def test_examples_in_the_readme(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    test = doctest.DocTestParser().get_doctest(text, {}, "README.md", "README.md", 0)
    with tempfile.TemporaryDirectory() as folder:
        monkeypatch.chdir(folder)
        assert doctest.DocTestRunner().run(test).failed == 0
        os.chdir(ROOT)


def test_everything_public_is_documented() -> None:
    for thing in PUBLIC:
        if inspect.isfunction(thing) or inspect.isclass(thing):
            assert inspect.getdoc(thing), thing
        if inspect.isfunction(thing):
            doc = inspect.getdoc(thing) or ""
            assert "Parameters\n----------" in doc
            assert "Raises\n------" in doc


def test_the_package_under_test_is_the_installed_one() -> None:
    assert "_texforge" in dir(texforge)
    assert (Path(texforge.__file__).parent / "py.typed").is_file()
    assert (Path(texforge.__file__).parent / "_texforge.pyi").is_file()
