"""Xacro files of strangers: what expressions do, what they read and print, what is sent."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tfcompose.cli import compiling, main
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.urdf import expand
from tfcompose.compiler.urdf.lint import lint_urdf
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation import confined
from tfcompose.foundation.findings import Finding

HEAD = '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><link name="base_link"/>\n'
HIDDEN = "root:x:0:0"
#: By way of a lambda and of a generator, into which xacro itself does not look.
SYSTEM = (
    "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == '_wrap_close']"
    "[0].__init__.__globals__"
)
LAMBDA = f"(lambda: {SYSTEM}['system']('touch made'))()"
GENERATOR = f"list({SYSTEM}['system']('touch made') for i in [1])"
FRAME = "[g.gi_frame.f_back.f_back.f_builtins for g in [(i for i in [1])]]"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "tree").mkdir()
    monkeypatch.chdir(tmp_path / "tree")


def write(*lines: str, file: str = "r.xacro") -> str:
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    Path(file).write_text(HEAD + "\n".join(lines) + "\n</robot>\n", "utf-8")
    return file


def lint(*lines: str, file: str = "r.xacro", **how: Any) -> list[Finding]:
    return lint_urdf(write(*lines, file=file), Packages(disk(**how)))


def place(finding: Finding) -> str:
    return str(finding.span)


@pytest.mark.parametrize("expression", [LAMBDA, GENERATOR, FRAME])
def test_an_expression_that_leads_to_python_is_refused_where_it_is(expression: str) -> None:
    (finding,) = lint('<link name="a"/>', f'<link name="${{{expression}}}"/>')
    assert (finding.code, place(finding)) == ("TF022", "r.xacro:3:13")
    assert not Path("made").exists()


def test_a_macro_expression_that_leads_to_python_is_refused_in_the_macro() -> None:
    macro = f'<xacro:macro name="m" params="">\n<link name="${{{LAMBDA}}}"/></xacro:macro>'
    write(macro, file="lib.xacro")
    (finding,) = lint('<xacro:include filename="lib.xacro"/>', "<xacro:m/>")
    assert (finding.code, place(finding)) == ("TF022", "lib.xacro:3:13")


@pytest.mark.parametrize("expression", [LAMBDA, GENERATOR])
def test_the_kernel_holds_what_passes_the_check_of_names(
    expression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(expand, "PROCESS", "tests.support.unchecked_xacro")
    findings = lint(f'<link name="a${{{expression}}}"/>')
    assert {finding.code for finding in findings} <= {
        "TF209",
        "TF501",
    }  # it goes on: system() failed
    assert not Path("made").exists()


def test_the_kernel_lets_an_expression_open_no_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expand, "PROCESS", "tests.support.unchecked_xacro")
    Path("kept").write_text("kept", "utf-8")
    for file in ("/etc/passwd", "kept"):
        opened = f"(lambda: {SYSTEM}['open']('{file}', 0))()"
        (finding,) = lint(f'<link name="${{{opened}}}"/>')
        assert finding.code == "TF018"
        assert "Operation not permitted" in finding.message


READS = [
    '<xacro:include filename="{}"/>',
    "<link name=\"${{xacro.load_yaml('{}')}}\"/>",
    '<xacro:property name="p" value="${{xacro.load_yaml(\'{}\')}}"/><link name="${{p}}"/>',
]


@pytest.mark.parametrize("read", READS)
@pytest.mark.parametrize(
    "named",
    [
        "/etc/passwd",
        "../secret.yaml",
        "link.yaml",
        "/proc/self/environ",
        "/proc/1/cmdline",
        ".git/config",
    ],
)
def test_what_lies_outside_of_the_tree_is_not_read(read: str, named: str, tmp_path: Path) -> None:
    (tmp_path / "secret.yaml").write_text(HIDDEN, "utf-8")
    Path("link.yaml").symlink_to(tmp_path / "secret.yaml")
    Path(".git").mkdir()
    Path(".git/config").write_text(HIDDEN, "utf-8")
    (finding,) = lint('<link name="a"/>', read.format(named))
    assert finding.code == "TF021"
    assert finding.span
    assert (finding.span.file, finding.span.line) == ("r.xacro", 3)
    assert HIDDEN not in str(finding)


@pytest.mark.parametrize("pattern", ["/etc/pass*", "../*.yaml", "/proc/*/environ"])
def test_folders_outside_of_the_tree_are_not_listed(pattern: str) -> None:
    (finding,) = lint(f'<xacro:include filename="{pattern}"/>')
    assert (finding.code, finding.span and finding.span.line) == ("TF021", 2)


def test_patterns_of_the_tree_are_expanded_in_order() -> None:
    for name in ("b", "a", "c"):
        write(f'<link name="{name}"/>', file=f"parts/{name}.xacro")
    Path("parts/.hidden.xacro").touch()
    Path("r.xacro").write_text(
        HEAD.replace('<link name="base_link"/>', "")
        + '<xacro:include filename="part[s]/?.xacro"/></robot>',
        "utf-8",
    )
    packages = Packages(disk())
    made = expand.expand("r.xacro", packages, {})
    assert made.files == ("r.xacro", "parts/a.xacro", "parts/b.xacro", "parts/c.xacro")


def test_a_refused_file_is_named_even_where_the_document_does_without_it() -> None:
    (finding,) = lint('<xacro:include filename="/etc/passwd" optional="true"/>')
    assert finding.code == "TF021"


def test_an_optional_file_may_be_missing_where_arguments_are_given() -> None:
    file = write(
        '<xacro:arg name="a" default=""/><xacro:include filename="gone" optional="true"/>'
    )
    assert expand.expand(file, Packages(disk()), {"a": "b"}).text


@pytest.mark.parametrize("name", ["../secrets", "..", "/etc", "arm/../../secrets", ".ssh"])
def test_a_path_is_no_package(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("prefix/share/arm", "prefix/secrets", "secrets", "prefix/share/.ssh"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "a.yaml").write_text(HIDDEN, "utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    (finding,) = lint(f"<link name=\"${{xacro.load_yaml('$(find {name})/a.yaml')}}\"/>")
    assert (finding.code, finding.span and finding.span.line) == ("TF724", 2)


def test_a_manifest_that_has_no_end_is_not_read(tmp_path: Path) -> None:
    for name, target in (("a", "/dev/zero"), ("b", "/etc/passwd")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").symlink_to(target)
    findings = part_of(
        "packages: {p: ../a}\nparts: {arm: {xacro: ../a/arm.xacro, parent: base_link}}"
    )
    assert [finding.code for finding in findings] == ["TF001"]
    write("<link name=\"${xacro.load_yaml('$(find p)/a.yaml')}\"/>", file="arm.xacro")
    findings = part_of("packages: {p: ../a}\nparts: {arm: {xacro: arm.xacro, parent: base_link}}")
    assert [finding.code for finding in findings] == ["TF021"]


def test_with_trust_everything_is_read_and_expressions_are_not_confined(tmp_path: Path) -> None:
    (tmp_path / "secret.yaml").write_text("height: high", "utf-8")
    line = "<link name=\"${xacro.load_yaml('../secret.yaml').height}\"/>"
    assert [finding.code for finding in lint(line)] == ["TF021"]
    assert {finding.code for finding in lint(line, trusts_files=True)} == {"TF209"}
    assert main(["lint", "--trust", "r.xacro"]) == main(["lint", "--trust", "robot.yaml"]) - 1 == 1


def part_of(robot: str, file: str = "robot.yaml") -> list[Finding]:
    text = f"tfcompose: 1\nrobot: r\nframes: {{base_link: {{}}}}\n{robot}\n"
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    Path(file).write_text(text, "utf-8")
    return list(
        compile_robot(text, file, library(), read=read_text, disk=disk(sources=[file])).findings
    )


def test_a_part_may_be_anywhere_in_the_repository_of_the_robot_file() -> None:
    Path(".git").mkdir()
    Path("arms/arm.xacro").parent.mkdir()
    write("", file="arms/arm.xacro")
    assert not part_of(
        "parts: {arm: {xacro: ../arms/arm.xacro, prefix: a_, parent: base_link}}", "robots/r.yaml"
    )


@pytest.mark.parametrize("named", ["/etc/passwd", "../secret.xacro", "../elsewhere/r.xacro"])
def test_a_part_that_lies_elsewhere_is_refused_and_not_shown(named: str, tmp_path: Path) -> None:
    (tmp_path / "secret.xacro").write_text(HIDDEN, "utf-8")
    write(file=str(tmp_path / "elsewhere/r.xacro"))
    (finding,) = part_of(f"parts:\n  arm: {{xacro: {named}, parent: base_link}}")
    assert (finding.code, place(finding)) == ("TF021", "robot.yaml:5:16")
    assert HIDDEN not in str(finding)


def test_a_part_of_a_package_elsewhere_is_taken(tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere/arm"
    write(file=str(folder / "urdf/arm.xacro"))
    Path(folder, "package.xml").write_text("<package><name>arm</name></package>", "utf-8")
    assert not part_of(
        "parts: {arm: {xacro: ../elsewhere/arm/urdf/arm.xacro, prefix: a_, parent: base_link}}"
    )


@pytest.mark.parametrize(
    ("manifest", "codes"), [("", ["TF021"]), ("<package><name>secrets</name></package>", [])]
)
def test_a_folder_that_a_robot_calls_a_package_has_to_be_one(
    manifest: str, codes: list[str], tmp_path: Path
) -> None:
    folder = tmp_path / "secrets"
    folder.mkdir()
    (folder / "a.yaml").write_text("name: kept", "utf-8")
    if manifest:
        (folder / "package.xml").write_text(manifest, "utf-8")
    write("<link name=\"${xacro.load_yaml('$(find secrets)/a.yaml').name}\"/>", file="arm.xacro")
    Path("arm.xacro").write_text(
        HEAD.replace('<link name="base_link"/>', "")
        + "<link name=\"${xacro.load_yaml('$(find secrets)/a.yaml').name}\"/></robot>",
        "utf-8",
    )
    findings = part_of(
        "packages: {secrets: ../secrets}\nparts: {arm: {xacro: arm.xacro, parent: base_link}}"
    )
    assert [finding.code for finding in findings] == codes


def test_what_xacro_prints_is_shown_without_control_characters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = write("${xacro.message('\\x1b]52;c;aWQ=\\x07::error::\\n::set-output name=a::b')}")
    main(["lint", file])
    printed = capsys.readouterr().err
    assert "\x1b" not in printed
    assert [line.partition(": ")[0] for line in printed.splitlines() if "::" in line] == [
        "r.xacro"
    ] * 2


def test_a_flood_of_output_is_bounded(capsys: pytest.CaptureFixture[str]) -> None:
    file = write('<link name="a${[xacro.message(str(i) * 10000) for i in range(1000)] and 1}"/>')
    main(["lint", file])
    assert 1_000_000 < len(capsys.readouterr().err) < 1_100_000


def test_a_macro_bomb_is_ended_and_found_in_its_macro(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(confined, "MOST_WALL_S", 4.0)
    call = '<xacro:if value="${n > 0}"><xacro:m n="${n - 1}"/><xacro:m n="${n - 1}"/></xacro:if>'
    (finding,) = lint(
        f'<xacro:macro name="m" params="n">{call}</xacro:macro>', '<xacro:m n="30"/>'
    )
    assert (finding.code, finding.span and finding.span.line) == ("TF008", 2)
    assert "3 s" in finding.message


OF_FILE = {
    "text": "<robot name='r'><link name='a'/></robot>",
    "files": ["r.xacro"],
    "places": [None, None],
    "comments": [],
}
STOPPED = {
    "kind": "refused",
    "reason": "no",
    "files": ["r.xacro"],
    "macros": [],
    "error": None,
    "at": None,
}
READ = {"read": "r.xacro"}
OUTSIDE = "../secret.xacro"
HOSTILE: dict[str, list[Any]] = {
    "nothing": [],
    "a kernel that lacks something": [READ, {"missing": ["whatever"]}, {"answer": OF_FILE}],
    "a long question": [READ, {"read": "x" * 5000}, {"answer": OF_FILE}],
    "no mapping": [[]],
    "another question": [{"write": "r.xacro"}],
    "a question that is no text": [{"read": ["r.xacro"]}],
    "no answer": [{"answer": None}],
    "a text of half characters": [READ, {"answer": OF_FILE | {"text": "\ud800"}}],
    "files that were not read": [{"answer": OF_FILE}],
    "another file": [READ, {"answer": OF_FILE | {"files": [OUTSIDE]}}],
    "a place in no file": [READ, {"answer": OF_FILE | {"places": [[1, 1, 1], None]}}],
    "a place before the file": [READ, {"answer": OF_FILE | {"places": [[0, -1, 1], None]}}],
    "a place of two numbers": [READ, {"answer": OF_FILE | {"places": [[0, 1], None]}}],
    "a place that is true": [READ, {"answer": OF_FILE | {"places": [[True, 1, 1], None]}}],
    "no places": [READ, {"answer": OF_FILE | {"places": []}}],
    "places that are too few": [READ, {"answer": OF_FILE | {"places": [[0, 1, 1]]}}],
    "a place far behind the file": [
        READ,
        {"answer": OF_FILE | {"places": [[0, 10**9, 10**9]] * 2}},
    ],
    "a place far behind its line": [READ, {"answer": OF_FILE | {"places": [[0, 1, 10**9]] * 2}}],
    "stopped in another file": [{"answer": STOPPED | {"files": [OUTSIDE], "at": [OUTSIDE, 1, 0]}}],
    "stopped with broken XML elsewhere": [{"answer": STOPPED | {"error": [OUTSIDE, 1, 0]}}],
    "stopped at no place": [READ, {"answer": STOPPED | {"error": [1, 2, 3], "at": ["r.xacro"]}}],
    "stopped in half a macro": [
        READ,
        {"answer": STOPPED | {"macros": [["a"], [None, None], ["a", OUTSIDE]]}},
    ],
    "stopped in many macros": [
        READ,
        {
            "answer": STOPPED
            | {"macros": [["a", "r.xacro"]] * 100_000, "files": ["r.xacro"] * 10**5}
        },
    ],
    "stopped for a long reason": [READ, {"answer": STOPPED | {"reason": "x" * 1_000_000}}],
    "an unknown kind": [READ, {"answer": STOPPED | {"kind": "whatever"}}],
    "a secret": [{"read": OUTSIDE}, {"read": "r.xacro"}, {"answer": OF_FILE}],
}


#: Those that name another file, which are tried in a part too.
ELSEWHERE = [name for name, lines in HOSTILE.items() if OUTSIDE in json.dumps(lines)]


@pytest.mark.parametrize(
    ("name", "of_part"),
    [*((name, False) for name in HOSTILE), *((name, True) for name in ELSEWHERE)],
)
def test_a_process_that_was_taken_over_shows_no_other_file(
    name: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    of_part: bool,
) -> None:
    lines = HOSTILE[name]
    monkeypatch.setattr(expand, "PROCESS", "tests.support.hostile_child")
    Path(OUTSIDE).write_text(f"<robot name='{HIDDEN}'><link name='a'/></robot>\n", "utf-8")
    write()
    Path("hostile.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines), "utf-8")
    if of_part:
        part_of("parts: {arm: {xacro: r.xacro, prefix: a_, parent: base_link}}")
    main(["lint", "robot.yaml" if of_part else "r.xacro"])
    printed = capsys.readouterr()
    assert HIDDEN not in printed.out + printed.err
    assert "Traceback" not in printed.err


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("a secret", "TF021"), ("another file", "TF008"), ("files that were not read", "TF008"),
        ("a long question", "TF008"), ("a text of half characters", "TF008"),
    ],
)  # fmt: skip
def test_what_such_a_process_sends_is_refused(
    name: str, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(expand, "PROCESS", "tests.support.hostile_child")
    text = "".join(json.dumps(line) + "\n" for line in HOSTILE[name])
    Path("hostile.jsonl").write_text(text, "utf-8")
    (finding,) = lint()
    assert (finding.code, finding.span and finding.span.file) == (code, "r.xacro")


#: Lets a program believe that the kernel does not have these calls, as an older one.
OLDER = """
import ctypes, struct, sys
refused = [int(number) for number in sys.argv[1].split(",")]
lines = [(0x20, 0, 0, 0)]
for number in refused:
    lines += [(0x15, 0, 1, number), (0x06, 0, 0, 0x00050000 | 38)]
lines.append((0x06, 0, 0, 0x7FFF0000))
text = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *line) for line in lines))
libc = ctypes.CDLL(None)
libc.prctl(38, 1, 0, 0, 0)
assert libc.prctl(22, 2, struct.pack("HxxxxxxP", len(lines), ctypes.addressof(text))) == 0
sys.path[:] = sys.argv[2].split(":")
from tfcompose.cli import main
sys.exit(main(sys.argv[3:]))
"""


@pytest.mark.skipif(os.uname().machine != "x86_64", reason="the numbers are x86-64's")
@pytest.mark.parametrize(
    ("numbers", "missing"),
    [("444", ["Landlock"]), ("317", ["seccomp"]), ("444,317", ["Landlock", "seccomp"])],
)
def test_what_the_kernel_does_not_have_is_reported_once(numbers: str, missing: list[str]) -> None:
    files = [write(file=f"{name}.xacro") for name in "ab"]
    done = subprocess.run(
        [sys.executable, "-c", OLDER, numbers, ":".join(sys.path), "lint", *files],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stderr.splitlines() if "TF923" in line]
    assert [
        next(name for name in ("Landlock", "seccomp") if name in line) for line in lines
    ] == missing


def test_on_this_kernel_nothing_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    compiling._reported.clear()
    main(["lint", write()])
    assert "TF923" not in capsys.readouterr().err
