"""What is run: photos, the ways to tile them, one run."""

from __future__ import annotations

import dataclasses
import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np

from texforge import _texforge
from texforge._api import read_image, tile
from texforge._errors import FileError, ParameterError, PictureError
from texforge._measure import texture_cost
from texforge._types import Image

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

SUFFIXES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".exr", ".bmp", ".tga", ".gif"} | {
    ".pnm",
    ".ppm",
    ".pgm",
}
"""Endings of files that are pictures."""
SHRINK = 4
"""Photos whose shorter side is longer than about this many tiles are made smaller first."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """What all runs of a study have in common."""

    size: int
    samples: int
    threads: int
    version: str


@dataclasses.dataclass(frozen=True)
class Variant:
    """A way to tile."""

    method: str
    measure: str
    """Name of the measure, with its order where it has one, such as ``moments-2``."""
    options: tuple[tuple[str, Any], ...]
    """Arguments of `tile`."""

    @property
    def name(self) -> str:
        """What it is called in plots and tables."""
        return self.method if self.measure == "none" else self.measure


BASELINE = Variant("wrap-only", "none", (("method", "wrap-only"),))


def variants(measures: Sequence[str] | None) -> list[Variant]:
    """Return the measures of this name; None: every measure of `tile`."""
    every = {variant.measure: variant for variant in _every_variant()}
    if measures is None:
        return list(every.values())
    chosen: dict[str, Variant] = {}
    for name in [measures] if isinstance(measures, str) else measures:
        of_name = {
            known: variant for known, variant in every.items() if name in (known, _family(known))
        }
        if not of_name:
            raise ParameterError(
                f"`measures` must be some of {', '.join(every)}, got {name!r}",
                fields={"name": "measures"},
            )
        chosen |= of_name
    if not chosen:
        raise ParameterError(
            f"`measures` must be some of {', '.join(every)}, got none", fields={"name": "measures"}
        )
    return list(chosen.values())


def _family(measure: str) -> str:
    return measure.rsplit("-", 1)[0]


def _every_variant() -> list[Variant]:
    schema = {param["name"]: param for param in _texforge.schema()}
    found = []
    for measure in schema["measure"]["choices"]:
        if measure == "none":
            continue
        options = (("method", "stationary"), ("measure", measure))
        if measure == "moments" and "order" in schema:
            low, high = map(int, schema["order"]["range"].split(" to "))
            found += [
                Variant("stationary", f"{measure}-{order}", (*options, ("order", order)))
                for order in range(low, high + 1)
            ]
        else:
            found.append(Variant("stationary", measure, options))
    return found


def photos(folder: Path, out: Path) -> list[str]:
    """Return the pictures below a folder, as paths in it with ``/``, sorted."""
    if not folder.is_dir():
        what = "is no folder" if folder.exists() else "does not exist"
        raise FileError(
            f"{folder} {what}; give a folder of photos", fields={"path": folder, "errno": None}
        )
    ours = out.resolve()
    if ours == folder.resolve():
        raise ParameterError(
            f"`out` must be another folder than the photos', got {out}", fields={"name": "out"}
        )
    found = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        hidden = any(part.startswith(".") for part in name.parts)
        if path.suffix.lower() not in SUFFIXES or hidden or not path.is_file():
            continue
        if not path.resolve().is_relative_to(ours):
            found.append(name.as_posix())
    if not found:
        raise PictureError(
            f"there is no picture in {folder}: no file that ends in {', '.join(sorted(SUFFIXES))}"
        )
    return found


def digest(path: Path) -> str:
    """Return what tells a file from every other."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    except OSError as error:
        raise FileError(
            f"cannot read {path}: {error.strerror}", fields={"path": path, "errno": error.errno}
        ) from None


@dataclasses.dataclass(frozen=True)
class Exemplar:
    """A photo that is ready to be tiled."""

    name: str
    digest: str
    photo: Image
    reduction: int
    """Side of the squares of pixels that were averaged."""

    @classmethod
    def read(cls, root: Path, name: str, digest: str, settings: Settings) -> Exemplar:
        """Read a photo, and make it smaller if it is much larger than the tile."""
        whole = read_image(root / name)
        reduction = max(1, int(min(whole.shape[:2]) / (SHRINK * settings.size) + 0.5))
        return cls(name, digest, reduced(whole, reduction), reduction)

    def run(
        self,
        variant: Variant,
        seed: int,
        settings: Settings,
        progress: Callable[[float], object] | None,
    ) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Make one tile and measure it; return its row, and those of its iterations."""
        made = tile(
            self.photo,
            size=settings.size,
            seed=seed,
            threads=settings.threads,
            trace=True,
            progress=progress,
            **dict(variant.options),
        )
        params = made.params
        stages = dict(made.report["seconds"])
        seconds = sum(stages.values()) - stages["trace"] - stages["costs"]
        text = texture_cost(
            made,
            self.photo,
            patch=params["patch"],
            samples=settings.samples,
            seed=seed,
            threads=settings.threads,
        )
        run = {
            "exemplar": self.name,
            "method": variant.method,
            "measure": variant.measure,
            "seed": seed,
        }
        row = {
            **run,
            "c_text": text.mean,
            "c_text_margin": text.margin,
            "c_text_bound": made.costs.texture,
            "c_stat": made.costs.stationarity,
            "total": text.mean + made.costs.stationarity,
            "seconds": round(seconds, 3),
            "iterations": len(made.trace),
            "photo_height": self.photo.shape[0],
            "photo_width": self.photo.shape[1],
            "reduction": self.reduction,
            "height": settings.size,
            "width": settings.size,
            "sigma": params["sigma"],
            "patch": params["patch"],
            "samples": settings.samples,
            "photo_sha256": self.digest,
            "version": settings.version,
        }
        steps = [
            {
                **run,
                "iteration": i,
                "level": step.level,
                "c_text_bound": step.texture,
                "c_stat": step.stationarity,
                "total_bound": step.texture + step.stationarity,
            }
            for i, step in enumerate(made.trace, 1)
        ]
        return row, steps


def reduced(photo: Image, side: int) -> Image:
    """Return the photo, averaged over squares of this many pixels a side."""
    if side == 1:
        return photo
    array = np.asarray(photo)
    height, width = (n // side for n in array.shape[:2])
    blocks = array[: height * side, : width * side].reshape(
        height, side, width, side, *array.shape[2:]
    )
    mean = blocks.mean(axis=(1, 3), dtype=np.float64)
    if array.dtype.kind in "ui":
        mean = np.rint(mean)
    return Image.tagged(mean.astype(array.dtype), photo.encoding)
