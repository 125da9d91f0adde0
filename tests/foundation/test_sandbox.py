"""What a confined process cannot do, tried; and the filter itself, for both machines."""

import errno
import platform
from pathlib import Path

import pytest

from tests.support.escapes import CALLS, Try, ends_of, tries_of, victims
from tests.support.filters import verdict
from tfcompose.foundation import sandbox

ALLOW, REFUSE = 0x7FFF0000, 0x00050000
REFUSED = {"EPERM", "EACCES", "ENOSYS"}
#: Refused by a bound, or before the kernel is asked.
OTHERWISE = {
    "a temporary file": "ENOENT",  # there is no folder for one
    "grow an open file": "EFBIG",
    "raise the own limits": "ValueError",
    "libc dlopen beside the tree": "ENOENT",
    "madvise: poison memory": "EINVAL",
}


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the numbers of the tries are x86-64's")
def test_no_try_gets_out(tmp_path: Path) -> None:
    with victims(tmp_path) as request:
        names = list(tries_of(Try(request)))
        ends = ends_of(request, names)
        assert len(ends) > 200
        assert {name: end for name, end in ends.items() if end not in REFUSED} == OTHERWISE
        assert (tmp_path / "tree/kept").read_text("utf-8") == "kept"
        assert sorted(path.name for path in (tmp_path / "tree").iterdir())[-4:] == [
            "escape.so",
            "folder",
            "kept",
            "link",
        ]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the numbers of the tries are x86-64's")
def test_the_tries_get_out_of_a_process_that_is_not_confined(tmp_path: Path) -> None:
    names = [
        "open a file beside the tree",
        "start a shell",
        "signal another",
        "connect",
        "another's priority",
        "own a descriptor's signals",
        "32-bit getpid",
        "make a file",
        "libc dlopen beside the tree",
    ]
    with victims(tmp_path) as request:
        ends = ends_of({**request, "confined": False}, names)
    assert ends.pop("libc dlopen beside the tree") == "ENOENT"
    assert set(ends.values()) == {"done"}


@pytest.mark.parametrize("machine", sandbox.MACHINES)
@pytest.mark.parametrize("files", [True, False])
def test_the_filter_lets_nothing_pass_but_the_table(machine: str, *, files: bool) -> None:
    column, architecture = sandbox.MACHINES[machine]
    program = sandbox.filter_program(column, architecture, files=files)
    table = sandbox._CALLS | (sandbox._FILE_CALLS if files else {})
    always = {numbers[column] for numbers in table.values()} - {None}
    conditions = [*sandbox._conditions(), *(sandbox._OPENS if files else ())]
    conditional = {condition.numbers[column] for condition in conditions} - {None}
    assert not always & conditional
    for number in range(1000):
        if number not in conditional:
            answer = verdict(program, architecture, number)
            refusal = REFUSE | (errno.EPERM if number < 424 else errno.ENOSYS)
            assert answer == (ALLOW if number in always else refusal), number
        assert verdict(program, architecture ^ 1, number) == REFUSE | errno.EPERM
        assert verdict(program, architecture, number | 0x40000000) == REFUSE | errno.EPERM


#: By call: numbers on both machines, arguments that pass, arguments that do not.
CONDITIONS = [
    (
        "open",
        (2, None),
        [(0, 0o2000000), (0, 1 << 40)],
        [(0, 1), (0, 2), (0, 0o100), (0, 0o1000), (0, 0o20200002)],
    ),
    (
        "openat",
        (257, 56),
        [(-100, 0, 0o2200000)],
        [(-100, 0, 1), (-100, 0, 2 | 1 << 40), (-100, 0, 0o100)],
    ),
    (
        "clone",
        (56, 220),
        [(0x3D0F00,), (0x7D0F00,)],
        [(17,), (0x10000011,), (0x3D0F00 | 0x40000000,), (0x4111,)],
    ),
    (
        "fcntl",
        (72, 25),
        [(1, 1), (1, 1030)],
        [(1, 4), (1, 6), (1, 8), (1, 10), (1, 1024), (1, 1026), (1, 1031)],
    ),
    (
        "ioctl",
        (16, 29),
        [(1, 0x5401), (1, 0x5451)],
        [(1, 0x5412), (1, 0x40086602), (1, 0x40049409)],
    ),
    ("prctl", (157, 167), [(15,), (16,)], [(1,), (4,), (22,), (35,), (0x59616D61,)]),
    ("mmap", (9, 222), [(0, 1, 1, 0x22)], [(0, 1, 1, 0x2022), (0, 1, 1, 0x40022)]),
    ("madvise", (28, 233), [(0, 0, 4)], [(0, 0, 12), (0, 0, 100), (0, 0, 101)]),
    ("prlimit64", (302, 261), [(0,)], [(1,), (-1,)]),
    ("sched_getaffinity", (204, 123), [(0,)], [(1,)]),
    ("tgkill", (234, 131), [], [(1,), (0,), (-1,)]),
]


@pytest.mark.parametrize("machine", sandbox.MACHINES)
@pytest.mark.parametrize(
    ("numbers", "passing", "refused"),
    [condition[1:] for condition in CONDITIONS],
    ids=[condition[0] for condition in CONDITIONS],
)
def test_some_calls_pass_with_some_arguments(
    machine: str,
    numbers: tuple[int, int | None],
    passing: list[tuple[int, ...]],
    refused: list[tuple[int, ...]],
) -> None:
    column, architecture = sandbox.MACHINES[machine]
    program, number = sandbox.filter_program(column, architecture, files=True), numbers[column]
    if number is None:
        return
    assert {verdict(program, architecture, number, arguments) for arguments in passing} <= {ALLOW}
    assert {verdict(program, architecture, number, arguments) for arguments in refused} <= {
        REFUSE | errno.EPERM,
        REFUSE | errno.EINVAL,
    }


def test_no_call_of_the_table_is_one_that_is_tried() -> None:
    assert not set(CALLS) & (set(sandbox._CALLS) | set(sandbox._FILE_CALLS))
    assert len(sandbox._CALLS) + len(sandbox._FILE_CALLS) < 70
