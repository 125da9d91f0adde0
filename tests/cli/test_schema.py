"""The JSON Schema is fresh, takes what the compiler takes and refuses what it refuses."""

import json
import re
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest

from tfcompose.cli.compiling import library
from tfcompose.cli.schemas import LANGUAGES, schema_text
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.findings import RejectedError
from tfcompose.spec.language import validate_file, validate_preset
from tfcompose.spec.language.node_preset import NodePresetSpec
from tfcompose.spec.load import Source, load

if TYPE_CHECKING:
    from collections.abc import Callable

#: One worker makes the validators, for all tests.
pytestmark = pytest.mark.xdist_group("schema")
ROOT = Path(__file__).parents[2]
HEAD = "tfcompose: 1\nrobot: r\n"
LINKS = "links: {base_link: {}}\n"


@cache
def validator(language: str) -> Any:
    schema = json.loads(schema_text(language))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_schema_in_the_repository_is_fresh(language: str) -> None:
    assert (ROOT / "schemas" / f"{language}.schema.json").read_text("utf-8") == schema_text(
        language
    )


@pytest.mark.parametrize(
    "file", sorted((ROOT / "robots").glob("*.yaml")), ids=lambda file: file.stem
)
def test_the_example_robots_are_valid(file: Path) -> None:
    validator("robot").validate(load(file.read_text("utf-8"), file.name).data)
    line = file.read_text("utf-8").splitlines()[0]
    schema = re.fullmatch(r"# yaml-language-server: \$schema=(.*)", line)
    assert schema
    assert (file.parent / schema[1]).resolve() == ROOT / "schemas" / "robot.schema.json"


@pytest.mark.parametrize(
    "file", sorted((ROOT / "tfcompose/data/presets").glob("*/*.yaml")), ids=lambda file: file.stem
)
def test_the_presets_are_valid(file: Path) -> None:
    validator("preset").validate(load(file.read_text("utf-8"), file.name).data)


@pytest.mark.parametrize(
    "file",
    sorted((ROOT / "tfcompose/data/presets/nodes").glob("*/*.yaml")),
    ids=lambda file: file.stem,
)
def test_the_presets_of_nodes_are_valid(file: Path) -> None:
    validator("node").validate(load(file.read_text("utf-8"), file.name).data)


FINE = [
    "links: {base_link: {visual: {box: [1, 1, 30 cm]}, collision: same}}\n",
    "links: {base_link: {visual: [{box: [1, 1, 1]}, {sphere: {radius: 1 m}, xyz: [0, 0, 1]}]}}\n",
    LINKS + "frames: {a: {parent: base_link, look: down, static: false}}\n",
    LINKS + "frames: {a: {parent: base_link, look: {down: 15 deg}}}\n",
    LINKS
    + "sensors: {c: {preset: realsense/d435i, parent: base_link, tf: tfcompose, driver: none}}\n",
    LINKS
    + "sensors: {c: {preset: realsense/d435i, parent: base_link, driver: {restart: always}}}\n",
    LINKS + "vars: {p: imu}\nsensors: {c: {preset: 'generic/${p}', parent: base_link}}\n",
    LINKS + "vars: {p: generic/imu}\nsensors: {c: {preset: '${p}', parent: base_link}}\n",
    LINKS + "vars: {p: ekf}\nprocesses: {e: {run: [sleep, '9'], node: {preset: '${p}'}}}\n",
    LINKS + "processes: {a: {run: [python3, -m, x], restart: no}}\n",
    LINKS + "processes: {a: {simulate: {joints: zero}}, b: {simulate: {joints: {}}}}\n",
    "vars: {a: 30 cm}\nlinks: {base_link: {visual: {box: [1, 1, '${a}']}}}\n",
]
BROKEN = [
    "gaurd: {}\n" + LINKS,
    "links: {base_link: {visual: {box: [1, 1]}}}\n",
    "links: {base_link: {colision: same}}\n",
    LINKS + "frames: {a: {parent: 5}}\n",
    LINKS + "frames: {a: {parent: base_link, look: sideways}}\n",
    LINKS + "sensors: {c: {parent: base_link}}\n",
    LINKS + "ros: {domain_id: 233}\n",
    LINKS + "processes: {a: {run: [x], restart: sometimes}}\n",
    LINKS + "guard: {mode: sleepy}\n",
]


@pytest.mark.parametrize("text", FINE)
def test_what_the_compiler_takes_the_schema_takes(text: str) -> None:
    assert not compile_robot(HEAD + text, "r.yaml", library()).errors
    validator("robot").validate(load(HEAD + text, "r.yaml").data)


@pytest.mark.parametrize("text", BROKEN)
def test_what_the_compiler_refuses_by_its_form_the_schema_refuses(text: str) -> None:
    assert compile_robot(HEAD + text, "r.yaml", library()).errors
    assert not validator("robot").is_valid(load(HEAD + text, "r.yaml").data)


@pytest.mark.parametrize(
    ("profile", "fine"),
    [
        ("{sensors: {laser: {driver: none, xyz: null}}, ros: {clock: sim}}", True),
        (
            (
                "{links: {mast: null}, processes: {player: {external: true}}, frames: {dock:"
                " {parent: base_link}}}"
            ),
            True,
        ),
        (
            (
                "{processes: {player: {run: [play], publishes: [{parent: base_link, child: dock,"
                " off: {}}]}}}"
            ),
            True,
        ),
        ("{sensors: {laser: {drivr: none}}}", False),
        ("{processes: {player: {restart: sometimes}}}", False),
        ("{processes: {player: {run: [play], publishes: [{parent: base_link}]}}}", False),
        ("{profiles: {}}", False),
    ],
)
def test_a_profile_may_hold_a_part_of_what_a_robot_does(profile: str, *, fine: bool) -> None:
    laser = "sensors: {laser: {preset: generic/lidar2d, parent: base_link, xyz: [0, 0, 1]}}\n"
    text = (
        f"{HEAD}links: {{base_link: {{}}, mast: {{parent: base_link}}}}\n{laser}profiles: {{p:"
        f" {profile}}}\n"
    )
    assert not compile_robot(text, "r.yaml", library()).errors or not fine
    assert bool(compile_robot(text, "r.yaml", library(), ["p"]).errors) is not fine
    assert validator("robot").is_valid(load(text, "r.yaml").data) is fine


@pytest.mark.parametrize(
    ("overlay", "fine"),
    [
        ("sensors: {laser: {driver: none, xyz: null}}\nros: {clock: sim}\n", True),
        ("tfcompose: 1\nprofiles: {demo: {links: {mast: null}}}\nx-mine: 1\n", True),
        ("sensors: {laser: {drivr: none}}\n", False),
        ("processes: {player: {restart: sometimes}}\n", False),
        ("profiles: {demo: {links: {mast: {parnet: base_link}}}}\n", False),
        ("tfcompose: 2\n", False),
    ],
)
def test_an_overlay_may_hold_a_part_of_what_a_robot_does_and_profiles(
    overlay: str, *, fine: bool
) -> None:
    laser = "sensors: {laser: {preset: generic/lidar2d, parent: base_link, xyz: [0, 0, 1]}}\n"
    text = f"{HEAD}links: {{base_link: {{}}, mast: {{parent: base_link}}}}\n{laser}"
    source = load(overlay, "o.yaml")
    profiles = list(source.data.get("profiles", ()))
    assert (
        bool(compile_robot(text, "r.yaml", library(), profiles, overlays=[source]).errors)
        is not fine
    )
    assert validator("overlay").is_valid(source.data) is fine


@pytest.mark.parametrize(
    ("language", "file", "line"),
    [
        ("preset", "generic/camera.yaml", "    backward: {}"),
        ("preset", "generic/camera.yaml", "    horizontal: {}"),
        ("preset", "generic/camera.yaml", "    elevations: [{}]"),
        ("preset", "generic/camera.yaml", "    channels: {}"),
        ("preset", "generic/camera.yaml", "    near: {}"),
        ("node", "nodes/slam_toolbox/slam_toolbox.yaml", "one_of: {}"),
    ],
)
def test_presets_have_no_expressions(language: str, file: str, line: str) -> None:
    text = (ROOT / "tfcompose" / "data" / "presets" / file).read_text("utf-8")
    if language == "preset":
        text = (
            text[: text.index("optics:")]
            + "optics:\n  image:\n    frame: '{name}_optical_frame'\n"
        )
    validate: Callable[[Source], object] = validate_preset
    if language == "node":
        validate = partial(validate_file, NodePresetSpec)
    value = "true" if "backward" in line or "one_of" in line else "1"
    fine, wrong = (load(text + line.format(filled), file) for filled in (value, '"${a}"'))
    validate(fine)
    validator(language).validate(fine.data)
    with pytest.raises(RejectedError):
        validate(wrong)
    assert not validator(language).is_valid(wrong.data)


def test_a_robot_without_its_name_or_version_is_refused() -> None:
    assert not validator("robot").is_valid({"tfcompose": 1})
    assert not validator("robot").is_valid({"robot": "r"})
    assert not validator("robot").is_valid({"tfcompose": 2, "robot": "r"})
    assert validator("robot").is_valid({"tfcompose": 1, "robot": "r", "x-mine": {"a": [1]}})


def test_every_key_has_a_place_and_every_mapping_a_description() -> None:
    for language in ("robot", "preset"):
        schema = json.loads(schema_text(language))
        for definition in [
            schema,
            *(inner for inner in schema["$defs"].values() if "properties" in inner),
        ]:
            assert definition["description"]
            assert definition["additionalProperties"] is False
