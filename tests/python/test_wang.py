"""Wang tiles through Python. That they fit is tested in Rust."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any, assert_type

import numpy as np
import pytest
import texforge

from .conftest import noise
from .test_extract import cloth, contents

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

PERIOD = (20, 28)


def photo(seed: int = 0) -> npt.NDArray[np.uint8]:
    return cloth(*PERIOD, times=(6, 6), seed=seed)


def test_a_plane_is_made_of_the_atlas() -> None:
    height_map = np.random.default_rng(1).integers(0, 65536, (120, 168), dtype=np.uint16)
    made = texforge.wang(photo(), period=PERIOD, maps={"height": height_map})
    assert_type(made, texforge.WangSet)
    assert (made.grid, len(made.tiles), len(set(made.edges))) == ((4, 4), 16, 16)
    assert made.tiles[0].shape == (40, 56, 3)
    assert np.array_equal(made.tiles[6], made.atlas[40:80, 112:168])
    assert made.source_map is not None
    rows, columns = made.source_map[..., 0], made.source_map[..., 1]
    assert np.array_equal(made.atlas, photo()[rows, columns])
    assert np.array_equal(made.maps["height"], height_map[rows, columns])
    layout = made.layout(3, 4, seed=5)
    for plane, tiles in (
        (made.plane((120, 224), seed=5), made.atlas),
        (made.plane((120, 224), seed=5, map="height"), made.maps["height"]),
    ):
        for i in range(3):
            for j in range(4):
                y, x = divmod(int(layout[i, j]), 4)
                got = plane[i * 40 : i * 40 + 40, j * 56 : j * 56 + 56]
                assert np.array_equal(got, tiles[y * 40 : y * 40 + 40, x * 56 : x * 56 + 56])
    # Neighbours fit, around the plane too.
    edges = [[made.edges[k] for k in row] for row in layout]
    for i in range(3):
        for j in range(4):
            assert edges[i][j].east == edges[i][(j + 1) % 4].west
            assert edges[i][j].south == edges[(i + 1) % 3][j].north
    assert made.plane(100).shape == (100, 100, 3)
    assert repr(made) == "WangSet(16 tiles of 40 x 56)"
    png = made._repr_png_()
    assert png is not None
    assert png.startswith(b"\x89PNG")


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("channels", [None, 1, 4])
def test_what_comes_out_is_what_went_in(dtype: str, channels: int | None) -> None:
    full = np.iinfo(dtype).max if dtype[0] == "u" else 1
    grey = photo()[..., 0] / 255
    unit = grey if channels is None else np.repeat(grey[..., None], channels, axis=2)
    if channels == 4:
        unit[..., 3] = 1
    given = (unit * full).astype(dtype)
    one, again = (
        texforge.wang(given, set="minimal", period=PERIOD, periods=1, threads=n) for n in (1, 3)
    )
    assert one.atlas.dtype == given.dtype
    assert one.atlas.shape == (40, 112, *given.shape[2:])
    assert one.atlas.tobytes() == again.atlas.tobytes()
    assert one.plane((50, 60)).shape == (50, 60, *given.shape[2:])


def test_files_are_those_of_the_command_line(tmp_path: Path) -> None:
    texforge.write_image(tmp_path / "cloth.png", photo())
    height_map = np.random.default_rng(1).integers(0, 65536, (120, 168), dtype=np.uint16)
    texforge.write_image(tmp_path / "cloth_height.png", height_map, kind="data")
    made = texforge.wang(
        texforge.read_image(tmp_path / "cloth.png"), period=PERIOD, maps={"height": height_map}
    )
    files = made.save(tmp_path / "saved", plane=(100, 130), seed=3)
    command = [sys.executable, "-m", "texforge", "wang", "cloth.png", "-o", "run", "--seed=3"]
    command += ["--period=28x20", "--plane=130x100"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert contents(tmp_path / "saved") == contents(tmp_path / "run")
    assert {file.name for file in files} == set(contents(tmp_path / "saved"))
    document = json.loads((tmp_path / "saved" / "wang.json").read_text())
    assert [texforge.WangEdges(**tile["edges"]) for tile in document["tiles"]] == made.edges
    with pytest.raises(texforge.OutputExistsError):
        made.save(tmp_path / "saved")
    made.save(tmp_path / "saved", overwrite=True)
    with pytest.raises(texforge.MissingFileError):
        made.save(tmp_path / "no" / "folder")


BAD: dict[str, dict[str, Any]] = {
    "an unknown set": {"set": "half"},
    "a period of one number": {"period": 20},
    "no periods": {"periods": 0},
    "overlap": {"overlap": 2},
    "min_confidence": {"min_confidence": float("nan")},
    "flatten": {"flatten": 0.001},
    "scale": {"scale": "up"},
    "a tile of a few pixels": {"period": (4, 4), "periods": 1},
    "threads": {"threads": 1025},
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arguments(case: str) -> None:
    with pytest.raises(texforge.ParameterError, match=r"^`\w+` must be .+, got ") as caught:
        texforge.wang(photo(), **BAD[case])
    assert "\n" not in str(caught.value)


def test_photos_and_planes_that_cannot_be() -> None:
    with pytest.raises(texforge.NoStructureError, match="no clear period"):
        texforge.wang(noise(96, 128))
    with pytest.raises(texforge.PictureError, match="no room for four usable pieces of 140x100"):
        texforge.wang(photo(), period=PERIOD, periods=5)
    made = texforge.wang(photo(), period=PERIOD, periods=1)
    size: Any
    for size in ((0, 5), (70000, 5), (1, 2, 3), "large"):
        with pytest.raises(texforge.ParameterError):
            made.plane(size)
    with pytest.raises(texforge.ParameterError, match="name of a map"):
        made.plane(8, map="height")
    with pytest.raises(texforge.ParameterError, match="rows"):
        made.layout(0, 5)
    odd = texforge.wang(photo(), period=PERIOD, maps={"a/b": photo()})
    with pytest.raises(texforge.ParameterError, match="maps"):
        odd.save("nowhere")


def test_progress_can_cancel() -> None:
    with pytest.raises(texforge.Cancelled):
        texforge.wang(photo(), progress=lambda _: False)
