"""Python source code that is broken into short lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

#: The maximum length of a line. A single token may be longer.
_WIDTH = 100


@dataclass(frozen=True, slots=True)
class CodeBlock:
    """A bracketed expression, such as a call: opening text, parts, and closing text."""

    begin: str
    parts: tuple[CodeBlock | str, ...]
    end: str

    def __str__(self) -> str:
        return f"{self.begin}{', '.join(map(str, self.parts))}{self.end}"

    def lines(self, indent: str = "", end: str = "") -> Iterator[str]:
        """Yield the expression on a single line if it fits, else a line for each part."""
        if len(indent) + len(str(self)) + len(end) <= _WIDTH:
            yield f"{indent}{self}{end}"
            return
        yield f"{indent}{self.begin}"
        for part in self.parts:
            yield from (
                [f"{indent}    {part},"]
                if isinstance(part, str)
                else part.lines(f"{indent}    ", ",")
            )
        yield f"{indent}{self.end}{end}"


def call(name: str, *parts: CodeBlock | str) -> CodeBlock:
    """Return a function call."""
    return CodeBlock(f"{name}(", parts, ")")


def items(parts: Iterable[CodeBlock | str], keyword: str = "") -> CodeBlock:
    """Return a list or, with ``keyword``, a keyword argument whose value is a list."""
    return CodeBlock(f"{keyword}=[" if keyword else "[", tuple(parts), "]")


def keyword(name: str, value: CodeBlock | str) -> CodeBlock | str:
    """Return the keyword argument ``name=value``."""
    return (
        f"{name}={value}"
        if isinstance(value, str)
        else CodeBlock(f"{name}={value.begin}", value.parts, value.end)
    )
