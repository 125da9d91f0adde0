"""Whatever the processes of a run tell each other is read as it was written."""

import json
from typing import Any, get_args, get_type_hints

import msgspec
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
    line_of,
    notice_line,
    read_notice,
)

READERS: tuple[msgspec.json.Decoder[Any], ...] = (GUARD_EVENTS, GUARD_ORDERS, NOTICES, REQUESTS)
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
        field.name: st.dictionaries(st.text(), JSON, max_size=3)
        if hints[field.name] == dict[str, Any]
        else st.from_type(hints[field.name])
        for field in msgspec.structs.fields(kind)
    }
    return st.builds(kind, **strategies)


@given(st.data())
@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
def test_every_message_is_read_as_it_was_encoded(data: st.DataObject) -> None:
    for reader in READERS:
        message = data.draw(st.one_of(*map(messages, get_args(reader.type))))
        assert reader.decode(line_of(message)) == message
    answer = data.draw(st.one_of(*map(messages, ANSWERS)))
    assert msgspec.json.decode(line_of(answer), type=type(answer)) == answer


def test_a_notice_says_when_behind_its_name() -> None:
    finding = Finding("TF808", "process_failed", "error", "lidar ended", None, (Note("why"),))
    notice = ipc.FindingShown(finding)
    line = notice_line(notice, 12.34567)
    assert list(json.loads(line)) == ["event", "at", "found"]
    assert read_notice(line.encode()) == (notice, 12.346)


@pytest.mark.parametrize(
    "line",
    [
        '{"request": "Dance"}',
        '{"request": ["StatusRequest"]}',
        '{"request": "ProcessRequest", "do": "stop"}',
        '{"request": "ProcessRequest", "do": "dance", "name": "a"}',
        '{"request": "ProcessRequest", "do": "stop", "name": 1}',
        '{"name": "a"}',
        "[1]",
    ],
)
def test_what_is_no_request_is_refused(line: str) -> None:
    with pytest.raises(msgspec.ValidationError):
        REQUESTS.decode(line)
