"""A default is written once, in Rust; the Python signature is a copy, compared here."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable  # noqa: TC003 (resolved at run time)

import pytest
import texforge
from texforge import _texforge

FUNCTIONS = [
    texforge.tile,
    texforge.texture_cost,
    texforge.detect_lattice,
    texforge.extract,
    texforge.wang,
    texforge.regular,
    texforge.fit_noise,
    texforge.NoiseTexture.edit,
]


@pytest.mark.parametrize("function", FUNCTIONS)
def test_names_order_and_defaults_are_those_of_the_core(function: Callable[..., object]) -> None:
    signature = inspect.signature(function)
    options = [p for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY]
    schema = _texforge.schema(function.__name__)
    assert schema
    assert [p.name for p in options][: len(schema)] == [entry["name"] for entry in schema]
    for option, entry in zip(options, schema, strict=False):
        # What is left out: no number, or the size that fits.
        nothing = "none" if entry["kind"] == "optional number" else "auto"
        shown = nothing if option.default is None else option.default
        if entry["kind"] == "number" and option.default is not None:
            assert float(entry["default"]) == shown
        else:
            assert entry["default"] == str(shown)


@pytest.mark.parametrize(
    "function",
    [
        texforge.tile,
        texforge.regular,
        texforge.extract,
        texforge.wang,
        texforge.fit_noise,
        texforge.NoiseTexture.edit,
    ],
)
def test_the_words_accepted_are_those_of_the_core(function: Callable[..., object]) -> None:
    hints = typing.get_type_hints(function)
    schema = _texforge.schema(function.__name__)
    choices = {e["name"]: tuple(e["choices"]) for e in schema if e["choices"]}
    assert choices
    for name, words in choices.items():
        alternatives = typing.get_args(hints[name])
        assert tuple(typing.get_args(a)[0] for a in alternatives) == words


def test_everything_but_the_picture_is_keyword_only() -> None:
    for function in (
        texforge.tile,
        texforge.apply,
        texforge.detect_lattice,
        texforge.extract,
        texforge.wang,
        texforge.regular,
        texforge.fit_noise,
        texforge.NoiseTexture.at,
        texforge.NoiseTexture.edit,
        texforge.NoiseTexture.export,
        texforge.NoiseTexture.export_to,
        texforge.NoiseTexture.render,
        texforge.NoiseTexture.render_maps,
        texforge.NoiseTexture.save,
        texforge.NoiseTexture.solid,
        texforge.read_image,
        texforge.write_image,
    ):
        for parameter in inspect.signature(function).parameters.values():
            optional = parameter.default is not parameter.empty
            assert (parameter.kind is parameter.KEYWORD_ONLY) == optional, parameter


@pytest.mark.parametrize("function", FUNCTIONS)
def test_every_parameter_is_documented(function: Callable[..., object]) -> None:
    doc = inspect.getdoc(function)
    assert doc is not None
    for name in inspect.signature(function).parameters.keys() - {"self"}:
        assert f"\n{name} : " in doc


@pytest.mark.parametrize("function", FUNCTIONS)
def test_ranges_in_the_docs_are_those_of_the_core(function: Callable[..., object]) -> None:
    doc = " ".join((inspect.getdoc(function) or "").split())
    for entry in _texforge.schema(function.__name__):
        if entry["range"]:
            low, high = entry["range"].split(" to ")
            text = doc[doc.index(f" {entry['name']} : ") :][:260]
            assert low in text, entry
            assert high in text, entry


def test_the_options_of_variants_are_those_of_a_tile() -> None:
    signature = inspect.signature(texforge.tile)
    options = [p.name for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY]
    hints = typing.get_type_hints(texforge.TileOptions)
    assert list(hints) == options
    tile_hints = typing.get_type_hints(texforge.tile)
    assert hints == {name: tile_hints[name] for name in options}
