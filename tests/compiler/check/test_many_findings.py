"""A file in which everything is wrong takes no longer than others of its size.

How many of a thing are too many.
"""

import time

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot


def seconds(links: int) -> float:
    lines = "".join(f"  l{index}: {{parent: unknown{index}}}\n" for index in range(links))
    began = time.process_time()
    findings = compile_robot(
        f"tfcompose: 1\nrobot: r\nlinks:\n  base_link: {{}}\n{lines}", "r.yaml", library()
    ).findings
    took = time.process_time() - began
    assert len([finding for finding in findings if finding.code == "TF203"]) == links
    return took


def test_thousands_of_unknown_names_take_linear_time() -> None:
    assert seconds(4000) < 12 * seconds(1000)


@pytest.mark.parametrize(("count", "codes"), [(50, set()), (51, {"TF309"})])
def test_fifty_publishers_of_fixed_edges_are_not_yet_too_many(count: int, codes: set[str]) -> None:
    frames = "".join(
        f"  f{n}: {{parent: base_link, owner: p{n}, static: true}}\n" for n in range(count)
    )
    processes = "".join(f"  p{n}: {{external: true}}\n" for n in range(count))
    text = (
        "tfcompose: 1\nrobot: r\nlinks: {base_link:"
        f" {{}}}}\nframes:\n{frames}processes:\n{processes}"
    )
    assert {finding.code for finding in compile_robot(text, "r.yaml", library()).findings} & {
        "TF309"
    } == codes
