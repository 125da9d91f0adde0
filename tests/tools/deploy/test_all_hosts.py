"""What hosts print, as one; whatever that is."""

import json

import pytest

from tfcompose.tools.deploy.all_hosts import _HostPrinter


def test_events_have_their_host_and_a_line_that_is_none_is_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    printer = _HostPrinter("events", is_json=True)
    printer.take("brain", '{"event": "started"}')
    printer.take("rear", "Welcome to rear")
    first, second = capsys.readouterr().out.splitlines()
    assert json.loads(first) == {"host": "brain", "event": "started"}
    assert second.split() == ["rear", "|", "Welcome", "to", "rear"]


def test_robots_are_one_list_without_what_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    printer = _HostPrinter("ps", is_json=True)
    printer.take("brain", '[{"robot": "rover.brain"}]')
    printer.take("rear", "Welcome to rear")
    printer.end(["brain", "rear", "arm"])
    assert json.loads(capsys.readouterr().out) == [{"robot": "rover.brain"}]
