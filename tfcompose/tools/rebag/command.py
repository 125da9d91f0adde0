"""Copy a recording with the poses of a robot file.

Write the bag IN to OUT with the fixed edges of ROBOT. In OUT, each file begins with the robot
file's poses on /tf_static, and /tf contains no fixed edges. Keep the bytes, times and order of
moving edges and all other messages. Keep the recorded poses of frames inside a sensor if the robot
file contains only the vendor's nominal poses. With --check, write nothing.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.cli.options import add_format, add_variant, pairs
from tfcompose.cli.terminal import FAILED, INTERRUPTED, UNREADABLE, fail, print_findings, reject
from tfcompose.foundation.text import plural

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import Plan
    from tfcompose.tools.rebag.correction import EdgeChange
    from tfcompose.tools.rebag.messages import CameraInfo
    from tfcompose.tools.rebag.rewriting import Rewrite


def add_with(parser: ArgumentParser) -> None:
    """Add --with, which names the robot file, and the options that change its variant."""
    parser.add_argument(
        "--with",
        dest="file",
        required=True,
        metavar="FILE|PLAN",
        help="the robot file with the right poses, or its built plan.json",
    )
    add_variant(parser)


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``rebag``."""
    parser.add_argument("bag", metavar="IN", help="a rosbag2 folder, .mcap or .db3")
    parser.add_argument("out", metavar="OUT", nargs="?", help="the new bag, of the same kind")
    add_with(parser)
    parser.add_argument(
        "--rename",
        action="append",
        default=[],
        metavar="OLD:=NEW",
        help="rename a frame in TF and in every message that names frames; repeatable",
    )
    parser.add_argument(
        "--only-declared",
        action="store_true",
        help="drop edges that the robot file does not declare",
    )
    parser.add_argument(
        "--camera-info",
        action="append",
        default=[],
        metavar="TOPIC=FILE",
        help="replace the camera calibration on this topic; repeatable",
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing; exit 1 if an edge would change",
    )
    add_format(parser, "json")


def run(arguments: Namespace) -> int:
    """Correct the bag; exit code 0, or 1 if --check finds a change or OUT cannot be written."""
    from tfcompose.cli.live import from_bag, recording_day
    from tfcompose.cli.plans import expected_plan
    from tfcompose.foundation.signals import Stop

    if bool(arguments.out) == arguments.check:
        fail("give OUT, where the new bag goes, or --check", UNREADABLE)
    target = None if arguments.check else _target(Path(arguments.out))
    plan, _ = expected_plan(arguments.file, arguments, recording_day(arguments.bag))
    with Stop() as stop:
        rewrite = from_bag(lambda: _rewrite(arguments, plan, stop))
        try:
            counts = from_bag(lambda: _corrected(Path(arguments.bag), target, rewrite))
        except OSError as error:
            reject([_unwritable(arguments.out, error.strerror or str(error))])
    if counts is None:
        return INTERRUPTED
    return _report(arguments, rewrite, counts)


def _target(path: Path) -> Path:
    """Return the path of the new bag.

    Raises:
        SystemExit: after printing why the bag cannot be written there.
    """
    from tfcompose.foundation.reading import exists, is_folder

    if exists(path):
        reject([_unwritable(str(path), "it exists already", "remove it, or give another name")])
    if not is_folder(path.parent):
        reject([_unwritable(str(path), f"there is no folder {path.parent}")])
    return path


def _unwritable(path: str, reason: str, advice: str = "") -> Finding:
    from tfcompose.foundation.findings import finding

    return finding("TF924", f"{path} cannot be written: {reason}", None, help=advice)


def _rewrite(arguments: Namespace, plan: Plan, stop: Stop) -> Rewrite:
    """Return the changes of the bag.

    Raises:
        SystemExit: after printing which option is wrong.
    """
    from tfcompose.tools.rebag.correction import corrections_of
    from tfcompose.tools.rebag.messages import MessageEditor
    from tfcompose.tools.rebag.rewriting import Rewrite

    renames = {
        old.removeprefix("/"): new.removeprefix("/")
        for old, new in pairs(arguments.rename, ":=").items()
    }
    if not all((*renames.keys(), *renames.values())):
        fail("--rename takes the names of two frames: OLD:=NEW", UNREADABLE)
    return Rewrite(
        corrections_of(plan, renames, only_declared=arguments.only_declared),
        MessageEditor(renames, _camera_infos(arguments)),
        _provenance(arguments, plan),
        stop,
    )


def _camera_infos(arguments: Namespace) -> dict[str, CameraInfo]:
    """Return the calibrations of --camera-info by topic.

    Raises:
        SystemExit: after printing which files contain no calibration.
    """
    from tfcompose.cli.reading import read_text
    from tfcompose.foundation.findings import RejectedError, finding
    from tfcompose.tools.rebag.messages import CameraInfoError, camera_info_in

    infos: dict[str, CameraInfo] = {}
    findings: list[Finding] = []
    for topic, file in pairs(arguments.camera_info, "=").items():
        try:
            infos[topic] = camera_info_in(read_text(file))
        except CameraInfoError as error:
            findings.append(finding("TF926", f"{file} is not a camera calibration: {error}", None))
        except RejectedError as error:
            findings += error.findings
    if findings:
        reject(findings)
    return infos


def _provenance(arguments: Namespace, plan: Plan) -> dict[str, str]:
    """Return the entries about the bag's origin for the metadata of the new bag."""
    from tfcompose.foundation.reading import is_file, read_bytes

    file = Path(arguments.file)
    entries = {
        "tfcompose_version": version("tfcompose"),
        "tfcompose_robot": plan.robot,
        "tfcompose_source": Path(arguments.bag).resolve().name,
        "tfcompose_options": json.dumps(
            {
                "profiles": plan.profiles,
                "overlays": plan.overlays,
                "rename": arguments.rename,
                "only_declared": arguments.only_declared,
                "camera_info": arguments.camera_info,
            }
        ),
    }
    if is_file(file):
        entries["tfcompose_file"] = file.name
        entries["tfcompose_sha256"] = hashlib.sha256(read_bytes(file)).hexdigest()
    return entries


def _corrected(path: Path, target: Path | None, rewrite: Rewrite) -> Counter[str] | None:
    """Write the corrected bag, and return its number of messages by topic.

    Without a target, only check the bag, and return no topics. Return None if a signal ended the
    work.

    Raises:
        BagError: if the bag is damaged. OSError: if the new bag cannot be written.
    """
    from tfcompose.tf.bags import ENDINGS
    from tfcompose.tools.rebag.bag import bag_at, check_bag, note_static, write_corrected
    from tfcompose.tools.rebag.rewriting import InterruptedRewrite

    bag = bag_at(path)
    if target is not None and bag.information is None and target.suffix != path.suffix:
        name = target.stem if target.suffix in ENDINGS else target.name
        reason = f"{path} is a file {path.suffix}, and so is its copy"
        reject([_unwritable(str(target), reason, f"name it {name}{path.suffix}")])
    try:
        note_static(bag, rewrite)
        _refuse_other_types(rewrite)
        if target is not None:
            return write_corrected(bag, target, rewrite)
        check_bag(bag, rewrite)
    except InterruptedRewrite:
        return None
    return Counter()


def _refuse_other_types(rewrite: Rewrite) -> None:
    """Refuse --camera-info for topics without camera calibrations.

    Raises:
        SystemExit: after naming the topics.
    """
    from tfcompose.foundation.findings import finding
    from tfcompose.tools.rebag.messages import CAMERA_INFO

    calibrations = sorted(topic for topic, types in rewrite.types.items() if CAMERA_INFO in types)
    advice = f"it has them on {', '.join(calibrations)}" if calibrations else ""
    findings = [
        finding("TF926", f"the bag has no {CAMERA_INFO} on {topic}", None, help=advice)
        for topic in rewrite.messages.camera_infos
        if not {CAMERA_INFO, ""} & rewrite.types.get(topic, set())
    ]
    if findings:
        reject(findings)


def _report(arguments: Namespace, rewrite: Rewrite, counts: Counter[str]) -> int:
    changes = [change for each in rewrite.corrections.values() for change in each.changes()]
    if arguments.format == "json":
        print(json.dumps(_as_json(arguments, rewrite, changes, counts), indent=2))
    else:
        for line in _lines(changes):
            print(line)
        if arguments.out:
            print(f"wrote {arguments.out}: {counts.total()} messages")
    print_findings(warnings_of(rewrite.messages.unknown, rewrite.malformed), sys.stderr)
    changed = any(change.kind != "equal" for change in changes)
    return FAILED if arguments.check and changed else 0


def _as_json(
    arguments: Namespace, rewrite: Rewrite, changes: list[EdgeChange], counts: Counter[str]
) -> dict[str, Any]:
    return {
        "out": arguments.out,
        "edges": [
            {
                "edge": change.edge,
                "change": change.kind,
                "mm": change.offset and change.offset.xyz_m * 1e3,
                "deg": change.offset and math.degrees(change.offset.rot_rad),
                "transforms": change.transforms,
                "recorded_parent": change.parent,
            }
            for change in changes
        ],
        "changed_messages": dict(rewrite.messages.changed),
        "messages": counts.total(),
    }


def _lines(changes: list[EdgeChange]) -> Iterator[str]:
    """Yield a line for each edge that changes."""
    equal = 0
    for change in changes:
        if change.kind == "equal":
            equal += 1
        elif change.kind == "moved" and change.offset:
            yield f"{change.edge}: off by {change.offset.text}"
        elif change.kind == "parent":
            yield f"{change.edge}: recorded below {change.parent}"
        elif change.kind == "added":
            yield f"{change.edge}: not on /tf_static; added"
        else:
            yield f"{change.edge}: {change.kind}, {plural(change.transforms, 'transform')}"
    if equal:
        verb = "matches" if equal == 1 else "match"
        yield f"{plural(equal, 'fixed edge')} already {verb} the robot file"


def warnings_of(unknown: Mapping[str, str], malformed: Mapping[str, int]) -> list[Finding]:
    """Return findings about messages that could not be corrected.

    ``unknown`` contains the message types without a definition, by topic. ``malformed`` contains
    the numbers of messages that could not be decoded, by topic.
    """
    from tfcompose.foundation.findings import finding

    warnings = [
        finding("TF925", f"{topic} may name renamed frames: the bag does not define {type_}", None)
        for topic, type_ in sorted(unknown.items())
    ]
    return warnings + [
        finding("TF925", f"{plural(count, 'message')} on {topic} cannot be decoded and stay", None)
        for topic, count in sorted(malformed.items())
    ]
