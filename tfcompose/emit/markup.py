"""Texts as XML wants them."""

from __future__ import annotations

_ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def quoted(text: str) -> str:
    """Return the text as an attribute's value, in quotes.

    The standard library's ``quoteattr`` writes the same; to import it loads HTTP, mail and TLS.
    """
    if text.isidentifier():  # as most names are
        return f'"{text}"'
    text = text.translate(_ESCAPES)
    if '"' not in text:
        return f'"{text}"'
    return f"'{text}'" if "'" not in text else '"{}"'.format(text.replace('"', "&quot;"))


def escaped(text: str) -> str:
    """Return the text as an element's content."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
