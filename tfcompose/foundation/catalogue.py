"""The catalogue of findings: a Markdown file for each code, with name, family, severity and page.

A file ``CODE.md`` begins with ``key: value`` lines between two lines ``---``. Below is the page
that ``tfcompose explain CODE`` prints: the fault in a sentence, then its consequences and the
remedy. A code is never reused for another meaning.

Every process that can report findings loads this module. A file is read when its code is first
needed. The codes of tools are in the tools' folders, which are searched after the core's folder.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeVar, get_args

from tfcompose.foundation.tool import absent, code_folders

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

Severity = Literal["error", "warning"]

#: The origin of a finding. ``doctor`` and ``verify`` also report the guard's codes, about the live
#: tree.
Family = Literal[
    "load",
    "language",
    "tree",
    "ownership",
    "poses",
    "names",
    "sensors",
    "bodies",
    "processes",
    "guard",
    "live",
    "environment",
]
FAMILIES: tuple[Family, ...] = get_args(Family)
SEVERITIES: tuple[Severity, ...] = get_args(Severity)

#: Families of tfcompose's codes, by their first digit. The files of TF8 codes, and of codes with
#: another prefix, name the family.
_BY_DIGIT: dict[str, Family] = {
    "0": "load",
    "1": "language",
    "2": "tree",
    "3": "ownership",
    "4": "poses",
    "5": "names",
    "6": "sensors",
    "7": "bodies",
    "9": "environment",
}

_Member = TypeVar("_Member", bound=str)

_DIGITS = 3
#: Units of limits, each with the divisor that converts it to SI, and the SI unit; % is a fraction.
_UNITS = {
    "m": (1.0, "m"),
    "cm": (100.0, "m"),
    "deg": (57.29577951308232, "rad"),  # 180/π; importing math would be slow
    "%": (100.0, "%"),
}
_KEYS = frozenset({"name", "severity", "family", "unbuildable", "limit"})


@dataclass(frozen=True, slots=True)
class Code:
    """A kind of finding."""

    code: str
    name: str
    family: Family
    #: The default severity of its findings.
    severity: Severity
    #: Whether the finding prevents a build. Examples are a robot without a tree, an edge without a
    #: publisher, and a process that never starts.
    unbuildable: bool = False
    #: The default of the limit that ``rules`` can set, in SI, and its unit: m, rad or %.
    limit: tuple[float, str] | None = None

    @property
    def can_be_allowed(self) -> bool:
        """Whether a comment or an entry of ``rules`` may silence the finding.

        A finding about a file that was not understood cannot be silenced.
        """
        return not self.unbuildable and self.family not in {"load", "language"}


class Catalogue(Mapping[str, Code]):
    """The codes in a list of folders, in alphabetical order."""

    def __init__(self, *folders: Path, more: Callable[[], Iterable[Path]] = tuple) -> None:
        """Use the codes in the folders, then those in folders that ``more`` returns on demand."""
        self._folders = folders
        self._more = more
        self._codes: dict[str, Code] = {}

    def load(self) -> None:
        """Read every code of the core now.

        A process that runs for a long time then does not depend on the files.
        """
        for code in _codes_in(self._folders):
            self[code]

    def page(self, code: str) -> str:
        """Return the page of a code in Markdown.

        Raises:
            KeyError: if there is no such code.
            ValueError: if its file is invalid.
        """
        return _parts(code, self._text(code))[1].rstrip("\n")

    def summary(self, code: str) -> str:
        """Return the first sentence of a code's page on a single line.

        Raises:
            KeyError: if there is no such code.
            ValueError: if its file is invalid.
        """
        return " ".join(self.page(code).partition("\n\n")[0].split())

    def __getitem__(self, code: str) -> Code:
        if code not in self._codes:
            self._codes[code] = read_code(code, self._text(code))
        return self._codes[code]

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(_codes_in(self._all_folders())))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def _all_folders(self) -> Iterator[Path]:
        """Yield the folders, then the folders from ``more``, which is called only when reached."""
        yield from self._folders
        yield from self._more()

    def _text(self, code: str) -> str:
        for folder in self._all_folders() if _is_code(code) else ():
            try:
                return (folder / f"{code}.md").read_text("utf-8")
            except FileNotFoundError:
                continue
        raise KeyError(code)


def _codes_in(folders: Iterable[Path]) -> set[str]:
    """Return the codes with pages in the folders."""
    pages = {file.stem for folder in folders for file in folder.glob("*.md")}
    return {page for page in pages if _is_code(page)}


def read_code(code: str, text: str) -> Code:
    """Return the code that the text of a file describes.

    Raises:
        ValueError: if the text has no head or no page, or the head has invalid keys or values.
    """
    head, _ = _parts(code, text)
    lines = [line.partition(": ") for line in head.splitlines()]
    values = {key: value for key, _, value in lines}
    if unknown := [key for key in values if key not in _KEYS]:
        raise ValueError(f"{code}: unknown keys in its head: {', '.join(unknown)}")
    if len(values) < len(lines):
        raise ValueError(f"{code}: a key occurs twice in its head")
    default = _BY_DIGIT.get(code[2], "") if code.startswith("TF") else ""
    family = _member(code, "family", values.get("family", default), FAMILIES)
    severity = _member(code, "severity", values.get("severity", ""), SEVERITIES)
    name, unbuildable = values.get("name", ""), values.get("unbuildable", "false")
    if not (name.isascii() and name.isidentifier() and name.islower()):
        raise ValueError(f"{code}: name: {name!r} is not in lower case with underscores")
    return Code(
        code,
        name,
        family=family,
        severity=severity,
        unbuildable=_member(code, "unbuildable", unbuildable, ("true", "false")) == "true",
        limit=_limit(code, values["limit"]) if "limit" in values else None,
    )


def _parts(code: str, text: str) -> tuple[str, str]:
    before, begin, rest = text.partition("---\n")
    head, end, page = rest.partition("\n---\n\n")
    if before or not begin or not end or not page.strip():
        raise ValueError(f"{code}: its file needs a head between lines ---, and a page below")
    return head, page


def _member(code: str, key: str, value: str, members: tuple[_Member, ...]) -> _Member:
    for member in members:
        if member == value:
            return member
    raise ValueError(f"{code}: {key}: {value!r} is none of {', '.join(members)}")


def _limit(code: str, text: str) -> tuple[float, str]:
    number, _, unit = text.partition(" ")
    if unit not in _UNITS or not number.replace(".", "", 1).isdecimal():
        raise ValueError(f"{code}: limit: {text!r} is no number with one of {', '.join(_UNITS)}")
    divisor, si = _UNITS[unit]
    return float(number) / divisor, si


def _is_code(text: str) -> bool:
    """Return whether the text has the form of a code: upper case letters, and three digits."""
    prefix, number = text[:-_DIGITS], text[-_DIGITS:]
    return text.isascii() and prefix.isalpha() and prefix.isupper() and number.isdecimal()


CATALOGUE = Catalogue(Path(__file__).parents[1] / "data" / "codes", more=code_folders)


def code_of(name: str) -> str | None:
    """Return the code for a code in any case or for a name, None if unknown."""
    upper = name.upper()
    if upper in CATALOGUE:
        return upper
    return next((code.code for code in CATALOGUE.values() if code.name == name), None)


def absent_code(name: str) -> str:
    """Return how to install the missing tool that has this code or name, "" without one."""
    return absent(name.upper(), "code") or absent(name, "rule")


def similar_words(name: str) -> list[str]:
    """Return the codes and names that are similar to an unknown word.

    Nothing is similar to a complete code such as TF999.
    """
    if _is_code(name.upper()):
        return []
    return [*CATALOGUE, *(code.name for code in CATALOGUE.values())]


def can_be_allowed(code: str) -> bool:
    """Return whether findings with the code can be silenced. Unknown codes cannot."""
    return code in CATALOGUE and CATALOGUE[code].can_be_allowed
