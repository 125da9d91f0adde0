"""Each code that the doctor can give is provoked by real nodes in some test."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[2]
LIVE = TESTS / "tf" / "live"
PACKAGE = TESTS.parent / "tfcompose"
#: Where the doctor's findings are made.
MAKERS = ("guard/verdict/*.py", "tf/ros/environment.py")
#: What is made by codes that are not written there.
BY_CODE = {"TF801", "TF802", "TF803", "TF809", "TF821", "TF823", "TF824", "TF825"}
#: Without ROS there are no real nodes; some only the guard can report.
ELSEWHERE = {
    "TF901": "tf/live/test_verify_bag.py",
    "TF807": "cli/test_hosts_ros.py",
    "TF829": "compiler/presets/test_driver_ros.py",
    "TF850": "guard/test_guard_faults_ros.py",
    "TF852": "guard/test_cleared_environment_ros.py",
    "TF853": "guard/adversary/test_rogues_ros.py",
    "TF854": "cli/test_up_ros.py",
    "TF860": "cli/test_joints_ros.py",
}


def codes(texts: list[str], pattern: str) -> set[str]:
    return {code for text in texts for code in re.findall(pattern, text)}


def test_each_code_of_the_doctor_is_provoked_by_real_nodes() -> None:
    sources = [path.read_text("utf-8") for pattern in MAKERS for path in PACKAGE.glob(pattern)]
    made = codes(sources, r'finding\(\s*"(TF\d{3})"') | BY_CODE
    provoked = codes(
        [path.read_text("utf-8") for path in LIVE.glob("test_*_ros.py")], r'"(TF\d{3})"'
    )
    for code, file in ELSEWHERE.items():
        assert code in (TESTS / file).read_text("utf-8")
    settings = codes([(LIVE / "test_doctor_ros.py").read_text("utf-8")], r"error\[(TF\d{3})\]")
    assert len(made) > 35, "the sources are where they are looked for"
    assert made - set(ELSEWHERE) <= provoked | settings, sorted(made - provoked - settings)
