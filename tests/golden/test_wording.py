"""Golden wording: what findings say, in one file for each family of codes.

Other tests assert code, place and names.

They come from what people wrote for these tests, not from mutations: marked specs, bad input,
values, calibrations, presets, URDFs of others, and histories of live trees and processes
(``scenes``). After an intended change: ``python -m tests.golden.test_wording --write``.
"""

import os
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.golden.scenes import SCENES
from tests.golden.test_findings import CORPORA, ROOT, in_the_repository, refusals, within
from tests.support.goldens import compare, write
from tfcompose.cli.compiling import disk
from tfcompose.compiler.render.text import render_text
from tfcompose.compiler.urdf.lint import lint_urdf
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Finding

GOLDEN = Path(__file__).parent / "wording"
IN_SOURCE = ("robots", "specs", "bad_input", "values")
#: What marked specs leave out: parts, sweeps, claims of nodes.
TEXTS = [
    GOLDEN / "texts" / f"{name}.yaml"
    for name in ("claims", "fleet", "parts", "same_names", "sweeps")
]
URDFS = sorted((ROOT / "tests/compiler/urdf/urdfs").glob("*.urdf"))
FAMILIES = ("TF0", "TF1", "TF2", "TF3", "TF4", "TF5", "TF6", "TF7", "TF8", "TF9")


def findings() -> Iterator[Finding]:
    with in_the_repository():
        for name in IN_SOURCE:
            for _, _, findings in CORPORA[name]():
                yield from findings
        for file in TEXTS:
            os.chdir(file.parent)
            yield from refusals(lambda file=file: within(file.read_text("utf-8"), file.name))  # type: ignore[misc]
        os.chdir(ROOT)
        for file in URDFS:
            yield from lint_urdf(file.relative_to(ROOT).as_posix(), Packages(disk()))
        for scene in SCENES:
            yield from scene()


@cache
def texts() -> dict[str, str]:
    """Return what is said, each text once, by its family: TF1xx."""
    output = {text_of(finding) for finding in findings()}
    return {
        f"{family}xx": "\n".join(
            sorted(text for text in output if f"[{family}" in text.partition(" ")[0])
        )
        for family in FAMILIES
    }


def text_of(finding: Finding) -> str:
    """Return the finding as ``lint`` prints it, but for its places.

    Those stand in the golden findings.
    """
    lines = render_text([finding], lambda _file, _line: None, colour=False).splitlines(
        keepends=True
    )
    return (lines[0].removeprefix(f"{finding.span}: ") + "".join(lines[1:])).replace(
        f"{ROOT}/", ""
    )


def test_findings_say_what_the_golden_files_say_and_every_code_is_there() -> None:
    """All in one test, since all families come from one look at everything."""
    compare(GOLDEN, texts())
    assert {code for text in texts().values() for code in re.findall(r"\[(TF\d+)\]", text)} == set(
        CATALOGUE
    )


if __name__ == "__main__":
    write(GOLDEN, texts())
