"""The table of a process's keys: neither a key nor another system's word is in many files."""

import ast
import functools
import re
from dataclasses import fields
from pathlib import Path

import pytest

from tests.support.house import PACKAGE, nodes_of
from tfcompose.model.plan import Component, Plan, PlanProcess, RosSettings
from tfcompose.model.process_keys import (
    EXTRA_ARGUMENTS,
    LOADED,
    PROCESS_KEYS,
    Exported,
    ProcessKey,
)
from tfcompose.spec.language.process import ContainerSpec, ProcessSpec
from tfcompose.tools.exporters.supervisors import Machine, compose, systemd

#: One worker parses all files, once.
pytestmark = pytest.mark.xdist_group("sources")

ROWS = (*PROCESS_KEYS, EXTRA_ARGUMENTS)
TABLE = PACKAGE / "model" / "process_keys.py"
#: All but the one that names the attributes of ROS's launch that a robot's element refuses.
FILES = {
    file: file.read_text("utf-8")
    for file in sorted(PACKAGE.rglob("*.py"))
    if file != PACKAGE / "tools" / "ros2" / "actions.py"
}
#: A unit that starts a whole plan, which no process's key is about.
UNIT_OF_THE_LAUNCHER = PACKAGE / "tools" / "deploy" / "unit.py"
#: So many files know a key: its row, the plan's field, where it acts, and two more.
MOST_FILES = 5
#: Names that are everyday words as well: of these only what is read of a process counts.
EVERYDAY = {"env", "cwd", "output", "prefix", "restart", "required", "stop"}
#: What features of their own set or ask of any process: the fence and Zenoh's router variables,
#: the launcher's parts what the end of a process means.
USED_WIDELY = {"env", "required", "restart"}


@functools.cache
def words_of(file: Path) -> frozenset[str]:
    return frozenset(re.findall(r"\w+", FILES[file]))


def files_with(word: str) -> set[Path]:
    if word.isidentifier():
        return {file for file in FILES if word in words_of(file)}
    return {file for file, text in FILES.items() if re.search(rf"\b{word}\b", text)}


@functools.cache
def read_of_a_process(file: Path) -> frozenset[str]:
    """Return the attributes that a file reads of what is called a process."""
    return frozenset(
        node.attr
        for node in nodes_of(file)
        if isinstance(node, ast.Attribute) and re.search(r"\bprocess$", ast.unparse(node.value))
    )


def files_that_read(name: str) -> set[Path]:
    return {file for file in FILES if name in read_of_a_process(file)}


@pytest.mark.parametrize(
    "row", [row for row in ROWS if row.name not in USED_WIDELY], ids=lambda row: row.name
)
def test_a_key_is_known_in_few_files(row: ProcessKey) -> None:
    count = files_that_read if row.name in EVERYDAY else files_with
    known_in = count(row.name) | {TABLE, PACKAGE / "model" / "plan" / "plan.py"}
    assert len(known_in) <= MOST_FILES, sorted(map(str, known_in))


def foreign_words() -> set[str]:
    """Return other systems' words but for everyday ones: CamelCase, or with a separator."""
    process = PlanProcess("p", "run", restart="on-failure", oom_score_adj=1, open_files=99)
    words = set()
    for row in ROWS:
        exported = Exported(process, awaited=True)
        dialects = (row.systemd, row.compose, row.kubernetes)
        words |= {setting.name for dialect in dialects for setting in dialect.settings(exported)}
        keywords = row.launch.keywords if row.launch else ()
        words |= {word for keyword in keywords for word in (keyword.name, keyword.attribute)}
    return {word for word in words if re.search(r"[a-z][A-Z]|[_-]", word)}


def test_a_word_of_another_system_stands_in_the_table_alone() -> None:
    words = foreign_words() - {row.name for row in ROWS} - {"on_exit"}  # event handlers' as well
    assert {"RestartSec", "stop_grace_period", "LimitNOFILE", "respawn_delay"} <= words
    elsewhere = {word: files_with(word) - {TABLE, UNIT_OF_THE_LAUNCHER} for word in words}
    assert not {word: files for word, files in elsewhere.items() if files}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_a_row_and_the_plan_have_the_same_default(row: ProcessKey) -> None:
    holder = Component if row.to == LOADED else PlanProcess
    assert row.name in {field.name for field in fields(holder)}
    unset = PlanProcess("p", "run", component=Component("c", "p", "x::Y"))
    assert not row.is_set(unset)
    assert row.default is None or row.default == row.value_of(unset)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_a_key_of_the_language_is_its_row(row: ProcessKey) -> None:
    models = (ProcessSpec,) if row.to == LOADED else (ProcessSpec, ContainerSpec)
    for model in models:
        key = model.model_fields[row.name]
        assert (key.description, key.default) == (row.help, row.default)


def test_a_key_without_a_word_elsewhere_is_the_launchers_there() -> None:
    process = PlanProcess("p", "run", argv=("x",), prefix=("nice",), env={"A": "b"})
    plan = Plan("r", "", None, RosSettings(), (), (process,))
    for export in (systemd, compose):
        text = "".join(file.text or "" for file in export(plan, Machine("/plan"))[0])
        assert "nice" not in text
        assert re.search(r"\bexec\b", text)
