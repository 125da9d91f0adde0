"""Every model of the language.

Its errors have words of ours, and its keys tell an editor what they are.
"""

from collections.abc import Iterator
from typing import Any, get_args

import pytest
from pydantic_core import core_schema

from tfcompose.spec.language import calibration
from tfcompose.spec.language.json_schema import model_of
from tfcompose.spec.language.reading import UNKNOWN_KEYS, WORDS, read
from tfcompose.spec.language.reference import key_page, keys, reference
from tfcompose.spec.language.robot import RobotSpec
from tfcompose.spec.language.spec import Spec, describe_key, examples_of, fields_of, walk

#: The kinds of errors that each kind of schema can raise, as strict or lax as the language uses
#: it.
RAISES: dict[str, set[str]] = {
    "any": set(),
    "bool": {"bool_type"},
    "date": set(),  # the function before it refuses all else
    "dataclass": {"dataclass_type"},
    "dataclass-args": {"missing", "unexpected_keyword_argument", "dataclass_type"},
    "default": set(),
    "definition-ref": set(),
    "definitions": set(),
    "dict": {"dict_type"},
    "function-after": set(),
    "function-before": set(),
    "function-plain": set(),
    "function-wrap": set(),
    "int": {"int_type", "greater_than_equal", "less_than_equal"},
    "literal": {"literal_error"},
    "model": {"model_type"},
    "model-fields": {"missing", "extra_forbidden", "model_type"},
    "nullable": set(),
    "str": {"string_type"},
    "tagged-union": set(),
    "tuple": {"tuple_type"},
}
#: What is worded by the code that knows more than the kind.
WORDED = {"missing", "literal_error", *UNKNOWN_KEYS}
BOUNDS = {
    "int": {"strict", "ge", "le"},
    "str": {"strict"},
    "bool": {"strict"},
    "date": {"strict"},
    "dict": set(),
    "tuple": set(),
}

LANGUAGES = {name: model_of(name) for name in ("robot", "preset", "node", "fleet", "test")}
ROOTS: dict[str, type[Spec]] = LANGUAGES | {
    name: kind
    for name, kind in vars(calibration).items()
    if isinstance(kind, type) and issubclass(kind, calibration.FileEntry)
}


def schemas(schema: Any) -> Iterator[dict[str, Any]]:
    """Yield a core schema and all that it is made of."""
    if isinstance(schema, dict):
        if isinstance(schema.get("type"), str) and schema["type"] not in {
            "model-field",
            "dataclass-field",
        }:
            yield schema
        for key, value in schema.items():
            if key not in {
                "metadata",
                "serialization",
                "config",
                "function",
                "json_schema_input_schema",
            }:
                yield from schemas(value)
    elif isinstance(schema, (list, tuple)):
        for item in schema:
            yield from schemas(item)


@pytest.mark.parametrize("root", ROOTS)
def test_every_kind_of_error_that_a_model_can_raise_has_words_of_ours(root: str) -> None:
    model = ROOTS[root]
    model.model_rebuild(force=True, _types_namespace=None)
    core_schemas = list(schemas(model.__pydantic_core_schema__))
    assert core_schemas
    for schema in core_schemas:
        kind = schema["type"]
        assert kind in RAISES, f"a {kind} schema: which errors it raises is to be said here"
        if kind in BOUNDS:
            bounds = set(schema) - {"type", "ref", "metadata", "serialization"} - _structure(kind)
            assert bounds <= BOUNDS[kind], f"{kind} with {bounds}"
        assert RAISES[kind] - WORDED <= WORDS.keys()


def _structure(kind: str) -> set[str]:
    return {
        "dict": {"keys_schema", "values_schema"},
        "tuple": {"items_schema", "variadic_item_index"},
    }.get(kind, set())


def test_an_error_of_an_unforeseen_kind_is_worded_without_pydantic() -> None:
    class Later(Spec):
        """A model with a type that the language does not use."""

        when: bytes

    made, refusals = read(Later, {"when": 5})
    assert made is None
    assert [(refusal.code, refusal.path, refusal.message) for refusal in refusals] == [
        ("TF103", ("when",), "5 cannot stand here")
    ]


def test_every_error_kind_in_the_table_is_one_of_pydantic_s() -> None:
    error_types = set(get_args(core_schema.ErrorType))
    assert WORDS.keys() <= error_types
    assert error_types >= WORDED


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_key_has_a_meaning_and_every_key_of_a_robot_an_example(language: str) -> None:
    missing = []
    for pattern, kind in walk(LANGUAGES[language]):
        for name, field in fields_of(kind).items():
            if not describe_key(field) or describe_key(field).startswith("None"):
                missing.append((*pattern, name))
            if language == "robot" and not examples_of(field):
                missing.append((*pattern, name, "example"))
    assert not missing


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_mapping_s_own_keys_stand_before_those_that_it_inherits(language: str) -> None:
    for _, kind in walk(LANGUAGES[language]):
        names = [name.rstrip("_") for name in kind.__annotations__]  # for_ and from_ have aliases
        own_names = [name for name in names if name in fields_of(kind)]
        assert list(fields_of(kind))[: len(own_names)] == own_names, kind


def test_the_reference_has_every_key_of_the_language_with_its_unit() -> None:
    text = reference("robot")
    for _, kind in walk(RobotSpec):
        for name in fields_of(kind):
            assert f"| `{name}` |" in text
    assert "in metres, or with a unit: 30 cm" in text


def test_only_the_reference_of_robots_tells_of_expressions() -> None:
    assert [name for name in LANGUAGES if "`${…}` computes" in reference(name)] == ["robot"]


FAULTS = 2000


def test_thousands_of_faults_are_all_found_with_two_readings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    count = 0
    validate = RobotSpec.model_validate

    def counted(data: Any, **more: Any) -> RobotSpec:
        nonlocal count
        count += 1
        return validate(data, **more)

    monkeypatch.setattr(RobotSpec, "model_validate", counted)
    frames = {f"f{number}": {"parent": "base_link", "rate": "5 Hx"} for number in range(FAULTS)}
    spec, refusals = read(RobotSpec, {"tfcompose": 1, "robot": "r", "frames": frames})
    assert len(refusals) == FAULTS
    assert spec
    assert len(spec.frames) == FAULTS
    assert count == 2


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("sensors", ["sensors and their mounts", "## Sensor", "`place`"]),
        ("sensors.place", ["## sensors.NAME.place", "`camera_color_optical_frame`"]),
        ("sensors.front_camera.place", ["## sensors.NAME.place"]),
        ("place", ["## sensors.NAME.place", "## parts.NAME.place"]),
        ("process", ["## Process", "`max_restarts`"]),
        ("processes.ready", ["## processes.NAME.ready", "## Ready", "`topic`"]),
        ("processes.ready.topic", ["## processes.NAME.ready.topic"]),
        ("guard.mode", ["`watch`"]),
        ("vars", ["## vars"]),
    ],
)
def test_a_key_is_explained_by_its_path_with_names_or_without(path: str, words: list[str]) -> None:
    text = key_page(path) or ""
    assert [word for word in words if word not in text] == []


def test_a_key_is_explained_where_it_is_and_nowhere_else() -> None:
    assert key_page("sensors.plaice") is None
    assert key_page("sensors.mimic") is None
    assert "ros2_control" not in (key_page("sensors") or "")
    for key in keys():
        assert key_page(key), key
