"""Resolving is a row of passes over one draft, and nothing after validation reads raw YAML."""

from __future__ import annotations

import inspect
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tfcompose.cli.compiling import library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.check import check
from tfcompose.compiler.emit import emit
from tfcompose.compiler.resolve import resolve
from tfcompose.compiler.resolve.resolve import PASSES
from tfcompose.foundation.findings import RejectedError
from tfcompose.spec.language import compose, validate, with_includes
from tfcompose.spec.load import load

ROOT = Path(__file__).parents[3]
#: Where the data of a source are read: of XML; before validation; where values are shown, edited
#: or exported as they are written, expressions and all; and files of other tools.
READ_A_FILE = {
    "compiler/urdf/read.py",
    "cli/linting.py",
    "cli/untrusted.py",
    "compiler/provenance.py",
    "compiler/mounts/edit.py",
    "tools/importers/adopt.py",
    "tools/importers/command.py",
    "tools/importers/kits.py",
    "tools/adjust/saving.py",
    "tools/ros2/frontend.py",
}


class Unreadable(dict[str, Any]):
    """Data of which nothing can be asked."""

    def __getattribute__(self, name: str) -> Any:
        raise AssertionError(f"{name} of raw YAML")

    def __getitem__(self, key: str) -> Any:
        raise AssertionError(f"{key} of raw YAML")

    def __contains__(self, key: object) -> bool:
        raise AssertionError(f"{key} in raw YAML")


@pytest.mark.parametrize("run", PASSES, ids=lambda run: run.__name__)
def test_a_pass_is_a_function_of_the_draft_that_yields_findings(run: Any) -> None:
    assert [*inspect.signature(run).parameters] == ["draft"]
    assert inspect.signature(run).return_annotation == "Iterator[Finding]"
    assert inspect.isgeneratorfunction(run)


@pytest.mark.parametrize(
    "name", ["autonomous_robot", "car_roof", "field_rover", "house_robot", "my_robot", "picker"]
)
def test_the_stages_after_validation_read_no_raw_yaml(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    file = f"robots/{name}.yaml"
    validated = validate(compose(with_includes(load(read_text(file), file), read_text)))
    expected, findings = resolve(validated, library(), read_text)
    blind = replace(validated, source=replace(validated.source, data=Unreadable()))
    blind.spec.carry(blind.source)
    draft, resolve_findings = resolve(blind, library(), read_text)
    assert resolve_findings == findings
    assert draft.robot == expected.robot
    assert [*check(draft.robot)] == [*check(expected.robot)]
    assert emit(draft.robot) == emit(expected.robot)


def test_unreadable_data_tells_nothing() -> None:
    source = replace(load("robot: r", "r.yaml"), data=Unreadable())
    for ask in (lambda: source.mapping("vars"), lambda: validate(source)):
        with pytest.raises((AssertionError, RejectedError), match="raw YAML"):
            ask()


def test_no_other_file_reads_the_data_of_a_source() -> None:
    wings = [ROOT / "tfcompose" / wing for wing in ("compiler", "cli", "tools")]
    files = [file for wing in wings for file in wing.rglob("*.py")]
    reading = {
        str(file.relative_to(ROOT / "tfcompose"))
        for file in files
        if re.search(r"source\.(data\b|mapping\()", file.read_text("utf-8"))
    }
    assert reading == READ_A_FILE
