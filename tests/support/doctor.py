"""``tfcompose doctor``, run until it sees what is to be seen."""

import contextlib
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tests.support import processes

#: So long it is looked, again and again: where much else runs, publishers are found late, and late
#: in truth.
OBSERVE_S = (3.0, 3.0, 3.0, 6.0, 12.0, 12.0, 12.0)


def doctor(*words: str, seconds: float = 3.0) -> tuple[int, list[dict[str, Any]]]:
    """Run it, and return the exit code and the findings."""
    command = [
        sys.executable,
        "-m",
        "tfcompose",
        "doctor",
        "--for",
        str(seconds),
        "--format",
        "json",
        *words,
    ]
    done = processes.run(command)
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, json.loads(done.stdout)


def doctor_finds(
    expected: Mapping[str, Sequence[str]], tolerated: set[str]
) -> list[dict[str, Any]]:
    """Run it until it finds these codes with these names, and no others but the tolerated.

    A few times.
    """
    for seconds in OBSERVE_S:  # names may come late
        exit_code, findings = doctor(seconds=seconds)
        if finds(findings, expected, tolerated):
            break
    assert exit_code == 1
    return findings


def finds_nothing(*words: str) -> bool:
    """Look until nothing is found, a few times."""
    return any(doctor(*words, seconds=seconds) == (0, []) for seconds in OBSERVE_S)


def at_last(claim: Callable[[float], None]) -> None:
    """Let a claim about what is observed within a time hold once, with growing times."""
    for seconds in OBSERVE_S[:-1]:
        with contextlib.suppress(AssertionError):
            return claim(seconds)
    return claim(OBSERVE_S[-1])


def finds(
    findings: list[dict[str, Any]], expected: Mapping[str, Sequence[str]], tolerated: set[str]
) -> bool:
    """Return whether these codes were found, with their names, and none but the tolerated."""
    codes = {entry["code"] for entry in findings}
    named = (
        name in messages_of(findings, code) for code, names in expected.items() for name in names
    )
    return codes >= expected.keys() and codes <= {*expected, *tolerated} and all(named)


def messages_of(findings: list[dict[str, Any]], code: str) -> str:
    """Return all that was said of that code."""
    assert code in {entry["code"] for entry in findings}, findings
    parts = [entry for entry in findings if entry["code"] == code]
    return "\n".join(
        "\n".join([part["message"], *(note["message"] for note in part["notes"]), part["help"]])
        for part in parts
    )
