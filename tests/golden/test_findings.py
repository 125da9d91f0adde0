"""Golden findings: codes and places for sound robots, specs, bad input and mutations.

A golden holds one row per finding: ``case: code line:col-line:col``, with the file where it is not
the case's own, ``warning`` where it is none of the errors, and the spans of its edits and notes.
Messages have their own tests. After an intended change: ``python -m tests.golden.test_findings
--write``, and read the difference.
"""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from tests.support.bad_input import BAD
from tests.support.goldens import compare, write
from tests.support.mutations import mutated
from tfcompose.cli.compiling import PRESETS, disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.check import unused_allows
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.resolve import Library
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.compiler.urdf.xacro import Expansion, Use
from tfcompose.foundation.findings import Edit, Finding, RejectedError, Span
from tfcompose.spec.language import profiles_in, set_value, validate_file
from tfcompose.spec.language.node_preset import NodePresetSpec
from tfcompose.spec.load import Source, load

ROOT = Path(__file__).parents[2]
#: A case's name, the file that it is about, and what is found.
Case = tuple[str, str, "Iterable[Finding]"]

GOLDEN = Path(__file__).parent / "findings"
TEXTS = GOLDEN / "texts"
HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
INCLUDING = (
    "tfcompose: 1\nrobot: r\ninclude: [below.yaml]\nframes: {odom: {rate: 3 Hz}, tip: {parent:"
    " base_link}}\n"
)

ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))
SPECS = [
    *sorted((ROOT / "tests/compiler/check/specs").glob("*.yaml")),
    *sorted((ROOT / "tests/compiler/check/sound").glob("*.yaml")),
]
CALIBRATIONS = [
    *sorted((TEXTS / "calibration").iterdir()),
    *sorted((ROOT / "robots/calibration").iterdir()),
]

#: Values as --set gives them, laid over robots/autonomous_robot.yaml.
SETTINGS = (
    "vars.mast=40 cm",
    "vars.mast=40 kg",
    "vars.mast=",
    "vars.mst=1",
    "frames.odom.rate=0",
    "frames.odom=null",
    "frames=",
    "sensors.camera.options.streams=[color]",
    "sensors.camera.options.streams=color",
    "sensors.camera.preset=realsense/d435",
    "sensors.camera.preset=realsense/d43",
    "robot=Robot",
    "tfcompose=2",
    "links.base_link.inertial.mass=-1",
    "a",
    "=",
    "a..b=1",
    "links.base_link.visual.0.box=[1, 1]",
    "guard.mode=on",
    "ros.domain_id=7.5",
    "base=odom",
    "profiles.x={}",
    "x={",
    "gaurd={}",
)


def within(
    text: str, file: str, texts: dict[str, str] | None = None, **more: Any
) -> list[Finding]:
    """Return everything that is found in a robot; ``texts`` stand in the place of files."""
    texts_by_name = texts or {}

    def read(name: str) -> str:
        return texts_by_name[name] if name in texts_by_name else read_text(name)

    def is_file(name: str) -> bool:
        return name in texts_by_name or Path(name).is_file()

    files = replace(disk(), read=read, is_file=is_file, expand=expanded)
    compiled = compile_robot(text, file, presets(), read=read, disk=files, **more)
    return [
        *compiled.findings,
        *(unused_allows(compiled.allows, set(compiled.used)) if not more else []),
    ]


def expanded(
    file: str, packages: Packages, arguments: Mapping[str, Any], use: Use | None
) -> Expansion:
    """Expand a file with xacro, once for all mutations that leave it and its use as they are."""
    key = repr((Path(file).absolute(), arguments, use))
    if key not in _expansions:
        try:
            _expansions[key] = disk().expand(file, packages, arguments, use)
        except RejectedError as error:
            _expansions[key] = error
    answer = _expansions[key]
    if isinstance(answer, RejectedError):
        raise answer
    return answer


_expansions: dict[str, Expansion | RejectedError] = {}


@cache
def presets() -> Library:
    return library()


def profiles(text: str) -> list[str]:
    try:
        return list(profiles_in(load(text, "robot.yaml")))
    except RejectedError:
        return []


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def robots() -> Iterator[Case]:
    for path in ROBOTS:
        yield from with_each_profile(path)


def specs() -> Iterator[Case]:
    for path in SPECS:
        os.chdir(path.parent)
        yield from with_each_profile(path, path.name)
    os.chdir(ROOT)


def with_each_profile(path: Path, file: str = "") -> Iterator[Case]:
    text, name, file = path.read_text("utf-8"), name_of(path), file or name_of(path)
    yield name, file, within(text, file)
    for profile in profiles(text):
        yield f"{name} --profile {profile}", file, within(text, file, profiles=(profile,))


def bad_input() -> Iterator[Case]:
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, (data, *_) in BAD.items():
            Path("robot.yaml").write_bytes(data)
            yield (
                name,
                "robot.yaml",
                refusals(lambda: within(read_text("robot.yaml"), "robot.yaml")),
            )
        os.chdir(ROOT)


def refusals(work: Callable[[], Iterable[Finding]]) -> Iterable[Finding]:
    try:
        return work()
    except RejectedError as error:
        return error.findings


def values() -> Iterator[Case]:
    for name, text in json.loads((TEXTS / "values.json").read_text("utf-8")).items():
        yield name, "robot.yaml", within(text, "robot.yaml")


def mutated_robots() -> Iterator[Case]:
    for path in ROBOTS:
        yield from mutations_of(path, 12)
    os.chdir(TEXTS)
    yield from mutations_of(TEXTS / "language.yaml", 60, "language.yaml")
    os.chdir(ROOT)


def mutated_specs() -> Iterator[Case]:
    for path in SPECS:
        os.chdir(path.parent)
        yield from mutations_of(path, 3, path.name)
    os.chdir(ROOT)


def mutations_of(path: Path, count: int, file: str = "") -> Iterator[Case]:
    text, name = path.read_text("utf-8"), name_of(path)
    file = file or name
    for number in range(count):
        wrong = mutated(text, f"{path.name} {number}")
        yield f"{name} {number}", file, within(wrong, file)
        for profile in profiles(wrong)[:1] if number % 4 == 0 else []:
            yield (
                f"{name} {number} --profile {profile}",
                file,
                within(wrong, file, profiles=(profile,)),
            )


def overlays() -> Iterator[Case]:
    """Lay values and mutated profiles over a robot, include it in another, and make it a part."""
    robot = ROOT / "robots/autonomous_robot.yaml"
    text, file = robot.read_text("utf-8"), name_of(robot)
    overlay = (TEXTS / "overlay.yaml").read_text("utf-8")

    def laid(make: Callable[..., Source], *words: str) -> Iterable[Finding]:
        return refusals(lambda: within(text, file, overlays=[make(*words)]))

    for setting in SETTINGS:
        yield f"--set {setting}", file, laid(set_value, setting)
    for number in range(30):
        wrong = mutated(overlay, f"overlay {number}")
        yield f"overlay {number}", file, laid(load, wrong, "overlay.yaml")
        wrong = mutated(text, f"included {number}")
        including = (
            "tfcompose: 1\nrobot: r\ninclude: [below.yaml]\nframes: {odom: {rate: 3 Hz}, tip:"
            " {parent: base_link}}\n"
        )
        yield (
            f"included {number}",
            "robot.yaml",
            within(including, "robot.yaml", {"below.yaml": wrong}),
        )
        wrong = mutated((ROOT / "robots/rover.yaml").read_text("utf-8"), f"part {number}")
        both = (ROOT / "robots/two_rovers.yaml").read_text("utf-8")
        yield (
            f"part {number}",
            "robots/two_rovers.yaml",
            within(both, "robots/two_rovers.yaml", {"robots/rover.yaml": wrong}),
        )


def sensor_presets() -> Iterator[Case]:
    """Mutate each preset as a user's own, used with and without the driver."""
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("presets/own").mkdir(parents=True)
        file = Path("presets/own/model.yaml")
        without = ", tf: tfcompose, driver: none"
        uses = "preset_path: presets\nsensors: {s: {preset: own/model, parent: base_link%s}}\n"
        for path in sorted(PRESETS.glob("*/*.yaml")):
            text = path.read_text("utf-8")
            name = f"{path.parent.name}/{path.stem}"
            for number, more in ((-1, ""), (0, ""), (1, without)):
                file.write_text(
                    mutated(text, f"{name} {number}") if number >= 0 else text, "utf-8"
                )
                yield (
                    f"{name} {number}{more}",
                    file.as_posix(),
                    within(HEAD + uses % more, "robot.yaml"),
                )
        os.chdir(ROOT)


def node_presets() -> Iterator[Case]:
    for path in sorted(PRESETS.glob("nodes/*/*.yaml")):
        text = path.read_text("utf-8")
        for number in range(-1, 12):
            wrong = mutated(text, f"{path.stem} {number}") if number >= 0 else text
            yield (
                f"{path.stem} {number}",
                path.name,
                refusals(partial(of_node_preset, wrong, path.name)),
            )


def of_node_preset(text: str, file: str) -> Iterable[Finding]:
    validate_file(NodePresetSpec, load(text, file))
    return ()


def calibrations() -> Iterator[Case]:
    robot = (
        HEAD.replace("{}", "{visual: {box: [2, 2, 2]}}")
        + "frames:\n  kit_link: {parent: base_link}\n  tool0: {parent: base_link}\n  lens:"
        " {parent: base_link, calibration: FILE}\n  cam1: {parent: base_link}\n  cam0: {parent:"
        " cam1, calibration: {file: FILE, parent: cam1, child: cam0}}\n"
    )
    full = (
        HEAD + "frames: {kit_link: {parent: base_link}, lens: {parent: base_link}}\ncalibrations:"
        " [FILE]\n"
    )
    for path in CALIBRATIONS:
        text = path.read_text("utf-8")
        for number in range(-1, 10):
            wrong = mutated(text, f"{path.name} {number}") if number >= 0 else text
            for kind, use in (("of frames", robot), ("of all", full)):
                findings = within(use.replace("FILE", path.name), "robot.yaml", {path.name: wrong})
                yield f"{path.name} {number} {kind}", path.name, findings


CORPORA: dict[str, Callable[[], Iterator[Case]]] = {
    "robots": robots,
    "specs": specs,
    "bad_input": bad_input,
    "values": values,
    "mutated_robots": mutated_robots,
    "mutated_specs": mutated_specs,
    "overlays": overlays,
    "sensor_presets": sensor_presets,
    "node_presets": node_presets,
    "calibrations": calibrations,
}


def rows(name: str) -> list[str]:
    """Return the rows of a corpus, sorted within each case; a case without findings is one row."""
    with in_the_repository():
        made = []
        for case, file, findings in CORPORA[name]():
            made += [
                f"{case}: {row}\n" for row in sorted(row_of(finding, file) for finding in findings)
            ] or [f"{case}: none\n"]
        return made


def row_of(finding: Finding, file: str) -> str:
    """Return a finding's code and places, in which the name of the case's own file is left out."""
    words = [finding.code, place(finding.span, file)]
    words += ["warning"] if finding.severity == "warning" else []
    words += [
        f"fix {place(edit.span, file)} {json.dumps(edit.text, ensure_ascii=False)}"
        for edit in ordered(finding.edits)
    ]
    return " ".join(
        [*words, *sorted(f"note {place(note.span, file)}" for note in finding.notes if note.span)]
    )


def ordered(edits: Iterable[Edit]) -> list[Edit]:
    return sorted(edits, key=lambda edit: (place(edit.span, ""), edit.text))


def place(span: Span | None, file: str) -> str:
    if span is None:
        return "-"
    where = Path(span.file).as_posix()
    where = where.removeprefix(f"{ROOT.as_posix()}/")
    where = "" if where == file else f"{where}:"
    return f"{where}{span.line}:{span.column}-{span.end_line}:{span.end_column}"


@contextmanager
def in_the_repository() -> Iterator[None]:
    """Work in the repository's folder, without the packages of a ROS workspace."""
    before, prefixes = Path.cwd(), os.environ.pop("AMENT_PREFIX_PATH", None)
    os.chdir(ROOT)
    try:
        yield
    finally:
        os.chdir(before)
        if prefixes is not None:
            os.environ["AMENT_PREFIX_PATH"] = prefixes


@pytest.mark.parametrize("name", CORPORA)
def test_the_findings_are_the_golden_ones(name: str) -> None:
    compare(GOLDEN, {name: "".join(rows(name))})


if __name__ == "__main__":
    write(GOLDEN, {corpus: "".join(rows(corpus)) for corpus in CORPORA})
