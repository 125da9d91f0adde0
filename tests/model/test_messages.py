"""Whatever the processes of a run tell each other is read as it was written."""

import json
from dataclasses import fields
from typing import Any, get_args, get_type_hints

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tfcompose.foundation.findings import Finding, Note
from tfcompose.model import messages as ipc
from tfcompose.model.messages import (
    GUARD_EVENTS,
    GUARD_ORDERS,
    NOTICES,
    REQUESTS,
    notice_line,
    read_notice,
)
from tfcompose.model.plan.codec import DecodeError, TaggedUnion, decode, encode

UNIONS: list[tuple[TaggedUnion[Any], Any]] = [
    (GUARD_EVENTS, ipc.GuardEvent),
    (GUARD_ORDERS, ipc.GuardOrder),
    (NOTICES, ipc.Notice),
    (REQUESTS, ipc.Request),
]
ANSWERS = (ipc.RobotStatus, ipc.Done, ipc.PlanChange, ipc.Refusal)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner, max_size=2),
)
st.register_type_strategy(float, st.floats(allow_nan=False, allow_infinity=False))


def messages(kind: type) -> st.SearchStrategy[Any]:
    """Give any message of the class."""
    hints = get_type_hints(kind)
    strategies = {
        one.name: st.dictionaries(st.text(), JSON, max_size=3)
        if hints[one.name] == dict[str, Any]
        else st.from_type(hints[one.name])
        for one in fields(kind)
    }
    return st.builds(kind, **strategies)


@given(st.data())
@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
def test_every_message_is_read_as_it_was_encoded(data: st.DataObject) -> None:
    for union, kinds in UNIONS:
        message = data.draw(st.one_of(*map(messages, get_args(kinds))))
        assert union.read(union.line(message)) == message
    answer = data.draw(st.one_of(*map(messages, ANSWERS)))
    assert decode(type(answer), json.loads(json.dumps(encode(answer)))) == answer


def test_a_notice_says_when_behind_its_name() -> None:
    found = Finding("TF808", "process_failed", "error", "lidar ended", None, (Note("why"),))
    notice = ipc.FindingShown(found)
    line = notice_line(notice, 12.34567)
    assert list(json.loads(line)) == ["event", "at", "found"]
    assert read_notice(line.encode()) == (notice, 12.346)


@pytest.mark.parametrize(
    "line",
    [
        '{"do": "dance"}',
        '{"do": ["ps"]}',
        '{"do": "stop"}',
        '{"do": "stop", "name": 1}',
        '{"name": "a"}',
        "[1]",
    ],
)
def test_what_is_no_request_is_refused(line: str) -> None:
    with pytest.raises(DecodeError):
        REQUESTS.read(line)
