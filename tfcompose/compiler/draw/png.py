"""A drawing as PNG: the PDF rendered by PDFium from the package ``pypdfium2``."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import pypdfium2

from tfcompose.compiler.draw.pdf import POINTS_PER_PX, pdf

if TYPE_CHECKING:
    from tfcompose.compiler.draw.picture import Drawing

PIXELS_PER_PX = 2.0  # for screens that have them, and for print
MOST_PIXELS = 50e6
MOST_TO_A_SIDE = 32_000.0  # viewers count these in 15 bits


def png(drawing: Drawing) -> bytes:
    """Return the drawing as PNG with two pixels to a px, fewer for a very large one."""
    finest = min(
        (MOST_PIXELS / (drawing.width * drawing.height)) ** 0.5,
        MOST_TO_A_SIDE / max(drawing.width, drawing.height),
    )
    document = pypdfium2.PdfDocument(pdf(drawing))
    try:
        page = document[0]
        points = page.get_width() / drawing.width  # to a px
        scale = min(PIXELS_PER_PX, finest, PIXELS_PER_PX * points / POINTS_PER_PX * 4) / points
        bitmap = page.render(scale=scale, rev_byteorder=True)
        return _png(
            bitmap.width, bitmap.height, bitmap.stride, bitmap.n_channels, bytes(bitmap.buffer)
        )
    finally:
        document.close()


def _png(width: int, height: int, stride: int, channels: int, pixels: bytes) -> bytes:
    """Return rows of pixels (red, green, blue, and what follows for the fourth channel) as PNG."""
    kind = {3: 2, 4: 6}[channels]
    rows = b"".join(
        b"\0" + pixels[row * stride : row * stride + width * channels] for row in range(height)
    )
    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 6)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, data) for name, data in parts)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
