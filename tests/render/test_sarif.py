"""SARIF, read by somebody else.

No package carries the official 2.1.0 schema. ``sarif-om`` has classes that were generated from it, with every property
and what is required; each object that is written must be one of those. Values are checked by hand.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import attr
import pytest
import sarif_om

from tfcompose import __version__
from tfcompose.check.pages import page
from tfcompose.cli.compiling import library
from tfcompose.codes import CODES
from tfcompose.compile import compile_robot
from tfcompose.diagnostic import Diagnostic, Note, Span
from tfcompose.render.sarif import render_sarif

SPECS = sorted((Path(__file__).parents[1] / "check" / "specs").glob("*.yaml"))
PAGES = {code: page(code) for code in CODES}

#: The class of what stands in a property; what is not named here holds no objects.
CLASS_OF = {
    "runs": "Run",
    "tool": "Tool",
    "driver": "ToolComponent",
    "rules": "ReportingDescriptor",
    "results": "Result",
    "locations": "Location",
    "relatedLocations": "Location",
    "physicalLocation": "PhysicalLocation",
    "artifactLocation": "ArtifactLocation",
    "region": "Region",
    "message": "Message",
    "shortDescription": "MultiformatMessageString",
    "fullDescription": "MultiformatMessageString",
}


def read(data: Any, name: str) -> Any:
    """Return the object of the generated class; a property that it does not have, or lacks, is an error."""
    made = getattr(sarif_om, name)
    fields = {field.metadata["schema_property_name"]: field for field in attr.fields(made)}
    values = {}
    for key, value in data.items():
        assert key in fields, f"{name} has no {key}"
        inner = CLASS_OF.get(key)
        if inner:
            value = [read(item, inner) for item in value] if isinstance(value, list) else read(value, inner)  # noqa: PLW2901
        assert inner or not isinstance(value, dict), f"{key} of {name} is an object"
        values[fields[key].name] = value
    return made(**values)


def findings(spec: Path) -> tuple[Diagnostic, ...]:
    return compile_robot(spec.read_text("utf-8"), spec.name, library()).found


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.stem)
def test_every_object_is_one_of_the_standard_and_says_what_was_found(spec: Path) -> None:
    found = findings(spec)
    log = read(json.loads(render_sarif(found, __version__, PAGES)), "SarifLog")
    assert log.version == "2.1.0"
    (run,) = log.runs
    assert run.tool.driver.name == "tfcompose"
    assert len(run.results) == len(found)
    for result, one in zip(run.results, found, strict=True):
        assert result.level == one.severity
        assert run.tool.driver.rules[result.rule_index].id == result.rule_id == one.code
        assert result.message.text.startswith(one.message)
        (location,) = result.locations
        region = location.physical_location.region
        assert one.span
        assert (region.start_line, region.start_column) == (one.span.line, one.span.column)
        assert (region.end_line, region.end_column) >= (region.start_line, region.start_column)
        related = [note for note in one.notes if note.span]
        assert [place.message.text for place in result.related_locations or []] == [note.message for note in related]


def test_each_rule_stands_once_with_its_page_and_in_one_line_what_it_says() -> None:
    found = [one for spec in SPECS for one in findings(spec)]
    rules = read(json.loads(render_sarif(found, __version__, PAGES)), "SarifLog").runs[0].tool.driver.rules
    assert [rule.id for rule in rules] == sorted({one.code for one in found})
    for rule in rules:
        assert rule.name == CODES[rule.id]
        assert rule.full_description.text == PAGES[rule.id]
        assert rule.full_description.text.startswith(rule.short_description.text)
        assert "\n" not in rule.short_description.text


@pytest.mark.parametrize("file", ["a b.yaml", "ü/r#1.yaml", "50%.yaml", "--set a=b c", "../r.yaml", "/abs/r.yaml"])
def test_a_file_with_any_name_is_a_uri_that_leads_back_to_it(file: str) -> None:
    one = Diagnostic(
        "TF101", "unknown_key", "error", "m", Span(file, 2, 3, 2, 4), (Note("n", Span(file)), Note("no place"))
    )
    result = json.loads(render_sarif([one], __version__, {}))["runs"][0]["results"][0]
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    parsed = urlparse(uri)
    assert not set(uri) & set(' "<>\\^`{|}')
    assert uri.isascii()
    assert (parsed.scheme, parsed.query, parsed.fragment) == ("", "", "")
    assert unquote(parsed.path) == file
    assert len(result["relatedLocations"]) == 1


def test_a_finding_without_a_place_and_no_findings_are_said_too() -> None:
    one = Diagnostic("TF801", "foreign_publisher", "warning", "m")
    assert "locations" not in json.loads(render_sarif([one], __version__, {}))["runs"][0]["results"][0]
    log = read(json.loads(render_sarif([], __version__, {})), "SarifLog")
    assert (log.runs[0].results, log.runs[0].tool.driver.rules) == ([], [])
