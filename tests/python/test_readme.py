"""What the README says in tables and commands is true."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import texforge
from texforge import _texforge

from .conftest import noise

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, flags=re.MULTILINE | re.DOTALL)


def test_the_table_lists_every_parameter_its_default_and_its_words() -> None:
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in TEXT.splitlines()
        if line.startswith("| `")
    ]
    schema = _texforge.schema()
    assert [row[0] for row in rows] == [f"`{entry['name']}`" for entry in schema]
    for row, entry in zip(rows, schema, strict=True):
        assert row[1] == f"`{entry['default']}`"
        words = ", ".join(f"`{word}`" for word in entry["choices"])
        assert row[2] == (words or entry["range"])


def test_the_commands_run_as_they_stand(tmp_path: Path) -> None:
    second = ("photo_2.jpg", "scan_nrm_2.png", "scan_rough_2.png")
    for name in (
        "photo.jpg",
        "usable.png",
        "stains.png",
        "scan_nrm.png",
        "scan_rough.png",
        *second,
    ):
        array = noise(96, 128)
        array[:48] |= 128  # Usable enough as a mask.
        if name == "stains.png":
            array = np.zeros_like(array)
            array[:20, :20] = 255
        texforge.write_image(tmp_path / name, array, kind="color" if "photo" in name else "data")
    lines = [line for block in blocks("sh") for line in block.replace("\\\n", "").splitlines()]
    commands = [shlex.split(line)[1:] for line in lines if line.startswith("texforge ")]
    assert len(commands) > 5
    for command in commands:
        result = subprocess.run(
            [sys.executable, "-m", "texforge", *command],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, (command, result.stderr)
        outputs = [command[command.index("-o") + 1]] if "-o" in command else []
        if "--variants" in command:
            outputs = ["several-1.png", "several-2.png", "several-3.png"]
        if "palette" in command:
            outputs = ["choice-1.png", "choice-4.png", "choice.palette.png"]
        if "extract" in command:
            outputs = [
                f"{outputs[0]}/{name}" for name in ("tile_01.png", "tiling_01.png", "sheet.png")
            ]
        if "wang" in command:
            outputs = [f"{outputs[0]}/{name}" for name in ("tile_16.png", "atlas.png", "wang.json")]
        assert all((tmp_path / output).is_file() for output in outputs), command


def test_the_rust_example_is_the_one_that_the_crate_documents_and_tests() -> None:
    (example,) = blocks("rust")
    source = (ROOT / "src" / "lib.rs").read_text(encoding="utf-8")
    document = "\n".join(line[3:].lstrip(" ") for line in source.splitlines() if line[:3] == "//!")
    assert example.strip() in document


def test_files_that_the_readme_names_exist() -> None:
    for target in re.findall(r"\]\(([^)]+)\)", TEXT):
        assert (ROOT / target).is_file(), target
