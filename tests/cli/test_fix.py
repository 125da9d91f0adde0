"""``lint --fix`` applies fixes with one safe answer and leaves every other byte."""

import errno
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import processes
from tests.support.cli import tfcompose_in
from tfcompose.cli.compiling import library
from tfcompose.cli.fixing import Fixer, rewrite
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.findings import (
    Edit,
    Finding,
    RejectedError,
    Span,
    apply_edits,
    finding,
    slip_of,
)
from tfcompose.spec.language import with_includes
from tfcompose.spec.load import load

HEAD = "tfcompose: 1  # version\nrobot: r\n"
PRESETS = library()
EXAMPLES_OF_ROBOTS = [
    file.read_text("utf-8") for file in (Path(__file__).parents[2] / "robots").glob("*.yaml")
]
#: Those of one file.
ROBOTS = [text for text in EXAMPLES_OF_ROBOTS if "\nparts:" not in text]


def lint(file: str, read: Callable[[str], str]) -> list[Finding]:
    return list(compile_robot(read(file), file, PRESETS, read=read).findings)


def fixed(folder: Path, text: str) -> str:
    """Return what the file holds after ``--fix``."""
    file = folder / "r.yaml"
    file.write_bytes(text.encode())
    fixer = Fixer([str(file)], lint)
    fixer.fix(str(file))
    fixer.write()
    return file.read_bytes().decode()


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return tfcompose_in(folder, "lint", "--fix", *words)


PAIR = "links: {a: {}, b: {parent: a, "
LINK = "links: {base_link: {}, camera_link: {parent: base_link}}\nframes:\n"
OPTICAL = f"{LINK}  camera_optical_frame"
SHARED = f"{LINK}  p: {{parent: base_link}}\n  camera_optical_frame"
EXAMPLES = {
    "a key": ("links: {a: {}, b: {parnet: a}} # c\n", "links: {a: {}, b: {parent: a}} # c\n"),
    "a key in quotes": (
        "links: {a: {}, b: {'parnet' : a}}\n",
        "links: {a: {}, b: {'parent' : a}}\n",
    ),
    "a key in another case": (
        "links: {a: {}, b: {Parent: a}}\n",
        "links: {a: {}, b: {parent: a}}\n",
    ),
    "a section": ("link:  # bodies\n  a: {}\n", "links:  # bodies\n  a: {}\n"),
    "two keys at once": (
        "links: {a: {}, b: {paent: a, yxz: [1, 0, 0]}}\n",
        "links: {a: {}, b: {parent: a, xyz: [1, 0, 0]}}\n",
    ),
    "a unit": (PAIR + "xyz: [0, 3 Cm , 1]}}\n", PAIR + "xyz: [0, 3 cm , 1]}}\n"),
    "a unit in quotes": (PAIR + 'xyz: [0, "3 metres", 1]}}\n', PAIR + 'xyz: [0, "3 m", 1]}}\n'),
    "a unit by its dimension": (
        "links:\n  a: {}\n  b:\n    parent: a\n    rpy: [0, 9 degs, 1]  # d\n",
        "links:\n  a: {}\n  b:\n    parent: a\n    rpy: [0, 9 deg, 1]  # d\n",
    ),
    "an optical frame in braces": (
        f"{OPTICAL}: {{ parent: camera_link }} # z\n",
        f"{OPTICAL}: {{ parent: camera_link, rpy: [-90 deg, 0, -90 deg] }} # z\n",
    ),
    "an optical frame in lines": (
        f"{OPTICAL}:\n      parent: camera_link   # where\n      xyz: [0, 0, 1]\n",
        (
            f"{OPTICAL}:\n      parent: camera_link   # where\n      rpy: [-90 deg, 0, -90 deg]\n "
            "     xyz: [0, 0, 1]\n"
        ),
    ),
    "an optical frame at the end of a file that does not end its line": (
        f"{OPTICAL}:\n    parent: camera_link",
        f"{OPTICAL}:\n    parent: camera_link\n    rpy: [-90 deg, 0, -90 deg]",
    ),
    "an optical frame that is off, as a list of lines": (
        (
            f"{OPTICAL}:\n    parent: camera_link\n    rpy:\n    - -1.5  # a\n    - 0\n    -"
            " -1.6\n    # b\n"
        ),
        (
            f"{OPTICAL}:\n    parent: camera_link\n    rpy:\n    - -90 deg  # a\n    - 0\n    -"
            " -90 deg\n    # b\n"
        ),
    ),
    "an optical frame with a quaternion": (
        f"{OPTICAL}: {{parent: camera_link, quat_xyzw: [0, 0, 0, 1]}}\n",
        f"{OPTICAL}: {{parent: camera_link, quat_xyzw: [-0.5, 0.5, -0.5, 0.5]}}\n",
    ),
    "an optical frame with a matrix": (
        f"{OPTICAL}: {{parent: camera_link, matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}\n",
        f"{OPTICAL}: {{parent: camera_link, matrix: [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]}}\n",
    ),
    "an optical frame with an axis": (
        f"{OPTICAL}: {{parent: camera_link, axis_angle: {{angle: 0, axis: [1, 1, 1]}}}}\n",
        f"{OPTICAL}: {{parent: camera_link, axis_angle: {{angle: 120 deg, axis: [-1, 1, -1]}}}}\n",
    ),
    "an optical frame that looks back": (
        f"{OPTICAL}: {{parent: camera_link, look: backward}}\n",
        f"{OPTICAL}: {{parent: camera_link, look: forward}}\n",
    ),
    "an optical frame of which one angle is right, and shared": (
        (
            f"{SHARED}: {{parent: camera_link, rpy: [-90 deg, &z 0, -1.5]}}\n  q: {{parent: p,"
            " rpy: [*z, 1, 1]}\n"
        ),
        (
            f"{SHARED}: {{parent: camera_link, rpy: [-90 deg, &z 0, -90 deg]}}\n  q: {{parent: p,"
            " rpy: [*z, 1, 1]}\n"
        ),
    ),
    "what is safe beside what is not": (
        "links: {a: {}, b: {parnet: c}, d: {parnet: a}, e: {parnet: f}, g: {parnet: a}}\n",
        "links: {a: {}, b: {parnet: c}, d: {parent: a}, e: {parnet: f}, g: {parent: a}}\n",
    ),
    "what can be fixed beside what cannot": (
        "links: {a: {}, b: {paent: a, xyz: [0, 0, 1 zorkmid]}}\n",
        "links: {a: {}, b: {parent: a, xyz: [0, 0, 1 zorkmid]}}\n",
    ),
}


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("newline", ["\n", "\r\n"], ids=["LF", "CRLF"])
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["", "BOM"])
def test_it_writes_what_is_meant_and_keeps_all_other_bytes(
    name: str, newline: str, mark: str, tmp_path: Path
) -> None:
    before, after = (mark + (HEAD + text).replace("\n", newline) for text in EXAMPLES[name])
    assert fixed(tmp_path, before) == after


UNSAFE = {
    "the right key is there already": "links: {a: {}, b: {parnet: a, parent: a}}\n",
    "two keys would become one": (
        "links: {a: {}, b: {parent: a, xxyz: [0, 0, 0], xyzz: [0, 0, 0]}}\n"
    ),
    "no key is near": "links: {a: {}, b: {parent: a, colour: red}}\n",
    "the key would exclude another": "links: {a: {}, b: {parent: a, rpyy: [0, 0, 0], look: up}}\n",
    "two units are near": "links: {a: {}, b: {parent: a, xyz: [0, 3 cmm, 1]}}\n",
    "a unit of another kind": "links: {a: {}, b: {parent: a, xyz: [0, 3 degree, 1]}}\n",
    "an unknown parent": "links: {base_link: {}, b: {parent: base_lnk}}\n",
    "an unknown owner": "links: {a: {}, b: {parent: a, owner: statc}}\n",
    "an unknown preset": "links: {a: {}}\nsensors: {s: {preset: generic/imuu, parent: a}}\n",
    "an unknown option": (
        "links: {a: {}}\nsensors: {s: {preset: realsense/d435i, parent: a, options: {imuu:"
        " true}}}\n"
    ),
    "a fault comes to light": "links: {a: {}, b: {parnet: c}}\n",
    "an optical frame with a tilt": f"{OPTICAL}: {{parent: camera_link, look: {{down: 3 deg}}}}\n",
    "a rotation that others share": (
        "links: {base_link: {}, camera_link: {parent: base_link, rpy: &same [1, 0, 0]}}\n"
        "frames: {camera_optical_frame: {parent: camera_link, rpy: *same}}\n"
    ),
    "an entry that others share": f"{OPTICAL}: &f {{parent: camera_link}}\n  camera_frame: *f\n",
    "a pose in another frame": f"{OPTICAL}: {{parent: camera_link, relative_to: base_link}}\n",
    "no YAML": "links: {a: {}, b: {parnet: a}\n",
}


@pytest.mark.parametrize("why", UNSAFE)
def test_where_the_answer_is_not_safe_the_file_stays_as_it_is(why: str, tmp_path: Path) -> None:
    text = HEAD + UNSAFE[why]
    assert fixed(tmp_path, text) == text
    assert lint(str(tmp_path / "r.yaml"), lambda file: Path(file).read_text("utf-8")), (
        "there is something to say"
    )


def test_expressions_get_their_quotes_all_at_once(tmp_path: Path) -> None:
    text = HEAD + "frames: {lidar: {parent: base_link, xyz: [-${%s/2}, ${b}, 0]}}\n"
    expected = HEAD + 'frames: {lidar: {parent: base_link, xyz: ["${-%s/2}", "${b}", 0]}}\n'
    assert fixed(tmp_path, text % "a") == expected % "a"


def test_a_slip_of_the_pen_is_one_character_and_has_one_answer() -> None:
    assert [
        slip_of(word, ["parent", "xyz"])
        for word in ("parnet", "paret", "pparent", "pxrent", "PARENT")
    ] == ["parent"] * 5
    assert [
        slip_of(word, ["parent", "xyz"]) for word in ("prnt", "parentss", "x", "parent", "")
    ] == [None] * 5
    assert slip_of("cmm", ["cm", "mm"]) is None
    assert slip_of("CM", ["cm", "mm", "m"]) == "cm"


def test_a_link_stays_a_link_and_the_mode_stays(tmp_path: Path) -> None:
    real = tmp_path / "sub" / "real.yaml"
    real.parent.mkdir()
    real.write_text(HEAD + EXAMPLES["a key"][0])
    real.chmod(0o640)
    (tmp_path / "r.yaml").symlink_to("sub/real.yaml")
    done = run(tmp_path, "r.yaml")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "r.yaml").is_symlink()
    assert real.read_text() == HEAD + EXAMPLES["a key"][1]
    assert real.stat().st_mode & 0o777 == 0o640
    assert [path.name for path in real.parent.iterdir()] == ["real.yaml"]


def test_it_says_what_it_fixed_and_fails_for_what_remains(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(HEAD + "links: {a: {}, b: {parnet: a, colour: red}}\n")
    done = run(tmp_path, "r.yaml")
    first, *rest = done.stdout.splitlines()
    assert re.fullmatch(r"r\.yaml:3:20: fixed\[TF101\] .*\bparnet\b.*\bparent", first)
    assert re.fullmatch(r"r\.yaml:3:31: error\[TF101\] .*\bcolour", rest[0])
    assert "{parent: a, colour: red}" in rest[1], "the line is shown as it is now"
    assert rest[-1] == "1 error in 1 file"
    assert done.returncode == 1


def test_json_holds_what_remains_and_stderr_what_was_fixed(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(HEAD + "links: {a: {}, b: {parnet: a, colour: red}}\n")
    done = run(tmp_path, "r.yaml", "--format", "json")
    assert [(entry["code"], entry["column"]) for entry in json.loads(done.stdout)] == [
        ("TF101", 31)
    ]
    assert re.search(r"fixed\[TF101\] .*\bparnet\b", done.stderr)
    assert done.returncode == 1


def test_a_profile_is_fixed_in_its_place(tmp_path: Path) -> None:
    text = HEAD + "links: {a: {}, b: {parent: a}}\nprofiles: {p: {links: {b: {xzy: [1, 0, 0]}}}}\n"
    (tmp_path / "r.yaml").write_text(text)
    assert run(tmp_path, "r.yaml").returncode == 0
    assert (tmp_path / "r.yaml").read_text() == text.replace("xzy", "xyz")


def test_an_included_file_is_edited_only_where_it_is_named(tmp_path: Path) -> None:
    base, robot = tmp_path / "base.yaml", tmp_path / "r.yaml"
    wrong = HEAD + "links: {a: {}, b: {parnet: a}}\n"
    base.write_text(wrong)
    robot.write_text(HEAD + "include: [base.yaml]\nlinks: {c: {parnet: a}}\n")
    assert run(tmp_path, "r.yaml").returncode == 1
    assert base.read_text() == wrong
    assert "{parent: a}" in robot.read_text()
    assert run(tmp_path, "r.yaml", "./base.yaml").returncode == 0
    assert "{parent: a}" in base.read_text()


def test_a_file_that_cannot_be_saved_is_one_sentence_and_exit_2(tmp_path: Path) -> None:
    program = (
        "import errno, os, sys\nfrom pathlib import Path\ndef full(_): raise OSError(errno.ENOSPC,"
        " 'No space left on device', 'r.yaml')\nos.fsync = full\nfrom tfcompose.cli import"
        " main\nsys.exit(main(['lint', '--fix', 'r.yaml']))"
    )
    text = HEAD + EXAMPLES["a key"][0]
    (tmp_path / "r.yaml").write_text(text)
    done = processes.run([sys.executable, "-c", program], cwd=tmp_path)
    assert done.returncode == 2
    assert os.strerror(errno.ENOSPC) in done.stdout
    assert "fixed[" not in done.stdout
    assert (tmp_path / "r.yaml").read_text() == text
    assert [path.name for path in tmp_path.iterdir()] == ["r.yaml"]


def test_an_edit_that_takes_nothing_away_is_not_kept(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text("word")
    span = Span(str(file), 1, 1, 1, 5)
    fixer = Fixer(
        [str(file)], lambda *_: [finding("TF101", "still here", span, edits=[Edit(span, "other")])]
    )
    assert [entry.message for entry in fixer.fix(str(file))] == ["still here"]
    assert (fixer.texts, fixer.fixed) == ({}, [])


def test_edits_that_meet_are_none() -> None:
    first, second = Edit(Span("r", 1, 1, 1, 4), "x"), Edit(Span("r", 1, 3, 1, 6), "y")
    assert apply_edits("abcdefg", [first]) == "xdefg"
    assert apply_edits("abcdefg", [first, second]) is None
    assert apply_edits("abcdefg", [Edit(Span("r", 3, 1, 3, 1), "y")]) is None


def test_a_file_that_changed_meanwhile_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text("theirs")
    with pytest.raises(OSError, match="changed in the meantime"):
        rewrite(file, "ours", "new")
    assert file.read_text() == "theirs"


@st.composite
def slipped(draw: st.DrawFn) -> str:
    """Return an example robot with slips of the pen in some words."""
    text = draw(st.sampled_from(ROBOTS))
    for _ in range(draw(st.integers(1, 4))):
        words = [
            match
            for match in re.finditer(r"[A-Za-z_]{2,}", text)
            if text[match.end() : match.end() + 1] in ":,]}"
        ]
        begin, end = draw(st.sampled_from(words)).span()
        index, char = draw(st.integers(begin, end - 1)), draw(st.sampled_from("aexyz"))
        text = draw(
            st.sampled_from([text[:index] + text[index + 1 :], text[:index] + char + text[index:]])
        )
    return text


@given(slipped() | st.sampled_from([HEAD + before for before, _ in EXAMPLES.values()]))
@settings(max_examples=50, deadline=None)
def test_a_fix_brings_no_new_finding_and_a_second_fix_changes_nothing(
    text: str,
) -> None:
    def read(_: str) -> str:
        return text

    def findings(of: str) -> list[tuple[str, str]]:
        return [(entry.code, entry.message) for entry in lint("r.yaml", lambda _: of)]

    fixer = Fixer([__file__], lambda _, read: lint(__file__, read))
    fixer._read[os.path.realpath(__file__)] = text
    fixer.fix(__file__)
    after = fixer.texts.get(os.path.realpath(__file__), text)
    assert not set(findings(after)) - set(findings(text))
    again = Fixer([__file__], lambda _, read: lint(__file__, read))
    again._read[os.path.realpath(__file__)] = after
    again.fix(__file__)
    assert (again.texts, again.fixed) == ({}, [])
    assert (after == text) == (not fixer.fixed)
    try:
        with_includes(load(after, "r.yaml"), read)
    except RejectedError:
        assert after == text, "what was not understood is not edited"
