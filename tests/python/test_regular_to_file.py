"""Near-regular textures that are written to files while they are made."""

from __future__ import annotations

import _thread
import inspect
import subprocess
import sys
import threading
import typing
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import texforge
from texforge import _texforge

from .conftest import noise
from .test_cli import run
from .test_regular import BAD, TRUE, bricks

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

QUICK: dict[str, Any] = {"lattice": TRUE, "candidates": 2, "seam": "cut"}
"""Settings with which a texture takes little time."""

TYPED = ["--lattice", "28,0,14,16", "--candidates", "2", "--seam", "cut"]
"""The same for the command line."""

LONG: dict[str, Any] = {"lattice": TRUE, "size": (60_000, 500), "threads": 1}
"""Settings with which it takes far longer than any of these tests may."""


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("dtype", "extension"), [("uint8", "png"), ("uint16", "tif"), ("float32", "exr")]
)
def test_files_are_those_of_a_texture_in_memory_and_of_the_program(
    dtype: str, extension: str, tmp_path: Path
) -> None:
    photo = texforge.Image.tagged(bricks(dtype), "linear" if dtype == "float32" else "srgb")
    texforge.write_image(tmp_path / f"photo.{extension}", photo)
    normal = noise(96, 112, seed=3)
    texforge.write_image(tmp_path / "nrm.png", normal, kind="normal")
    rough = np.random.default_rng(4).random((48, 56), np.float32)
    texforge.write_image(tmp_path / "rough.exr", rough, kind="data")
    maps = {"normal": normal, "roughness": rough}
    options: dict[str, Any] = {"size": (150, 170), "maps": maps, "seed": 7, **QUICK}

    made = texforge.regular_to_file(photo, tmp_path / f"rows.{extension}", **options)
    assert made.path == tmp_path / f"rows.{extension}"
    rows = tmp_path / "rows_normal.png", tmp_path / "rows_roughness.exr"
    assert made.maps == dict(zip(maps, rows, strict=True))

    whole = texforge.regular(photo, **options)
    whole.save(tmp_path / f"whole.{extension}")
    texforge.write_image(tmp_path / "whole_normal.png", whole.maps["normal"], kind="normal")
    texforge.write_image(tmp_path / "whole_roughness.exr", whole.maps["roughness"], kind="data")

    typed = ["--size", "170x150", "--seed", 7, "--map", f"normal={tmp_path / 'nrm.png'}"]
    typed += ["--map", f"roughness={tmp_path / 'rough.exr'}", *TYPED]
    told = run(
        "regular",
        tmp_path / f"photo.{extension}",
        "-o",
        tmp_path / f"cli.{extension}",
        *map(str, typed),
    )
    assert told.returncode == 0, told.stderr

    for file in (made.path, *made.maps.values()):
        for twin in ("whole", "cli"):
            other = file.with_name(file.name.replace("rows", twin))
            assert file.read_bytes() == other.read_bytes(), other.name
    # And so is what is told of them.
    for name in ("lattice", "lattice_of_texture", "confidence", "seed", "params", "encoding"):
        assert getattr(made, name) == getattr(whole, name), name
    assert (made.size, made.photo_size) == ((150, 170), (96, 112))
    assert made.report.keys() == whole.report.keys()
    assert made.report["seconds"]


def test_a_texture_of_several_strips_is_that_of_one(tmp_path: Path) -> None:
    # A strip has about 2**23 pixels.
    photo = bricks(channels=None)
    options: dict[str, Any] = {"size": (9000, 1000), **QUICK, "feather": 0, "flatten": 0}
    shares: list[float] = []
    made = texforge.regular_to_file(
        photo, tmp_path / "a.png", maps={"height": photo}, progress=shares.append, **options
    )
    whole = texforge.regular(photo, **options).image
    assert np.array_equal(texforge.read_image(made.path), whole)
    assert np.array_equal(texforge.read_image(made.maps["height"], kind="data"), whole)
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0, 1)
    assert len(shares) > 10


@pytest.mark.skipif(sys.platform != "linux", reason="the file is Linux's")
def test_memory_does_not_grow_with_the_height(tmp_path: Path) -> None:
    script = (
        "import sys, numpy as np, pathlib, texforge\n"
        "photo = np.random.default_rng(0).integers(0, 256, (64, 64), dtype=np.uint8)\n"
        "texforge.regular_to_file(photo, sys.argv[1], size=(36000, 1000), lattice='none',\n"
        "                         candidates=1, seam='linear', flatten=0)\n"
        # Not getrusage's, which begins with that of the process that started this one.
        "status = pathlib.Path('/proc/self/status').read_text()\n"
        "print(status.split('VmHWM:')[1].split()[0])\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "a.png")]
    result = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    # All places and what is mixed with them would take this many bytes.
    assert int(result.stdout) * 1024 < 36_000 * 1000 * (8 + 8 + 1)


def test_same_bytes_for_any_number_of_threads_and_with_what_was_chosen(tmp_path: Path) -> None:
    photo = bricks()
    one = texforge.regular_to_file(photo, tmp_path / "1.png", size=200, threads=1)
    for number, options in enumerate(({"threads": 3, "size": 200}, one.params), 2):
        path = tmp_path / f"{number}.png"
        texforge.regular_to_file(photo, path, **options)
        assert path.read_bytes() == one.path.read_bytes()
    assert repr(one) == f"RegularFile({str(one.path)!r}, 200 x 200, seed 0)"


def test_the_options_are_those_of_a_texture_in_memory() -> None:
    signature = inspect.signature(texforge.regular)
    names = [p.name for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY]
    hints = typing.get_type_hints(texforge.RegularOptions)
    assert list(hints) == names
    of_regular = typing.get_type_hints(texforge.regular)
    assert hints == {name: of_regular[name] for name in names}


@pytest.mark.parametrize("there", ["wall.png", "wall_height.png"])
def test_nothing_is_overwritten_unless_told(there: str, tmp_path: Path) -> None:
    photo = bricks()
    (tmp_path / there).write_bytes(b"old")
    options: dict[str, Any] = {"maps": {"height": photo[..., 0]}, **QUICK}
    calls: list[float] = []
    with pytest.raises(texforge.OutputExistsError, match=there):
        texforge.regular_to_file(
            photo, tmp_path / "wall.png", size=(9000, 1000), progress=calls.append, **options
        )
    assert not calls, "refused before the work"
    assert contents(tmp_path) == {there: b"old"}
    texforge.regular_to_file(photo, tmp_path / "wall.png", overwrite=True, **options)
    assert contents(tmp_path).keys() == {"wall.png", "wall_height.png"}
    assert texforge.read_image(tmp_path / there).shape[:2] == (96, 112)


class Own(Exception):
    """Raised by a callback."""


@pytest.mark.parametrize("way", ["false", "exception", "ctrl-c"])
def test_what_is_stopped_leaves_nothing_behind(way: str, tmp_path: Path) -> None:
    (tmp_path / "wall.png").write_bytes(b"old")
    begun = []

    def progress(share: float) -> bool:
        # The files are being written by now.
        if share < 0.02:
            return True
        begun.append(sorted(path.name for path in tmp_path.iterdir()))
        if way == "exception":
            raise Own
        if way == "ctrl-c" and len(begun) == 1:
            threading.Timer(0.05, _thread.interrupt_main).start()
        return way != "false"

    kind = {"false": texforge.Cancelled, "exception": Own, "ctrl-c": KeyboardInterrupt}[way]
    photo = bricks()
    with pytest.raises(kind):
        texforge.regular_to_file(
            photo,
            tmp_path / "wall.png",
            overwrite=True,
            maps={"height": photo[..., 0]},
            progress=progress,
            **LONG,
        )
    assert sum(name.endswith(".part") for name in begun[0]) == 2
    assert contents(tmp_path) == {"wall.png": b"old"}


@pytest.mark.parametrize("case", BAD)
def test_bad_arguments(case: str, tmp_path: Path) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        texforge.regular_to_file(bricks(), tmp_path / "a.png", **BAD[case])
    assert caught.value.kind == "parameter"
    assert not contents(tmp_path)


@pytest.mark.parametrize("name", ["", "a/b", "../up", "a b", "n" * 65, "basecolor"])
def test_map_names_that_name_no_file(name: str, tmp_path: Path) -> None:
    photo: npt.NDArray[Any] = bricks()
    # The texture itself would be called so.
    path = tmp_path / "basecolor.png"
    with pytest.raises(texforge.ParameterError, match=r"^`maps` must be ") as caught:
        texforge.regular_to_file(photo, path, maps={name: photo}, **QUICK)
    assert caught.value.fields["name"] == "maps"
    assert not contents(tmp_path)


def test_places_and_formats_that_will_not_do(tmp_path: Path) -> None:
    photo = bricks()

    def refused(path: Any, image: Any = photo, **options: Any) -> texforge.TexforgeError:
        with pytest.raises(texforge.TexforgeError) as caught:
            texforge.regular_to_file(image, path, **{"size": (60_000, 500), **QUICK, **options})
        assert not contents(tmp_path)
        return caught.value

    for name in ("a", "a.xyz", "a.jpg", "a.webp"):
        error = refused(tmp_path / name)
        assert isinstance(error, texforge.FormatError), name
        assert name in str(error)
    assert "use .png, .tif or .exr" in str(refused(tmp_path / "a.jpg"))
    assert isinstance(refused(tmp_path / "no" / "a.png"), texforge.MissingFileError)
    assert isinstance(refused(3), texforge.ParameterError)
    bright = bricks("float32") * np.float32(5)
    assert isinstance(refused(tmp_path / "a.png", bright), texforge.FormatError)
    odd = {"height": noise(96, 112, 5)}
    assert isinstance(refused(tmp_path / "a.png", maps=odd), texforge.FormatError)
    flat = np.full((96, 112), 90, np.uint8)
    assert isinstance(refused(tmp_path / "a.png", flat), texforge.PictureError)
    error = refused(tmp_path / "a.png", noise(96, 112), lattice="auto")
    assert isinstance(error, texforge.NoStructureError)
    small = {"height": noise(96, 40)}
    assert isinstance(refused(tmp_path / "a.png", maps=small), texforge.PictureError)
    with pytest.raises(TypeError, match="colour"):
        texforge.regular_to_file(photo, tmp_path / "a.png", colour=3)  # type: ignore[call-arg]
    assert {p["name"] for p in _texforge.schema("regular")} < set(
        texforge.RegularOptions.__annotations__
    )
