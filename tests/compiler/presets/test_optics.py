"""What sensors see is what their makers say: figures gathered apart from the presets."""

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.model.robot import Optics

FACTS: dict[str, dict[str, dict[str, Any]]] = yaml.safe_load(
    Path(__file__).with_name("optics_facts.yaml").read_text("utf-8")
)
KNOWN = library()
#: What the presets leave out, with the reason: images of a ZED 2 are rectified, and only the raw
#: angles are known; the turn of a nanoScan3's sector is unresolved; the size that a ZED X One 4K
#: grabs by default is none of those known.
LEFT_OUT = {
    ("zed/zed2", "horizontal"),
    ("zed/zed2", "vertical"),
    ("zed/zed2", "diagonal"),
    ("zed/zed2", "resolution"),
    ("sick/nanoscan3", "horizontal"),
    ("zed/zedx-one-4k", "horizontal"),
    ("zed/zedx-one-4k", "vertical"),
    ("zed/zedx-one-4k", "resolution"),
}
#: The grabbed size that the wrapper's own file of parameters asks for, unless an option says it.
BY_DEFAULT = {
    "zed/zed": "HD720",
    "zed/zed-mini": "HD1080",
    "zed/zed2i": "HD720",
    "zed/zedx-one-4k": "",
}


def optics(preset: str, **options: str) -> dict[str, Optics]:
    facts = KNOWN.get(preset).options
    every = {key: list(fact.values) for key, fact in facts.items() if fact.type == "set"}
    chosen = {
        **every,
        **{key: True for key, fact in facts.items() if fact.type == "bool"},
        **options,
    }
    if preset == "realsense/t265":
        chosen["use"] = "images"
    entry = yaml.safe_dump(
        {"s": {"preset": preset, "parent": "base_link", "options": chosen}},
        default_flow_style=True,
    )
    done = compile_robot(
        f"tfcompose: 1\nrobot: r\nlinks: {{base_link: {{}}}}\nsensors: {entry}\n", "r.yaml", KNOWN
    )
    assert {finding.code for finding in done.errors} <= {"TF605"}, done.errors
    assert done.robot
    return {stream_optics.stream: stream_optics for stream_optics in done.robot.sensors[0].optics}


def degrees(sector: tuple[float, float] | None) -> Any:
    return sector and pytest.approx(tuple(map(math.degrees, sector)), abs=1e-9)


def assert_says(stream: Optics, preset: str, fact: dict[str, Any]) -> None:
    """Assert that every figure of the facts is that of the stream."""

    def expect(key: str, actual: Any, value: Any) -> None:
        assert actual is None if (preset, key) in LEFT_OUT else actual == value, (
            key,
            actual,
            value,
        )

    for key, word in (("horizontal", "hfov_deg"), ("vertical", "vfov_deg")):
        if word in fact:
            angle = fact[word]
            expect(
                key,
                degrees(getattr(stream, key)),
                tuple(angle if isinstance(angle, list) else (-angle / 2, angle / 2)),
            )
    if "angle_min_deg" in fact:
        expect(
            "horizontal",
            degrees(stream.horizontal),
            (fact["angle_min_deg"], fact["angle_max_deg"]),
        )
    if "dfov_deg" in fact and not (preset.startswith("zed/") and preset != "zed/zed2"):
        expect(
            "diagonal",
            stream.diagonal and pytest.approx(math.degrees(stream.diagonal)),
            fact["dfov_deg"],
        )
    if "width" in fact and "height" in fact:
        expect("resolution", stream.resolution, (fact["width"], fact["height"]))
    span = fact.get("depth_range_m") or fact.get("range_m")
    if span:
        expect("range", [stream.near, stream.far], span)
    if "vertical_angles_deg" in fact:
        assert [math.degrees(angle) for angle in stream.elevations] == pytest.approx(
            fact["vertical_angles_deg"]
        )
    assert stream.baseline == fact.get("baseline_m", stream.baseline)
    assert stream.shutter == fact.get("shutter", stream.shutter)


def of_mode(fact: dict[str, Any], mode: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of one mode of the stream."""
    angles = mode.get("fov_deg") or (mode["hfov_deg"], mode["vfov_deg"])
    made = {key: value for key, value in fact.items() if key not in {"modes", "dfov_deg"}}
    made |= {
        "hfov_deg": angles[0],
        "vfov_deg": angles[1],
        "width": mode["size"][0],
        "height": mode["size"][1],
    }
    return made | ({"depth_range_m": mode["range_m"]} if "range_m" in mode else {})


@pytest.mark.parametrize("preset", FACTS)
def test_a_stream_sees_what_its_maker_says(preset: str) -> None:
    streams = optics(preset)
    for stream, fact in FACTS[preset].items():
        modes = FACTS[preset].get("left", fact).get("modes", {})
        default = BY_DEFAULT.get(preset, "HD1200")
        if preset.startswith("zed/") and default in modes and "hfov_deg" in fact:
            assert_says(streams[stream], preset, of_mode(fact, modes[default]))
        else:
            assert_says(streams[stream], preset, fact)


OPTION = {"zed": "resolution", "microsoft": "depth_mode", "orbbec": "depth_mode"}


@pytest.mark.parametrize(
    ("preset", "stream"),
    [
        (preset, stream)
        for preset, streams in FACTS.items()
        for stream, fact in streams.items()
        if "modes" in fact
    ],
)
def test_an_option_chooses_what_a_stream_sees(preset: str, stream: str) -> None:
    fact = FACTS[preset][stream]
    for mode, figures in fact["modes"].items():
        if mode != "passive_ir":
            optics_of_stream = optics(preset, **{OPTION[preset.partition("/")[0]]: mode})[stream]
            assert_says(optics_of_stream, f"{preset} {mode}", of_mode(fact, figures))


def test_an_image_of_4_to_3_is_a_crop_and_narrower() -> None:
    wide, crop = optics("realsense/d435"), optics("realsense/d435", color_resolution="640x480")
    assert crop["color"].resolution == (640, 480)
    assert degrees(crop["color"].horizontal) == (-27.5, 27.5)
    assert degrees(wide["color"].horizontal) == (-34.5, 34.5)
    assert crop["color"].diagonal is None
    assert wide["depth"] == crop["depth"]


@pytest.mark.parametrize("preset", KNOWN.names)
def test_every_value_of_a_vendor_keeps_its_source(preset: str) -> None:
    for stream, stream_optics in KNOWN.get(preset).optics.items():
        keys = {
            key
            for key, value in stream_optics
            if value is not None and key not in {"frame", "kind", "source", "when"}
        }
        source_keys = {key for source in stream_optics.source or () for key in source.of}
        exempt = {"backward"} | ({"vertical"} if stream_optics.vertical == (0, 0) else set())
        assert keys - exempt == source_keys - exempt, stream


def test_a_scanner_has_no_height_and_a_t265_views_backward() -> None:
    assert optics("rplidar/a1")["scan"].vertical == (0, 0)
    eye = optics("realsense/t265")["fisheye1"]
    assert (eye.backward, eye.projection, eye.horizontal) == (True, "fisheye", None)
    assert eye.diagonal == pytest.approx(math.radians(163))


@pytest.mark.parametrize(
    ("preset", "rate_hz", "samples"),
    [
        ("hokuyo/utm-30lx", 40, 1081),
        ("livox/mid360", 10, None),
        ("robotis/pi-camera", 21, None),
        ("sick/microscan3", None, None),
        ("sick/nanoscan3", None, 1618),
    ],
)
def test_a_rate_is_the_makers_and_not_a_simulations(
    preset: str, rate_hz: float | None, samples: int | None
) -> None:
    (stream,) = optics(preset).values()
    assert (stream.rate, stream.samples) == (rate_hz, samples)
