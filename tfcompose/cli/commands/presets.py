"""List the presets of sensors and nodes, or show one.

List the presets of sensors and of nodes that publish TF, or show one. A sensor's page has its
frames and their poses, the frames that its driver publishes, the parameter that turns this off,
and the frame of each message. A node's page has the edges it publishes, the parameters for frame
names, and the parameter that turns it off. Both name the sources of the numbers.
"""

from __future__ import annotations

import json
import sys
from itertools import groupby
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import print_findings, table_width, warn
from tfcompose.foundation.text import plural

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.compiler.resolve import Library
    from tfcompose.spec.language.preset import PresetSpec


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help=(
            "a preset to show; or a vendor, package, kind, part of a name or a word from the "
            "description, to list the presets that match"
        ),
    )
    parser.add_argument(
        "--preset-path",
        action="append",
        default=[],
        metavar="DIR",
        help="search this folder first; repeatable",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def run(arguments: Namespace) -> int:
    """Print the list or the page. Return 1 if the preset does not exist or is invalid."""
    from tfcompose.cli import preset_page
    from tfcompose.cli.compiling import library
    from tfcompose.compiler.resolve.presets import node_preset_names
    from tfcompose.foundation.findings import RejectedError

    presets = library().over(arguments.preset_path)
    name = arguments.name
    try:
        if name and presets.file(name) and "/_" not in name:
            return _show(preset_page.facts(name, presets), arguments.format)
        if name in node_preset_names():
            return _show(preset_page.node_facts(name), arguments.format)
        return _list(name, presets, arguments.format)
    except RejectedError as error:
        print_findings(error.findings, sys.stderr)
        return 1


def _show(facts: dict[str, Any], form: str) -> int:
    from tfcompose.cli import preset_page

    text_of = preset_page.node_text if facts["kind"] == "node" else preset_page.text
    columns = table_width(sys.stdout)
    text = text_of(facts, columns and columns - 1)
    sys.stdout.write(
        json.dumps(facts, indent=2, ensure_ascii=False) + "\n" if form == "json" else text
    )
    return 0


def _list(only: str | None, all_presets: Library, form: str) -> int:
    from tfcompose.cli import preset_page
    from tfcompose.cli.tables import shorten
    from tfcompose.foundation.findings import did_you_mean

    presets = {name: all_presets.get(name) for name in all_presets.names}
    rows: list[dict[str, str]] = [
        {
            "name": name,
            "vendor": preset.vendor,
            "model": preset.model,
            "kind": preset.kind,
            "about": preset.about,
        }
        | _likeness(preset, all_presets)
        for name, preset in presets.items()
    ]
    rows += preset_page.node_rows()
    kinds = sorted({kind for row in rows for kind in _words(row)})
    chosen = {only, *_KINDS.get(only or "", ())}
    exact = [row for row in rows if not only or not chosen.isdisjoint(_words(row))]
    partly = [row for row in rows if only and any(only.lower() in kind for kind in _words(row))]
    rows = (
        exact or partly or [row for row in rows if only and only.lower() in row["about"].lower()]
    )
    if not rows:
        warn(
            f"no preset, vendor or kind {only};"
            f" {did_you_mean(only or '', kinds, 'tfcompose presets lists them')}"
        )
        return 1
    if form == "json":
        sys.stdout.write(json.dumps(rows, indent=2, ensure_ascii=False) + "\n")
        return 0
    width = max((len(row["name"]) for row in rows), default=0)
    columns = table_width(sys.stdout)
    blocks = []
    for vendor, group in groupby(rows, lambda row: row["vendor"]):
        lines = [f"  {row['name']:<{width}}  {row['kind']:<10}  {_about(row)}" for row in group]
        lines = [shorten(line, columns - 1, at_end=True) for line in lines] if columns else lines
        blocks.append("\n".join([vendor, *lines]))
    sys.stdout.write(
        "\n\n".join(blocks)
        + f"\n\n{plural(len(rows), 'preset')}; tfcompose presets NAME shows one\n"
    )
    return 0


def _likeness(preset: PresetSpec, presets: Library) -> dict[str, str]:
    """Return the model with the same frames, or the model on which the preset is based."""
    if not preset.extends or "/_" in preset.extends:
        return {}
    base = presets.get(preset.extends)
    same = (preset.mount, preset.frames, preset.options) == (
        base.mount,
        base.frames,
        base.options,
    )
    return {"same_as" if same else "made_from": preset.extends}


def _about(row: dict[str, str]) -> str:
    like = (
        f" (= {row['same_as']})"
        if "same_as" in row
        else f" (from {row['made_from']})"
        if "made_from" in row
        else ""
    )
    return f"{row['model']}: {row['about']}{like}"


#: Names for several kinds of sensors together.
_KINDS = {
    "camera": ("rgbd", "stereo"),
    "lidar": ("lidar2d", "lidar3d"),
    "depth": ("rgbd", "stereo"),
    "scanner": ("lidar2d",),
    "gps": ("gnss",),
    "sonar": ("ultrasonic",),
}


def _words(row: dict[str, str]) -> tuple[str, ...]:
    name = row["name"]
    return (name, row["vendor"] if row["kind"] == "node" else name.partition("/")[0], row["kind"])
