"""Python source with short lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

#: The longest line, except for a longer single word.
_WIDTH = 100


@dataclass(frozen=True, slots=True)
class CodeBlock:
    """A bracketed expression: the text before its parts, the parts, and the text after them."""

    begin: str
    parts: tuple[CodeBlock | str, ...]
    end: str

    def __str__(self) -> str:
        return f"{self.begin}{', '.join(map(str, self.parts))}{self.end}"

    def lines(self, indent: str = "", end: str = "") -> Iterator[str]:
        """Yield one line if it is short enough, else one line per part."""
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
    """Return a list, or a keyword argument that is one."""
    return CodeBlock(f"{keyword}=[" if keyword else "[", tuple(parts), "]")


def keyword(name: str, value: CodeBlock | str) -> CodeBlock | str:
    """Return a keyword argument."""
    return (
        f"{name}={value}"
        if isinstance(value, str)
        else CodeBlock(f"{name}={value.begin}", value.parts, value.end)
    )
