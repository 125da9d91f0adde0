"""The project's words: the field's word for each idea, and words no name may contain."""

import ast
import functools
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import pytest

from tests.support.house import PACKAGE, ROOT, nodes_of, tree_of

#: One worker parses all files, once.
pytestmark = pytest.mark.xdist_group("sources")

#: The word for each idea, and what it means here. One word, one meaning.
GLOSSARY = {
    # the tree
    "frame": "a named coordinate frame of TF; frame_id in messages",
    "edge": (
        "a parent frame, a child frame and the pose of the child in the parent; static, dynamic or"
        " a joint's"
    ),
    "parent, child": (
        "the two ends of an edge; parent_from_child is the pose that maps the child's points"
    ),
    "root": "a frame without a parent; base is the root of the URDF",
    "mount": "the frame with which a sensor is bolted to the robot",
    "optical frame": "a camera's frame with z forward, x right, y down (REP-103)",
    "pose": "a translation in metres and a unit quaternion, xyz and quat_xyzw",
    "joint": "an edge that moves with one variable, of a URDF type",
    "body": "what a link is made of: visuals, collisions, inertia",
    "part": "another robot file, URDF or xacro that a robot file includes under a name",
    # the file and what becomes of it
    "source": "a file's text as data, with the span of each key and value",
    "span": "file, line and column from and to; where a finding points",
    "spec": "what the user declared, as pydantic models",
    "preset": "what is known of a model of sensor, or of a ROS node",
    "overlay, profile": "a file, or a section of it, that is merged over a robot file",
    "robot": "the resolved model: all edges, links, joints and processes",
    "plan": "what launcher, publishers, guard and live tools know of a robot: plan.json",
    "place": (
        "the key of the language that names the frame to which a pose applies; and where a finding"
        " points"
    ),
    "finding": "a code, a message, a span, notes, help and edits",
    "severity": "error, warning or note",
    "rule": "a check of the robot model, which yields the findings of one code",
    # who publishes
    "owner": "the process that publishes an edge; each edge has exactly one",
    "publisher, subscriber": "an endpoint of a topic in the ROS graph, with its GID",
    "claim": (
        "an edge that a node publishes by its parameters, and the parameter that switches it off"
    ),
    "stamp": "the time in a message's header",
    "latched": "transient local durability: late subscribers get the last message",
    "guard": "the process that reports or blocks whoever publishes another's edge",
    "watchdog": "what restarts a process whose edges stop coming",
    # what runs
    "process": "a program that the launcher starts, or that runs elsewhere: external",
    "node": "a ROS node; a process has one or more",
    "supervisor": "the part of the launcher that starts, watches and restarts processes",
    "event, state, transition": (
        "the process machine: a state, an event, and the next state with its effects"
    ),
    "backoff": "the growing delay before a restart",
    "readiness": (
        "when a process counts as started: at a topic, a service, a lifecycle state or a log line"
    ),
    "runtime directory": "where a running robot keeps its socket, its lock and its state",
    "lock": "the file lock by which one launcher holds a robot",
    # what is observed
    "observe, received": "what came from the live tree, a bag or the ROS graph",
    "expected": "what the plan says should come",
    "request, answer": "a question to a process or service, and what it sent back",
}

#: Words that were a dialect of this project, with what to write instead.
FORBIDDEN = {
    "law": "rule",
    "eye": "camera, observer",
    "ear": "listener, subscription",
    "voice": "publisher",
    "told": "described, given, options",
    "said": "text, declared, stated",
    "seen": "observed, received, visited",
    "asked": "requested, queried",
    "strand": "stream, edge",
    "sideline": "exclude",
    "census": "count, summary",
    "tally": "count",
    "bulletin": "report, status",
    "heed": "handle",
    "quiet": "silent",
    "turn": "rotation, phase",
    "lives": "lifetimes",
    "vigil": "watch",
    "teller": "reporter",
    "outlet": "publisher, output",
    "keeper": "owner, holder",
    "bury": "reap, remove",
    "look": "check, inspect, observe, scan",
    "whole": "complete, entire, full",
    "written": "source_…, declared",
    "cut": "truncated, trimmed",
    "beside": "next_to, neighbour",
    "shelf": "folder, storage",
    "keeping": "holding",
    "standing_in": "substitute",
    "misfit": "mismatch",
    "letter": "char",
}
#: Other forms of the same words.
FORMS = {
    "laws": "law",
    "eyes": "eye",
    "ears": "ear",
    "voices": "voice",
    "strands": "strand",
    "sidelines": "sideline",
    "sidelined": "sideline",
    "tallies": "tally",
    "bulletins": "bulletin",
    "heeds": "heed",
    "heeded": "heed",
    "heeding": "heed",
    "quietly": "quiet",
    "turns": "turn",
    "tellers": "teller",
    "outlets": "outlet",
    "keepers": "keeper",
    "buried": "bury",
    "buries": "bury",
    "looks": "look",
    "looked": "look",
    "looking": "look",
    "cuts": "cut",
    "shelves": "shelf",
    "misfits": "misfit",
    "letters": "letter",
}


@dataclass(frozen=True, slots=True)
class Exempt:
    """Names that may contain a forbidden word in some files, with the reason."""

    names: frozenset[str]
    files: str
    reason: str


EXEMPT = (
    Exempt(
        frozenset({"look", "Look", "LookAngles", "_look_form"}),
        "tfcompose/(spec/language/pose|compiler/resolve/poses)",
        "look: is the key of the language that gives a camera its direction",
    ),
    Exempt(
        frozenset({"look"}),
        "tests/compiler/presets/.*",
        "the same key, as an argument of a helper that writes it",
    ),
    Exempt(
        frozenset({"EyeInHand", "EyeOnBase"}),
        "tfcompose/spec/language/calibration",
        "hand-eye calibration has these two set-ups, by these names",
    ),
    Exempt(
        frozenset({"camera_looks_away"}),
        "tfcompose/compiler/check/poses",
        "a rule's function has the rule's name",
    ),
    Exempt(
        frozenset({"seen"}),
        "(tfcompose/(model/messages|launcher/answers|cli/console|cli/runs)|tests/launcher/test_gates_ros)",
        "a key of ps --format json and of the launcher's events",
    ),
    Exempt(
        frozenset({"look_at"}),
        "(tfcompose|tests)/tools/view/.*",
        "viser's name of the point that a camera faces",
    ),
    Exempt(frozenset({"eye"}), "tests/.*", "numpy's name of the identity matrix"),
    Exempt(
        frozenset({"quiet"}),
        "tests/benchmarks/.*",
        "an argument of the standard library's compileall",
    ),
)


def words_in(name: str) -> list[str]:
    """Return the words of an identifier: split at underscores, digits and capitals."""
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]


@functools.cache
def forbidden_in(name: str) -> frozenset[str]:
    """Return the forbidden words in a name, in their first form."""
    words = words_in(name)
    forbidden = {FORMS.get(word, word) for word in words} & FORBIDDEN.keys()
    return frozenset(forbidden) | {
        phrase for phrase in FORBIDDEN if "_" in phrase and phrase in "_".join(words)
    }


def names_in(nodes: Iterable[ast.AST]) -> Iterator[tuple[str, int]]:
    """Yield every name that a module defines or uses, with its line."""
    for node in nodes:
        match node:
            case (
                ast.FunctionDef(name=name)
                | ast.AsyncFunctionDef(name=name)
                | ast.ClassDef(name=name)
            ):
                yield name, node.lineno
            case (
                ast.arg(arg=name)
                | ast.Name(id=name)
                | ast.Attribute(attr=name)
                | ast.keyword(arg=str(name))
            ):
                yield name, node.lineno
            case ast.alias(name=name, asname=alias):
                yield alias or name, node.lineno
            case _:
                pass


#: Names of variables that say nothing of what they hold. Tests deal with words of a text, too.
EMPTY_NAMES = {
    "tfcompose": {
        *("one", "ones", "several", "word", "meant", "given"),
        *("found", "known", "wanted", "shown", "other", "others", "there", "own"),
    },
    "tests": {
        *("one", "ones", "several", "meant", "given"),
        *("found", "known", "wanted", "shown", "other", "others", "there", "own", "at"),
    },
}


def variables_in(nodes: Iterable[ast.AST]) -> Iterator[tuple[str, int]]:
    """Yield the variables and parameters that a module binds, with their lines."""
    for node in nodes:
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                yield name, node.lineno
            case _:
                pass


def operands_in(nodes: Iterable[ast.AST]) -> Iterator[int]:
    """Yield the lines of parameters ``other`` of methods that take a second of their own kind."""
    for node in nodes:
        if isinstance(node, ast.ClassDef):
            for method in node.body:
                if isinstance(method, ast.FunctionDef) and len(method.args.args) > 1:
                    operand = method.args.args[1]
                    kind = ast.unparse(operand.annotation) if operand.annotation else ""
                    if operand.arg == "other" and kind in {node.name, "object"}:
                        yield operand.lineno


#: The key of a finding in the events that programs read.
KEYS_OF_EVENTS = {("tfcompose/model/messages.py", "found")}


@pytest.mark.parametrize("folder", EMPTY_NAMES)
def test_a_variable_is_named_by_what_it_holds(folder: str) -> None:
    assert not [
        f"{file.relative_to(ROOT)}:{line}: {name}"
        for file in sorted((ROOT / folder).rglob("*.py"))
        for name, line in variables_in(nodes_of(file))
        if name.strip("_") in EMPTY_NAMES[folder]
        and not (name == "other" and line in operands_in(nodes_of(file)))
        and (file.relative_to(ROOT).as_posix(), name) not in KEYS_OF_EVENTS
    ]


#: What a module's docstring does not begin with: it names what the module holds, or what it does.
NO_BEGINNINGS = ("What", "Where", "Whether", "How", "Which", "Who", "Whose", "When")


def test_a_module_says_what_it_is_by_a_noun_or_a_verb() -> None:
    beginnings = {
        file.relative_to(ROOT).as_posix(): (ast.get_docstring(tree_of(file)) or " ").split(" ")[0]
        for file in sorted(PACKAGE.rglob("*.py"))
    }
    assert {path: word for path, word in beginnings.items() if word in NO_BEGINNINGS} == {}


def test_fields_are_described_at_the_fields_and_not_in_the_class_docstring() -> None:
    listing = {
        f"{file.relative_to(ROOT)}: {node.name}": fields
        for file in sorted(PACKAGE.rglob("*.py"))
        for node in nodes_of(file)
        if isinstance(node, ast.ClassDef) and len(fields := fields_in_docstring(node)) > 1
    }
    pair = {"parent", "child"}  # the ends of a pose in its definition
    assert {name for name, fields in listing.items() if fields != pair} == set()


def fields_in_docstring(node: ast.ClassDef) -> set[str]:
    """Return the fields of a class that its docstring names."""
    docstring = ast.get_docstring(node) or ""
    fields = {ast.unparse(each.target) for each in node.body if isinstance(each, ast.AnnAssign)}
    return {field for field in fields if f"``{field}``" in docstring}


def faults(folder: str) -> Iterator[str]:
    """Yield file, line and name wherever a name contains a forbidden word."""
    for file in sorted((ROOT / folder).rglob("*.py")):
        path = file.relative_to(ROOT).with_suffix("").as_posix()
        exempt = {
            name
            for exemption in EXEMPT
            if re.fullmatch(exemption.files, path)
            for name in exemption.names
        }
        names = [(path.rpartition("/")[2], 1), *names_in(nodes_of(file))]
        for name, line in names:
            for word in sorted(forbidden_in(name)) if name not in exempt else ():
                yield f"{path}.py:{line}: {name} ({word}: {FORBIDDEN[word]})"


@pytest.mark.parametrize("folder", ["tfcompose", "tests"])
def test_no_name_contains_a_forbidden_word(folder: str) -> None:
    assert not list(faults(folder))


def test_every_exemption_is_needed() -> None:
    modules = [
        file.relative_to(ROOT).with_suffix("").as_posix() for file in ROOT.glob("t*/**/*.py")
    ]
    for exempt in EXEMPT:
        files = [ROOT / f"{path}.py" for path in modules if re.fullmatch(exempt.files, path)]
        used = {name for file in files for name, _ in names_in(nodes_of(file))}
        assert exempt.names <= used, exempt
        assert all(forbidden_in(name) for name in exempt.names), exempt


def test_forbidden_words_are_found_in_every_form_of_name() -> None:
    assert forbidden_in("_seen_from") == {"seen"}
    assert forbidden_in("QUIET_S") == {"quiet"}
    assert forbidden_in("LookAngles") == {"look"}
    assert forbidden_in("standing_in_for") == {"standing_in"}
    assert not forbidden_in("return_early")
    assert not forbidden_in("outlook")


def test_no_word_is_both_in_the_glossary_and_forbidden() -> None:
    terms = {word for term in GLOSSARY for word in re.findall(r"\w+", term)}
    assert not terms & (FORBIDDEN.keys() | FORMS.keys())


def test_no_two_classes_of_the_product_have_one_name() -> None:
    files: dict[str, list[str]] = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        for node in nodes_of(file):
            if isinstance(node, ast.ClassDef):
                files.setdefault(node.name, []).append(file.relative_to(ROOT).as_posix())
    assert {name: places for name, places in files.items() if len(places) > 1} == {}
