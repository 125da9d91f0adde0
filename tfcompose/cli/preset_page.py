"""The preset of a sensor, or of a node that publishes TF, as data and as a page."""

from __future__ import annotations

import math
import re
import textwrap
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.render.tree import wrap_rows
from tfcompose.compiler.resolve.poses import rotation_of
from tfcompose.compiler.resolve.presets import fill_name, node_preset, node_preset_names
from tfcompose.foundation.geometry import IDENTITY_XYZW
from tfcompose.foundation.numbers import clean_quat, clean_rpy, number
from tfcompose.foundation.yaml_text import flow, parameter
from tfcompose.spec.language.preset import Chosen, FurtherProcess, PresetOptics

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.compiler.resolve import Library
    from tfcompose.spec.language.bodies import ShapeSpec
    from tfcompose.spec.language.node_preset import ClaimSpec
    from tfcompose.spec.language.preset import (
        PresetDriver,
        PresetFrame,
        PresetOption,
        PresetProcess,
        PresetSpec,
    )


#: The placeholder for the sensor's name in names.
NAME = "NAME"


def facts(name: str, library: Library) -> dict[str, Any]:
    """Return the preset as plain data, with the default variant of each option.

    Unknown values are null.
    """
    plain = library.get(name)
    defaults = {
        key: option.default for key, option in plain.options.items() if option.type == "choice"
    }
    preset = library.get(name, defaults)
    return {
        "name": name,
        "vendor": preset.vendor,
        "model": preset.model,
        "kind": preset.kind,
        "about": preset.about,
        "file": library.file(name),
        "extends": preset.extends,
        "mount": _fill_name(preset.mount, preset),
        "root": _fill_name(preset.root or preset.mount, preset),
        "options": {key: _option(option) for key, option in preset.options.items()},
        "frames": [_frame(key, frame, preset) for key, frame in preset.frames.items()],
        "body": _body(preset),
        "optics": [
            {"stream": stream} | _optics(optics, preset)
            for stream, optics in preset.optics.items()
        ],
        "driver": _driver(preset.driver, preset) if preset.driver else None,
        "topics": [
            {"topic": topic}
            | _describe_keys(fields, preset, ("type", "frame", "hard_coded", "rate", "when"))
            for topic, fields in preset.topics.items()
        ],
        "source": [
            _describe_keys(fact, preset, ("repository", "path", "commit", "about"))
            for fact in preset.source
        ],
    }


def text(preset: dict[str, Any], columns: int | None = None) -> str:
    """Return the page. No line is wider than ``columns``."""
    parts = [
        f"{preset['name']}  {preset['vendor']} {preset['model']},"  # noqa: ISC004
        f" {preset['kind']}\n{preset['about']}"
    ]
    if preset["options"]:
        rows = [(key, _option_text(option)) for key, option in preset["options"].items()]
        parts.append("options\n" + _table(rows))
    parts.append(f"frames of a sensor {NAME}\n" + _tree(preset, columns))
    if preset["body"]:
        parts.append(f"body\n  {_body_text(preset['body'])}")
    if preset["optics"]:
        parts.append("optics\n" + _table([_optics_text(stream) for stream in preset["optics"]]))
    parts.append("driver\n" + (_driver_text(preset) if preset["driver"] else "  none known"))
    if preset["topics"]:
        parts.append("messages\n" + _table([_topic(topic) for topic in preset["topics"]]))
    sources = [_source(fact) for fact in preset["source"]] + _optics_sources(preset["optics"])
    if sources:
        parts.append("source\n" + "\n".join(sources))
    return _fit_page("\n\n".join(parts) + "\n", columns)


def _fit_page(page: str, columns: int | None) -> str:
    """Return the page without lines that are wider than ``columns``.

    A row of cells that is too wide continues on the next line after a complete cell.
    """
    if columns is None:
        return page
    lines = []
    for line in page.splitlines():
        name, *cells = re.split(r" {2,}", line.strip())
        parts = (
            wrap_rows([("  ", name, cells)], columns)[0]
            if len(line) > columns and len(cells) > 1
            else [line]
        )
        for part in parts:
            begun = re.match(r" +\S+ {2,}", part)
            indent = begun.end() if begun and begun.end() < columns // 2 else 6
            lines += textwrap.wrap(
                part, columns, subsequent_indent=" " * indent, break_on_hyphens=False
            ) or [""]
    return "".join(f"{line}\n" for line in lines)


def _fill_name(pattern: str, preset: PresetSpec) -> str:
    return fill_name(pattern, NAME, preset.words)


def _plain(value: Any, preset: PresetSpec) -> Any:
    if isinstance(value, str):
        return _fill_name(value, preset)
    if isinstance(value, Chosen):
        fields = {"option": value.option} if value.option else {"when": value.when}
        return (
            fields
            if value.option
            else fields | {"value": value.value, "otherwise": value.otherwise}
        )
    if isinstance(value, dict):
        return {_fill_name(key, preset): _plain(item, preset) for key, item in value.items()}
    return [_plain(item, preset) for item in value] if isinstance(value, (list, tuple)) else value


def _describe_keys(model: Any, preset: PresetSpec, keys: tuple[str, ...]) -> dict[str, Any]:
    """Return the descriptions of the keys' values, without empty descriptions."""
    fields = {key: _plain(getattr(model, key), preset) for key in keys}
    return {key: value for key, value in fields.items() if value not in (None, "", {}, [], False)}


def _option(option: PresetOption) -> dict[str, Any]:
    values = list(option.variants) if option.type == "choice" else list(option.values)
    fields = {
        "type": option.type,
        "values": values,
        "default": option.default,
        "about": option.about,
    }
    return {key: value for key, value in fields.items() if value not in ([], "", None)}


def _frame(name: str, frame: PresetFrame, preset: PresetSpec) -> dict[str, Any]:
    quat = rotation_of(frame, _fill_name(name, preset)) or (
        IDENTITY_XYZW if frame.xyz is not None else None
    )
    fields: dict[str, Any] = {
        "name": _fill_name(name, preset),
        "parent": _fill_name(frame.parent, preset),
        "xyz": list(frame.xyz) if frame.xyz is not None else None,
        "quat_xyzw": list(clean_quat(quat)) if quat else None,
        "nominal": frame.nominal,
        "driver": frame.driver,
    }
    if frame.by_driver:
        fields["by_driver"] = {"parent": _fill_name(frame.by_driver.parent, preset)}
        if frame.by_driver.xyz:
            fields["by_driver"]["xyz"] = list(frame.by_driver.xyz)
    return fields | _describe_keys(frame, preset, ("when", "about"))


def _body(preset: PresetSpec) -> dict[str, Any] | None:
    body = preset.body
    if body is None:
        return None
    fields = {
        "frame": _fill_name(body.frame, preset),
        "shape": _shape(body.shape),
        "xyz": list(body.shape.xyz),
    }
    return fields | ({"mass": body.mass} if body.mass else {})


def _shape(shape: ShapeSpec) -> dict[str, Any]:
    if shape.cylinder:
        return {"cylinder": {"radius": shape.cylinder.radius, "length": shape.cylinder.length}}
    return (
        {"sphere": {"radius": shape.sphere.radius}}
        if shape.sphere
        else {"box": list(shape.box or ())}
    )


def _optics(optics: PresetOptics, preset: PresetSpec) -> dict[str, Any]:
    """Return the known properties of the stream in SI units, always with the stream's frame."""
    keys = tuple(key for key in PresetOptics.model_fields if key != "source")
    sources = [
        {"of": list(source.of), "where": source.where, "quality": source.quality}
        for source in optics.source or ()
    ]
    return _describe_keys(optics, preset, keys) | ({"source": sources} if sources else {})


def _process(process: PresetProcess, preset: PresetSpec) -> dict[str, Any]:
    fields = _describe_keys(
        process, preset, ("package", "executable", "launch", "lifecycle", "params", "args")
    )
    fields["node"] = "/" + "/".join(
        _fill_name(part, preset) for part in (process.namespace, process.node) if part
    )
    if isinstance(process, FurtherProcess) and process.when:
        fields["when"] = process.when
    return fields


def _driver(driver: PresetDriver, preset: PresetSpec) -> dict[str, Any]:
    published = any(frame.driver for frame in preset.frames.values())
    fields = _process(driver, preset) | _describe_keys(
        driver, preset, ("versions", "naming", "on", "about")
    )
    fields["also"] = {
        f"{NAME}_{suffix}": _process(extra, preset) for suffix, extra in driver.also.items()
    }
    fields["tf"] = driver.tf if published else "tfcompose"
    fields["off"] = _plain(driver.off, preset) if published else None
    fields["claims"] = [
        _describe_keys(claim, preset, ("parent", "child", "off", "about"))
        for claim in driver.claims
    ]
    return fields


def _table(rows: Sequence[tuple[str, ...]]) -> str:
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = (
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        for row in rows
    )
    return "\n".join(f"  {line}".rstrip() for line in lines)


def _pairs(values: dict[str, Any]) -> str:
    return ", ".join(f"{key}: {flow(value)}" for key, value in values.items())


def _option_text(option: dict[str, Any]) -> str:
    kind = {"set": "some of ", "choice": "one of ", "bool": "true or false", "text": "a string"}[
        option["type"]
    ]
    default = option.get("default")
    if default is not None:
        default = f", default {default if isinstance(default, str) else flow(default)}"
    about = f": {option['about']}" if "about" in option else ""
    return f"{kind}{', '.join(option.get('values', []))}{default or ''}{about}"


def _tree(preset: dict[str, Any], columns: int | None) -> str:
    below: dict[str, list[dict[str, Any]]] = {}
    for frame in preset["frames"]:
        below.setdefault(frame["parent"], []).append(frame)
    rows = [("", preset["mount"], ("the mount", "", "", ""))]

    def add(parent: str, indent: str) -> None:
        inside = below.get(parent, [])
        for frame in inside:
            last = frame is inside[-1]
            rows.append((f"{indent}{'└── ' if last else '├── '}", frame["name"], _facts_of(frame)))
            add(frame["name"], indent + ("    " if last else "│   "))

    add(preset["mount"], "")
    table = _table([(lines + name, *facts) for lines, name, facts in rows])
    if columns is None or max(map(len, table.splitlines())) <= columns:
        return table
    tight = [(lines, name, [fact for fact in facts if fact]) for lines, name, facts in rows]
    return "\n".join(f"  {line}" for some in wrap_rows(tight, columns - 2) for line in some)


def _facts_of(frame: dict[str, Any]) -> tuple[str, str, str, str]:
    topic = {"static": "driver, /tf_static", "dynamic": "driver, /tf", None: "static"}[
        frame["driver"]
    ]
    when = f"with {_pairs(frame['when'])}" if "when" in frame else ""
    if frame["xyz"] is None:
        return "unknown", topic, when, "give its pose"
    parts = [f"xyz {' '.join(map(number, frame['xyz']))}"] if any(frame["xyz"]) else []
    rpy = clean_rpy(tuple(frame["quat_xyzw"]))
    if any(rpy):
        parts.append(f"rpy {' '.join(number(round(math.degrees(angle), 4)) for angle in rpy)} deg")
    if "by_driver" in frame:
        parts.append(f"the driver makes it a child of {frame['by_driver']['parent']}")
    return "nominal" if frame["nominal"] else "exact", topic, when, "  ".join(parts)


def _body_text(body: dict[str, Any]) -> str:
    mass = f", {number(body['mass'])} kg" if "mass" in body else ", no mass is known"
    return f"{_pairs(body['shape'])} at {flow(body['xyz'])} in {body['frame']}{mass}"


def _describe_start(process: dict[str, Any]) -> str:
    state = ", and makes it active" if "lifecycle" in process else ""
    when = f" ({_pairs(process['when'])})" if "when" in process else ""
    program = process.get("executable") or process.get("launch")
    return f"{process['package']} {program} as {process['node']}{state}{when}"


def _driver_text(preset: dict[str, Any]) -> str:
    driver = preset["driver"]
    rows = [("starts", _describe_start(started)) for started in (driver, *driver["also"].values())]
    rows += [
        (label, driver[key])
        for label, key in (("versions", "versions"), ("note", "about"))
        if key in driver
    ]
    rows += [("names", _pairs(driver["naming"]))] if "naming" in driver else []
    inside = [frame["name"] for frame in preset["frames"] if frame["driver"]]
    if inside:
        rows.append(
            (
                "publishes",
                f"{len(inside)} frames below {preset['root']}; by default tf: {driver['tf']}",
            )
        )
        rows.append(("switch", _pairs(driver["off"]) if driver["off"] else "there is none"))
    else:
        rows.append(("publishes", "no frame inside the sensor"))
    for claim in driver["claims"]:
        about = f" ({claim['about']})" if "about" in claim else ""
        rows.append(
            (
                "claims",
                (
                    f"{claim['parent']} → {claim['child']}{about}; tfcompose sets"
                    f" {_pairs(claim['off'])}"
                ),
            )
        )
    return _table(rows)


def _topic(topic: dict[str, Any]) -> tuple[str, ...]:
    rate = f"{number(float(topic['rate']))} Hz" if "rate" in topic else ""
    frame = f"in {topic['frame']}" + (
        ", which no parameter changes" if topic.get("hard_coded") else ""
    )
    when = f"with {_pairs(topic['when'])}" if "when" in topic else ""
    return topic["topic"], topic["type"], rate, frame, when


def _degrees(sector: Sequence[float]) -> str:
    """Return a sector in degrees.

    The full angle if the sector is symmetric, otherwise its limits.
    """
    start, end = (round(math.degrees(angle), 3) for angle in sector)
    return f"{number(2 * end)} deg" if start == -end else f"{number(start)} to {number(end)} deg"


def _optics_text(optics: dict[str, Any]) -> tuple[str, ...]:
    parts = [
        f"{key} {_degrees(optics[key])}" for key in ("horizontal", "vertical") if key in optics
    ]
    if "diagonal" in optics:
        parts.append(f"diagonal {number(round(math.degrees(optics['diagonal']), 3))} deg")
    parts += [optics["projection"]] if "projection" in optics else []
    parts += ["along -z"] if "backward" in optics else []
    parts += [f"{' x '.join(map(str, optics['resolution']))} px"] if "resolution" in optics else []
    parts += [f"{optics[key]} {key}" for key in ("channels", "samples") if key in optics]
    if "near" in optics or "far" in optics:
        near = number(optics["near"]) if "near" in optics else "?"
        far = number(optics["far"]) if "far" in optics else "?"
        parts.append(f"{near} to {far} m")
    parts += [f"up to {number(optics['rate'])} Hz"] if "rate" in optics else []
    parts += [f"{optics['shutter']} shutter"] if "shutter" in optics else []
    parts += [f"baseline {number(optics['baseline'])} m"] if "baseline" in optics else []
    parts += ["active"] if "active" in optics else []
    when = f"with {_pairs(optics['when'])}" if "when" in optics else ""
    return optics["stream"], f"in {optics['frame']}", when, ", ".join(parts) or "unknown"


def _optics_sources(streams: Sequence[dict[str, Any]]) -> list[str]:
    """Return the sources of the optics' values.

    Each document occurs once, with its kind and the values that it supplies.
    """
    places: dict[tuple[str, str], list[str]] = {}
    for optics in streams:
        for source in optics.get("source", ()):
            keys = places.setdefault((source["where"], source["quality"]), [])
            keys.append(f"{optics['stream']} {', '.join(source['of'])}")
    return [
        f"  {where} ({quality.replace('_', ' ')}): {'; '.join(keys)}"
        for (where, quality), keys in places.items()
    ]


def _source(fact: dict[str, Any]) -> str:
    return f"  {fact['repository']} {fact['path']} at {fact['commit']}" + (
        f": {fact['about']}" if "about" in fact else ""
    )


_ROLE = re.compile(r"\{(\w+)\}")


def node_rows() -> list[dict[str, str]]:
    """Return all presets of nodes as rows of a list, sorted by package."""
    presets = sorted(
        ((name, node_preset(name)) for name in node_preset_names()), key=lambda row: row[1].package
    )
    return [
        {
            "name": name,
            "vendor": preset.package,
            "model": preset.node,
            "kind": "node",
            "about": preset.about,
        }
        for name, preset in presets
    ]


def node_facts(name: str) -> dict[str, Any]:
    """Return the preset of a node as plain data.

    The frames of a claim have their default names.
    """
    preset = node_preset(name)
    usual = {role: frame.default for role, frame in preset.frames.items()}
    return {
        "name": name,
        "package": preset.package,
        "node": preset.node,
        "kind": "node",
        "about": preset.about,
        "frames": {
            role: {"parameter": frame.parameter, "default": frame.default}
            for role, frame in preset.frames.items()
        },
        "one_of": preset.one_of,
        "publishes": [_claim(claim, usual) for claim in preset.publishes],
        "set": preset.set,
        "hint": preset.hint,
        "source": [
            {
                key: getattr(fact, key)
                for key in ("repository", "path", "commit")
                if getattr(fact, key)
            }
            for fact in preset.source
        ],
    }


def _claim(claim: ClaimSpec, usual: Mapping[str, str]) -> dict[str, Any]:
    def with_name(value: Any) -> Any:
        if isinstance(value, str):
            return _ROLE.sub(lambda role: usual.get(role[1], role[0]), value)
        return (
            {key: with_name(item) for key, item in value.items()}
            if isinstance(value, dict)
            else value
        )

    return {
        "parent": with_name(claim.parent),
        "child": with_name(claim.child),
        "topic": "/tf_static" if claim.static else "/tf",
        "by_default": claim.by_default,
        "on": with_name(claim.on),
        "off": with_name(claim.off),
        "chosen_by": with_name(claim.chosen_by),
    }


def node_text(preset: dict[str, Any], columns: int | None = None) -> str:
    """Return the page. No line is wider than ``columns``."""
    parts = [
        f"{preset['name']}  the node {preset['node']} of {preset['package']}\n{preset['about']}"
    ]
    claims = [_claim_text(claim) for claim in preset["publishes"]] or ["no edge by itself"]
    parts.append("publishes" + (", one of these" if preset["one_of"] else ""))
    parts[-1] += "".join(f"\n  {claim}" for claim in claims)
    if preset["frames"]:
        width = max(map(len, preset["frames"]))
        lines = [
            f"  {role:<{width}}  {_role_text(frame)}" for role, frame in preset["frames"].items()
        ]
        parts.append("frames\n" + "\n".join(lines))
    if preset["set"]:
        parts.append(f"also set\n  {_parameters(preset['set'])}")
    if preset["hint"]:
        parts.append(f"note\n  {preset['hint']}")
    sources = [" ".join(str(part) for part in fact.values()) for fact in preset["source"]]
    parts.append("source\n" + "\n".join(f"  {source}" for source in sources))
    return _fit_page("\n\n".join(parts) + "\n", columns)


def _claim_text(claim: dict[str, Any]) -> str:
    how = [claim["topic"]]
    if claim["chosen_by"]:
        how.append(f"with {_parameters(claim['chosen_by'])}")
    elif not claim["by_default"]:
        how.append(f"only with {_parameters(claim['on'])}")
    how.append(f"off: {_parameters(claim['off'])}" if claim["off"] else "no switch")
    return f"{claim['parent']} → {claim['child']}  {', '.join(how)}"


def _role_text(frame: dict[str, Any]) -> str:
    if frame["parameter"] is None:
        return f"{frame['default']}, which no parameter changes"
    return f"{frame['parameter']}, by default {frame['default']}"


def _parameters(values: dict[str, Any]) -> str:
    """Return parameters in the form that ROS parses, where 0.0 and 0 have different types."""
    return _pairs({key: parameter(value) for key, value in values.items()})
