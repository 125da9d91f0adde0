"""A drawing as PNG: resvg renders its SVG, with the font Lato from the package ``font_lato``.

System fonts supply only the characters that Lato lacks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from font_lato import font_directory
from resvg_py import svg_to_bytes

from tfcompose.compiler.draw.svg import svg

if TYPE_CHECKING:
    from tfcompose.compiler.draw.picture import Drawing

PIXELS_PER_PX = 2.0  # for high-density screens and for print
MOST_PIXELS = 50e6
MOST_TO_A_SIDE = 32_000.0  # viewers store a length in 15 bits


def png(drawing: Drawing) -> bytes:
    """Return the drawing as PNG at two pixels per px; a very large drawing gets fewer."""
    scale = min(
        PIXELS_PER_PX,
        (MOST_PIXELS / (drawing.width * drawing.height)) ** 0.5,
        MOST_TO_A_SIDE / max(drawing.width, drawing.height),
    )
    return svg_to_bytes(
        svg_string=svg(drawing),
        zoom=scale,
        font_dirs=[font_directory],
        style_sheet="svg{font-family:Lato}",
    )
