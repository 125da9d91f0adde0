"""Golden files: what build writes for the example robots, byte for byte.

After an intended change: ``TFCOMPOSE_UPDATE_GOLDEN=1 pytest tests/golden``, and read the
difference.
"""

import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.cli import tfcompose, tfcompose_in

HERE = Path(__file__).parent
ROBOTS = HERE.parents[1] / "robots"
CASES = {
    "my_robot": ("my_robot.yaml",),
    "two_rovers": ("two_rovers.yaml",),
    "autonomous_robot": ("autonomous_robot.yaml",),
    "autonomous_robot.demo": ("autonomous_robot.yaml", "--profile", "demo"),
    "car_roof": ("car_roof.yaml",),
    "field_rover": ("field_rover.yaml",),
    "house_robot": ("house_robot.yaml",),
    "picker": ("picker.yaml",),
}


def build(words: tuple[str, ...], output: Path, cwd: Path, **environment: str) -> dict[str, bytes]:
    """Build in a separate process and return the files by their path in the output folder."""
    processes.run(
        [sys.executable, "-m", "tfcompose", "build", *words, "-o", str(output)],
        cwd=cwd,
        env=os.environ | environment,
        check=True,
    )
    return contents(output)


def contents(folder: Path) -> dict[str, bytes]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@pytest.mark.parametrize("case", CASES)
def test_build_writes_the_golden_files_byte_for_byte(case: str, tmp_path: Path) -> None:
    file, *options = CASES[case]
    done = tfcompose_in(
        HERE.parents[1], "build", f"robots/{file}", *options, "-o", tmp_path / "out"
    )
    assert done.returncode == 0, done.stderr
    built = contents(tmp_path / "out")
    golden = HERE / case
    if os.environ.get("TFCOMPOSE_UPDATE_GOLDEN"):
        shutil.rmtree(golden, ignore_errors=True)
        shutil.copytree(tmp_path / "out", golden)
    assert built == contents(golden)


@pytest.mark.parametrize(
    ("case", "is_absolute"), [(case, number % 2 == 0) for number, case in enumerate(CASES)]
)
def test_files_do_not_depend_on_folder_path_spelling_or_hash_seed(
    case: str, tmp_path: Path, *, is_absolute: bool
) -> None:
    file, *options = CASES[case]
    shutil.copytree(ROBOTS, tmp_path, dirs_exist_ok=True)
    path = str(ROBOTS / file) if is_absolute else f"../{tmp_path.name}/{file}"
    seed = str(int(is_absolute))
    built = build((path, *options), tmp_path / "out", tmp_path, PYTHONHASHSEED=seed)
    assert built == contents(HERE / case)


@pytest.mark.parametrize("case", CASES)
def test_building_over_an_earlier_build_leaves_the_same_files(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(HERE.parents[1])
    for earlier_case in (
        "autonomous_robot",
        "my_robot",
        case,
    ):  # the first has a parameter file that the others have not
        file, *options = CASES[earlier_case]
        tfcompose("build", f"robots/{file}", *options, "-o", tmp_path)
    assert contents(tmp_path) == contents(HERE / case)


@pytest.mark.parametrize("case", CASES)
def test_no_file_holds_an_absolute_path_or_a_date(case: str) -> None:
    for name, data in contents(HERE / case).items():
        text = data.decode()
        for root in ("/home", "/tmp", "/usr", "/opt", "/root", str(ROBOTS.parent)):
            assert root not in text, name
        assert not re.search(r"\b20\d\d-\d\d|\b\d\d:\d\d:\d\d", text), name
        assert text.endswith("\n")
        assert "\r" not in text
        assert "-0.0" not in re.sub(r"-0\.0\d*[1-9]", "", text), f"{name} holds a negative zero"
