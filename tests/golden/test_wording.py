"""Golden wording: what findings of files say, in one file for each family of codes; other tests assert code and place.

They come from what people wrote for these tests, not from mutations: marked specs, bad input, values, calibrations,
presets, and URDFs of others. After an intended change: ``python -m tests.golden.test_wording --write``.
"""

from __future__ import annotations

import difflib
import os
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.golden.test_findings import CORPORA, ROOT, in_the_repository, refusals, within
from tfcompose.cli.disk import disk
from tfcompose.render.text import render_text
from tfcompose.urdf.lint import lint_urdf
from tfcompose.urdf.packages import Packages

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Finding

GOLDEN = Path(__file__).parent / "wording"
WRITTEN = ("robots", "specs", "bad_input", "values")
#: What marked specs leave out: parts, sweeps, claims of nodes.
TEXTS = [GOLDEN / "texts" / f"{name}.yaml" for name in ("claims", "fleet", "parts", "same_names", "sweeps")]
URDFS = sorted((ROOT / "tests/urdf/urdfs").glob("*.urdf"))
FAMILIES = ("TF0", "TF1", "TF2", "TF3", "TF4", "TF5", "TF6", "TF7", "TF8")


def findings() -> Iterator[Finding]:
    with in_the_repository():
        for name in WRITTEN:
            for _, _, found in CORPORA[name]():
                yield from found
        for file in TEXTS:
            os.chdir(file.parent)
            yield from refusals(lambda file=file: within(file.read_text("utf-8"), file.name))  # type: ignore[misc]
        os.chdir(ROOT)
        for file in URDFS:
            yield from lint_urdf(file.relative_to(ROOT).as_posix(), Packages(disk()))


@cache
def texts() -> dict[str, str]:
    """Return what is said, each text once, by the first three letters of its code."""
    said = {text_of(one) for one in findings()}
    return {
        family: "\n".join(sorted(text for text in said if f"[{family}" in text.partition(" ")[0]))
        for family in FAMILIES
    }


def text_of(found: Finding) -> str:
    """Return the finding as ``lint`` prints it, but for its places: those stand in the golden findings."""
    lines = render_text([found], lambda _file, _line: None, colour=False).splitlines(keepends=True)
    return lines[0].removeprefix(f"{found.span}: ") + "".join(lines[1:])


@pytest.mark.parametrize("family", FAMILIES)
def test_findings_say_what_the_golden_file_says(family: str) -> None:
    golden = (GOLDEN / f"{family}xx.txt").read_text("utf-8").splitlines(keepends=True)
    difference = list(difflib.unified_diff(golden, texts()[family].splitlines(keepends=True), "golden", "now", n=0))
    if difference:
        pytest.fail(f"{len(difference)} lines of difference\n{''.join(difference)}", pytrace=False)


if __name__ == "__main__":
    if sys.argv[1:] != ["--write"]:
        sys.exit("python -m tests.golden.test_wording --write")
    for name, text in texts().items():
        (GOLDEN / f"{name}xx.txt").write_text(text, "utf-8")
