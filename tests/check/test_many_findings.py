"""A file in which everything is wrong takes no longer than others of its size."""

import time

from tfcompose.cli.compiling import library
from tfcompose.compile import compile_robot


def seconds(links: int) -> float:
    lines = "".join(f"  l{at}: {{parent: unknown{at}}}\n" for at in range(links))
    began = time.process_time()
    found = compile_robot(f"tfcompose: 1\nrobot: r\nlinks:\n  base_link: {{}}\n{lines}", "r.yaml", library()).found
    took = time.process_time() - began
    assert len([one for one in found if one.code == "TF203"]) == links
    return took


def test_thousands_of_unknown_names_are_found_in_time_proportional_to_their_number() -> None:
    assert seconds(4000) < 12 * seconds(1000)
