"""The compiled module. Private: `_api.py` is its only caller."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, final

_Picture = tuple[Any, str, tuple[int, int, int], str]
_PictureOut = tuple[bytearray, str, tuple[int, int, int], str]
_Step = tuple[int, int, float | None, float]
_Size = tuple[int, int]
_Vector = tuple[float, float]
_Found = tuple[
    list[float], list[float], float, bool, float, float, tuple[_PictureOut, list[float]] | None
]
_Map = tuple[Any, _Size, list[_Size], Any]
_MapOut = tuple[bytearray, _Size, list[_Size], bytearray | None]
_Palette = tuple[list[float], list[tuple[float, float]], _PictureOut]
_Extracted = tuple[
    _PictureOut, _MapOut | None, tuple[int, int], list[float], tuple[float, float, float], str
]
_TileOut = tuple[_PictureOut, _MapOut | None, list[tuple[str, _PictureOut]], str, list[_Step]]

__all__ = [
    "Noise",
    "Wang",
    "__version__",
    "apply",
    "cli_main",
    "cli_study",
    "encode_png",
    "error_kinds",
    "export_targets",
    "extract",
    "fail",
    "fit_noise",
    "lattice",
    "lattice_overlay",
    "lattice_snap",
    "map_kind",
    "read",
    "read_source_map",
    "regular",
    "regular_to_file",
    "schema",
    "texture_cost",
    "tiles",
    "wang",
    "write",
    "write_files",
    "write_source_map",
]

__version__: str

@final
class Noise:
    @staticmethod
    def from_json(text: str) -> Noise: ...
    @staticmethod
    def load(path: str) -> Noise: ...
    def to_json(self) -> str: ...
    def at(
        self,
        *,
        points: Any,
        count: int,
        axes: int,
        normals: Any,
        footprint: float,
        keep_contrast: bool,
        threads: int,
    ) -> bytearray: ...
    def volume(
        self,
        *,
        shape: list[int],
        scale: float,
        origin: list[float],
        keep_contrast: bool,
        threads: int,
        progress: Callable[[float], object] | None,
    ) -> bytearray: ...
    def render(
        self,
        *,
        size: _Size,
        scale: float,
        origin: list[float],
        tileable: bool,
        keep_contrast: bool,
        dtype: str,
        only: str | None,
        threads: int,
        progress: Callable[[float], object] | None,
    ) -> list[tuple[str, _PictureOut]]: ...
    def morph(self, *, other: Noise, t: float) -> Noise: ...
    def edit(
        self,
        *,
        params: list[tuple[str, str]],
        gains: list[float],
        means: list[tuple[str, list[float]]],
        seed: int | None,
    ) -> Noise: ...
    def export(self, *, target: str, name: str) -> list[tuple[str, bytes]]: ...

@final
class Wang:
    def plane(self, *, size: _Size, seed: int, only: str | None) -> _PictureOut: ...
    def layout(self, *, rows: int, columns: int, seed: int) -> bytes: ...
    def save(self, *, folder: str, plane: _Size, seed: int, overwrite: bool) -> list[str]: ...

def wang(
    *,
    photo: _Picture,
    mask: _Picture | None,
    maps: list[tuple[str, list[_Picture], str]],
    params: list[tuple[str, str]],
    threads: int,
    progress: Callable[[float], object] | None,
) -> tuple[Wang, _PictureOut, _MapOut | None, list[tuple[str, _PictureOut]], str]: ...
def fit_noise(
    *,
    maps: list[tuple[str, _Picture, str]],
    mask: _Picture | None,
    params: list[tuple[str, str]],
    seed: int,
    threads: int,
    progress: Callable[[float], object] | None,
) -> tuple[Noise, str]: ...
def tiles(
    *,
    photo: _Picture,
    also: list[_Picture],
    mask: _Picture | None,
    avoid: _Picture | None,
    sigma_map: _Picture | None,
    redo: tuple[_Map, list[int]] | None,
    maps: list[tuple[str, list[_Picture], str]],
    params: list[tuple[str, str]],
    seed: int,
    count: int,
    as_palette: bool,
    threads: int,
    progress: Callable[[float], object] | None,
    trace: bool,
) -> tuple[list[_TileOut], _Palette | None]: ...
def texture_cost(
    *,
    texture: _Picture,
    photo: _Picture,
    source_map: _Map | None,
    mask: _Picture | None,
    params: list[tuple[str, str]],
    seed: int,
    threads: int,
    progress: Callable[[float], object] | None,
) -> tuple[float, float, int]: ...
def lattice(
    *,
    photo: _Picture,
    params: list[tuple[str, str]],
    autocorrelation: bool,
    threads: int,
    progress: Callable[[float], object] | None,
) -> _Found: ...
def extract(
    *,
    photo: _Picture,
    mask: _Picture | None,
    maps: list[tuple[str, list[_Picture], str]],
    params: list[tuple[str, str]],
    seed: int,
    threads: int,
    progress: Callable[[float], object] | None,
) -> tuple[list[_Extracted], list[tuple[str, list[_PictureOut]]], _PictureOut, str]: ...
def regular(
    *,
    photo: _Picture,
    mask: _Picture | None,
    maps: list[tuple[str, list[_Picture], str]],
    params: list[tuple[str, str]],
    seed: int,
    threads: int,
    progress: Callable[[float], object] | None,
) -> tuple[_PictureOut, _MapOut, list[tuple[str, _PictureOut]], str]: ...
def regular_to_file(
    *,
    path: str,
    photo: _Picture,
    mask: _Picture | None,
    maps: list[tuple[str, list[_Picture], str]],
    params: list[tuple[str, str]],
    seed: int,
    overwrite: bool,
    threads: int,
    progress: Callable[[float], object] | None,
) -> tuple[list[Path], str]: ...
def lattice_overlay(*, picture: _Picture, v1: _Vector, v2: _Vector) -> _PictureOut: ...
def lattice_snap(
    *, v1: _Vector, v2: _Vector, width: int, height: int
) -> tuple[int, int, list[float], list[list[int]], list[float]] | None: ...
def apply(*, source_map: _Map, pictures: list[_Picture], kind: str) -> _PictureOut: ...
def read(*, path: str, kind: str) -> _PictureOut: ...
def write(*, files: list[tuple[str, _Picture, str, str | None]], overwrite: bool) -> None: ...
def export_targets() -> list[str]: ...
def write_files(*, files: list[tuple[str, bytes]], overwrite: bool) -> None: ...
def encode_png(*, picture: _Picture) -> bytes: ...
def read_source_map(*, path: str) -> _MapOut: ...
def write_source_map(*, path: str, source_map: _Map, overwrite: bool) -> None: ...
def map_kind(name: str) -> str: ...
def schema(verb: str = "tile") -> list[dict[str, Any]]: ...
def error_kinds() -> list[str]: ...
def fail(kind: str) -> None: ...
def cli_main(args: list[str]) -> int: ...
def cli_study(args: list[str]) -> tuple[int, dict[str, Any] | None]: ...
