"""No command takes more than in proportion to a robot's size, whatever of it grows.

Counted are the lines that Python runs, which are as many on every machine. From a size to twice
and to four times that, the second step takes twice what the first one takes, and four times where
each thing is compared with each other one.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from tfcompose.cli import main

HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
LIMIT = "axis: [0, 0, 1], limit: {lower: -1, upper: 1, effort: 1, velocity: 1}"


def each(line: Callable[[int], str], count: int) -> str:
    return "".join(f"  {line(index)}\n" for index in range(count))


def below(name: str, index: int) -> str:
    return f"{name}{index - 1}" if index else "base_link"


def chain(count: int) -> str:
    return f"{HEAD}frames:\n" + each(
        lambda i: f"f{i}: {{parent: {below('f', i)}, xyz: [0.1, 0, 0]}}", count
    )


def joints(count: int) -> str:
    links = each(lambda i: f"l{i}: {{}}", count)
    rows = each(
        lambda i: f"j{i}: {{type: revolute, parent: {below('l', i)}, child: l{i}, {LIMIT}}}", count
    )
    return f"tfcompose: 1\nrobot: r\nlinks:\n  base_link: {{}}\n{links}joints:\n{rows}"


def refused_joints(count: int) -> str:
    rows = each(
        lambda i: f"j{i}: {{type: fixed, parent: {below('l', i)}, child: l{i}, axis: z}}", count
    )
    return f"{HEAD}joints:\n{rows}"


def unknown_parents(count: int) -> str:
    return f"{HEAD}frames:\n" + each(lambda i: f"f{i}: {{parent: nobody}}", count)


def processes(count: int) -> str:
    rows = each(
        lambda i: f"p{i}: {{run: [sleep, '1']{f', after: {{p{i - 1}: ready}}' if i else ''}}}",
        count,
    )
    return f"{HEAD}processes:\n{rows}"


def comments(count: int) -> str:
    return f"{HEAD}frames:\n" + each(
        lambda i: f"f{i}: {{parent: base_link}} # tfcompose: allow TF401 because x", count
    )


def urdf_attributes(count: int) -> str:
    return (
        '<robot name="r"><link name="a"'
        f" {' '.join(f'b{i}={chr(34)}{chr(34)}' for i in range(count))}/></robot>"
    )


def urdf_materials(count: int) -> str:
    box = "<visual><geometry><box size='1 1 1'/></geometry><material name='m{}'/></visual>\n"
    return (
        f'<robot name="r"><link name="a">{"".join(map(box.format, range(count)))}</link></robot>'
    )


def urdf_links(count: int) -> str:
    joint = '<joint name="j{0}" type="fixed"><parent link="{1}"/><child link="l{0}"/></joint>'
    rows = "".join(f'<link name="l{i}"/>{joint.format(i, below("l", i))}\n' for i in range(count))
    return f'<robot name="r"><link name="base_link"/>{rows}</robot>'


def urdf_hardware(count: int) -> str:
    rows = "".join(f'<joint name="j{i}"/>\n' for i in range(count))
    control = (
        '<ros2_control name="c"'
        f' type="system"><hardware><plugin>p</plugin></hardware>{rows}</ros2_control>'
    )
    return f'<robot name="r"><link name="base_link"/>{control}</robot>'


ROBOTS = (chain, joints, refused_joints, unknown_parents, processes, comments)
URDFS = (urdf_attributes, urdf_materials, urdf_links, urdf_hardware)
CASES = [
    *((make, words) for make in ROBOTS for words in (["lint"], ["tree"])),
    *((make, ["lint"]) for make in URDFS),
    (urdf_links, ["import"]),
    *(
        (make, words)
        for make in (chain, joints, processes)
        for words in (["build", "-o", "out"], ["graph"])
    ),
    (chain, ["explain", "base_link", "LAST"]),
    (chain, ["pose", "base_link", "LAST"]),
    (chain, ["diff", "FILE"]),
    (processes, ["export", "launch", "-o", "out"]),
]


def lines_run(words: list[str]) -> int:
    """Return how many lines of Python a command runs."""
    count = 0

    def step(_frame: FrameType, event: str, _argument: Any) -> Any:
        nonlocal count
        count += event == "line"
        return step

    sys.settrace(step)
    try:
        main(words)
    except SystemExit:
        pass
    finally:
        sys.settrace(None)
    return count


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize(("make", "words"), CASES)
def test_a_command_takes_in_proportion_to_the_size(
    make: Callable[[int], str], words: list[str]
) -> None:
    counts = []
    for size in (20, 100, 200, 400):
        file = Path(f"{make.__name__}{size}.{'urdf' if make in URDFS else 'yaml'}")
        file.write_text(make(size), "utf-8")
        position = 2 if words[0] == "export" else 1
        rest = [
            {"LAST": f"f{size - 1}", "FILE": str(file)}.get(word, word)
            for word in words[position:]
        ]
        counts.append(lines_run([*words[:position], str(file), *rest]))
    _, *counts = counts  # loads what is loaded once
    first, second = counts[1] - counts[0], counts[2] - counts[1]
    assert second < 2.3 * first, (make.__name__, words, counts)


@pytest.fixture(autouse=True)
def _here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    lines_run(
        ["lint", str(Path(__file__).parents[2] / "robots/rover.yaml")]
    )  # what is loaded once
    capsys.readouterr()
