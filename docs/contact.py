"""Contact sheets: labelled pictures side by side, for people to look at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageDraw
from texforge import _arrays

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import texforge

Cell = tuple[str, Image.Image]

_MARGIN = 12
_LABEL = 18


def shown(image: npt.NDArray[Any], encoding: texforge.Encoding) -> Image.Image:
    """Return an array as an 8-bit RGB image; transparent parts over grey."""
    array = _arrays.displayable(image, encoding)
    if array is None:
        array = _arrays.displayable(image[:, :, :1], encoding)
    if array is None:
        raise ValueError(f"a picture of shape {image.shape} cannot be shown")
    color = np.repeat(array[:, :, :1], 3, axis=2) if array.shape[2] < 3 else array[:, :, :3]
    picture = Image.fromarray(np.ascontiguousarray(color))
    if array.shape[2] in (2, 4):
        alpha = Image.fromarray(np.ascontiguousarray(array[:, :, -1]))
        picture = Image.composite(picture, Image.new("RGB", picture.size, (128, 128, 128)), alpha)
    return picture


def fitted(picture: Image.Image, side: int) -> Image.Image:
    """Return the picture, made smaller if a side is longer than this."""
    scale = side / max(picture.size)
    if scale >= 1:
        return picture
    width, height = (max(1, round(n * scale)) for n in picture.size)
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def sheet(rows: Sequence[Sequence[Cell]]) -> Image.Image:
    """Return rows of pictures with a label above each."""
    n_columns = max(len(row) for row in rows)
    widths = [
        max((row[i][1].width for row in rows if i < len(row)), default=0) for i in range(n_columns)
    ]
    heights = [max(picture.height for _, picture in row) for row in rows]
    total_width = sum(widths) + _MARGIN * (n_columns + 1)
    total_height = sum(heights) + (_LABEL + _MARGIN) * len(rows) + _MARGIN
    page = Image.new("RGB", (total_width, total_height), "white")
    draw = ImageDraw.Draw(page)
    y = _MARGIN
    for row, height in zip(rows, heights, strict=True):
        x = _MARGIN
        for (label, picture), width in zip(row, widths, strict=False):
            draw.text((x, y), label, fill="black")
            page.paste(picture, (x, y + _LABEL))
            x += width + _MARGIN
        y += _LABEL + height + _MARGIN
    return page
