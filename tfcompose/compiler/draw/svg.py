"""A drawing as SVG with a style sheet for light and dark mode, in common fonts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.compiler.draw.picture import Box, Curve
from tfcompose.compiler.draw.style import SANS, STYLES
from tfcompose.foundation.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.draw.picture import Drawing, Shape, TextLine
    from tfcompose.compiler.draw.style import Style

_ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"})


def svg(drawing: Drawing) -> str:
    """Return the drawing as SVG; the same drawing always gives the same text.

    Each edge is a path with a title, which browsers show as a tooltip.
    """
    width, height = f"{drawing.width:g}", f"{drawing.height:g}"
    title = _text(drawing.title)
    body = "".join([_shape(shape) for shape in drawing.shapes])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0'
        f' {width} {height}"'
        f' role="img" font-family="{SANS}">\n'
        f"<title>{title}</title>\n"
        f"<style>\n{''.join(_sheet(drawing))}</style>\n"
        f'<rect class="paper" width="{width}" height="{height}" rx="6"/>\n'
        f"{body}</svg>\n"
    )


def _sheet(drawing: Drawing) -> Iterator[str]:
    """Yield the style rules that the drawing uses, and their dark-mode colours."""
    used = {"paper", *(name for shape in drawing.shapes for name in shape.style.split())}
    styles = {name: style for name, style in STYLES.items() if name in used}
    yield "path{fill:none}\n"
    for name, style in styles.items():
        rule = ";".join([*_colours(style, 0), *_form(style)])
        yield f".{name}{{{rule}}}\n" if rule else ""
    yield "@media screen and (prefers-color-scheme:dark){\n"
    for name, style in styles.items():
        rule = ";".join(_colours(style, 1))
        yield f".{name}{{{rule}}}\n" if rule else ""
    yield "}\n"


def _colours(style: Style, dark: int) -> Iterator[str]:
    if style.fill[dark]:
        yield f"fill:#{style.fill[dark]}"
    if style.stroke[dark]:
        yield f"stroke:#{style.stroke[dark]}"


def _form(style: Style) -> Iterator[str]:
    if style.width:
        yield f"stroke-width:{style.width:g}"
    if style.dash:
        yield f"stroke-dasharray:{' '.join(map(str, style.dash))}"
    if style.size:
        yield f"font-size:{style.size:g}px"
    if style.bold:
        yield "font-weight:bold"


def _shape(shape: Shape) -> str:
    if isinstance(shape, Box):
        return (
            f'<rect class="{shape.style}" x="{shape.x:g}" y="{shape.y:g}"'
            f' width="{shape.width:g}" height="{shape.height:g}" rx="{shape.radius:g}"/>\n'
        )
    if isinstance(shape, Curve):
        return _curve(shape)
    return _line(shape)


def _curve(curve: Curve) -> str:
    start, *rest = [f"{x:g} {y:g}" for x, y in curve.points]
    way = f"M{start}H{curve.points[-1][0]:g}" if curve.straight else f"M{start}C{' '.join(rest)}"
    if not curve.about:
        return f'<path class="{curve.style}" d="{way}"/>\n'
    return f'<path class="{curve.style}" d="{way}"><title>{_text(curve.about)}</title></path>\n'


def _line(text: TextLine) -> str:
    """Return a text element with a fixed length, so that the text fits its box in any font."""
    where = f'class="{text.style}" x="{text.x:g}" y="{text.y:g}"'
    if text.middle:
        return f'<text {where} text-anchor="middle">{_text(text.text)}</text>\n'
    long = f'textLength="{text.width:g}" lengthAdjust="spacingAndGlyphs"'
    return f"<text {where} {long}>{_text(text.text)}</text>\n"


def _text(text: str) -> str:
    if text.isidentifier():
        return text
    text = visible(text)
    return (
        text.translate(_ESCAPES)
        if "&" in text or "<" in text or ">" in text or '"' in text
        else text
    )
