"""A drawing as PDF 1.4 (ISO 32000-1), one page of its size, in Helvetica.

Written here, because svglib with reportlab draws our SVG alike but takes 20 times as long, gives
other bytes each time and loses characters beyond Latin-1, and CairoSVG takes whatever font and
libcairo the system has.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

from tfcompose.compiler.draw.picture import Box, Curve, Text
from tfcompose.compiler.draw.style import style_of, width_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.draw.picture import Drawing
    from tfcompose.compiler.draw.style import Style

POINTS_PER_PX = 0.75
MOST_POINTS = 14_400.0  # the longest side that readers open
ROUND = 0.5523  # where the control points of a quarter of a circle are, in radii


def pdf(drawing: Drawing) -> bytes:
    """Return the drawing as a PDF of one page; a very long one is made smaller.

    The same drawing gives the same bytes.

    Characters that Helvetica in the encoding of Windows does not have are written as escapes.
    """
    scale = min(POINTS_PER_PX, MOST_POINTS / max(drawing.width, drawing.height))
    width, height = drawing.width * scale, drawing.height * scale
    paper = Box(0.0, 0.0, drawing.width, height=drawing.height, radius=0.0, style="paper")
    content = f"{scale:.6f} 0 0 {-scale:.6f} 0 {_number(height)} cm\n"  # px, y down
    content += "".join([part for shape in (paper, *drawing.shapes) for part in _shape(shape)])
    data = zlib.compress(content.encode("latin-1"), 9)
    fonts = "/F1 5 0 R /F2 6 0 R"
    title = drawing.title.encode("utf-16-be", "surrogatepass").hex().upper()
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {_number(width)} {_number(height)}]"
        f" /Contents 4 0 R /Resources << /Font << {fonts} >> >> >>".encode(),
        b"<< /Length %d /Filter /FlateDecode >>\nstream\n%s\nendstream" % (len(data), data),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica-Bold /Encoding /WinAnsiEncoding >>",
        f"<< /Title <FEFF{title}> /Producer (tfcompose) >>".encode(),
    ]
    return _file(objects)


def _file(objects: list[bytes]) -> bytes:
    data = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n"
    table = b"0000000000 65535 f \n"
    for number, body in enumerate(objects, 1):
        table += b"%010d 00000 n \n" % len(data)
        data += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    end = b"trailer\n<< /Size %d /Root 1 0 R /Info %d 0 R >>\nstartxref\n%d\n%%%%EOF\n"
    count = len(objects) + 1
    return data + b"xref\n0 %d\n%s" % (count, table) + end % (count, len(objects), len(data))


def _shape(shape: Box | Curve | Text) -> Iterator[str]:
    style = style_of(shape.style)
    if isinstance(shape, Text):
        yield _text(shape, style)
        return
    if style.fill[0] and isinstance(shape, Box):
        yield f"{_colour(style.fill[0])} rg "
    if style.stroke[0]:
        dash = " ".join(map(_number, style.dash))
        yield f"{_colour(style.stroke[0])} RG {_number(style.width)} w [{dash}] 0 d "
    yield _curve(shape) if isinstance(shape, Curve) else _box(shape)
    ending = "S" if isinstance(shape, Curve) else "B" if style.stroke[0] else "f"
    yield f"{ending}\n"


def _curve(curve: Curve) -> str:
    start, *others = [_point(x, y) for x, y in curve.points]
    ways = (" ".join(others[at : at + 3]) for at in range(0, len(others), 3))
    return f"{start} m {' c '.join(ways)} c "


def _box(box: Box) -> str:
    left, top, right, bottom = box.x, box.y, box.x + box.width, box.y + box.height
    if not box.radius:
        return f"{_point(left, top)} {_point(box.width, box.height)} re "
    radius = min(box.radius, box.width / 2, box.height / 2)
    pull = radius * (1 - ROUND)
    corners = (
        ((right - radius, top), (right - pull, top), (right, top + pull), (right, top + radius)),
        (
            (right, bottom - radius),
            (right, bottom - pull),
            (right - pull, bottom),
            (right - radius, bottom),
        ),
        (
            (left + radius, bottom),
            (left + pull, bottom),
            (left, bottom - pull),
            (left, bottom - radius),
        ),
        ((left, top + radius), (left, top + pull), (left + pull, top), (left + radius, top)),
    )
    way = f"{_point(left + radius, top)} m "
    for start, *curve in corners:
        way += f"{_point(*start)} l {' '.join(_point(*point) for point in curve)} c "
    return f"{way}h "


def _text(text: Text, style: Style) -> str:
    """Return the text in the space that it has: narrower where the font is wider than assumed."""
    data = text.text.encode("cp1252", "backslashreplace")
    wide = width_of(data.decode("cp1252"), style.size, bold=style.bold)
    narrow = min(1.0, text.width / wide) if wide else 1.0
    x = text.x - wide * narrow / 2 if text.middle else text.x
    font = "F2" if style.bold else "F1"
    return (
        f"BT {_colour(style.fill[0])} rg /{font} {_number(style.size)} Tf {100 * narrow:.2f} Tz "
        f"1 0 0 -1 {_point(x, text.y)} Tm <{data.hex().upper()}> Tj ET\n"
    )


def _colour(digits: str) -> str:
    return " ".join(f"{int(digits[at : at + 2], 16) / 255:.3f}" for at in (0, 2, 4))


def _point(x: float, y: float) -> str:
    return f"{_number(x)} {_number(y)}"


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")
