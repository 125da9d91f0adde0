"""Each code that the doctor can give is provoked by real nodes in some test."""

from __future__ import annotations

import re
from pathlib import Path

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1] / "tfcompose"
#: Where the doctor's findings are made.
MAKERS: tuple[str, ...] = (
    "observe/diagnose/*.py",
    "observe/refused.py",
    "observe/telling.py",
    "ros/misfits.py",
    "ros/settings.py",
)
MAKERS += ("verdict/poses.py", "verdict/timing.py")
#: What verdict/violation.py is asked for by codes.
OFFENCES = {"TF801", "TF802", "TF803", "TF809", "TF821"}
#: Without ROS there are no real nodes; what was sent before anybody listened only the guard can say.
ELSEWHERE = {"TF901": "observe/test_verify_bag.py", "TF850": "run/test_guard_faults_ros.py"}


def codes(texts: list[str], pattern: str) -> set[str]:
    return {code for text in texts for code in re.findall(pattern, text)}


def test_each_code_of_the_doctor_is_provoked_by_real_nodes() -> None:
    sources = [path.read_text("utf-8") for pattern in MAKERS for path in PACKAGE.glob(pattern)]
    made = codes(sources, r'finding\(\s*"(TF\d{3})"') | OFFENCES
    provoked = codes([path.read_text("utf-8") for path in HERE.glob("test_*_ros.py")], r'"(TF\d{3})"')
    for code, file in ELSEWHERE.items():
        assert code in (HERE.parent / file).read_text("utf-8")
    settings = codes([(HERE / "test_doctor_ros.py").read_text("utf-8")], r"error\[(TF\d{3})\]")
    assert len(made) > 35, "the sources are where they are looked for"
    assert made - set(ELSEWHERE) <= provoked | settings, sorted(made - provoked - settings)
