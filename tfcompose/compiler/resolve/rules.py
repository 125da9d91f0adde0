"""The section ``rules``, resolved: limits of codes, and zones that sensors must cover."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.catalogue import CATALOGUE, code_of
from tfcompose.foundation.findings import finding
from tfcompose.foundation.units import ANGLE, LENGTH, NUMBER
from tfcompose.model.robot import Zone
from tfcompose.spec.language.rules import RuleSpec

if TYPE_CHECKING:
    from tfcompose.compiler.resolve.draft import Finds
    from tfcompose.spec.language.robot import RobotSpec

#: Kinds of limits by the limit's unit in the catalogue: dimension, name, and an example.
_KINDS = {
    "m": (LENGTH, "a length", "5 cm"),
    "rad": (ANGLE, "an angle", "45 deg"),
    "%": (NUMBER, "a percentage", "30 %"),
}


def limits_of(spec: RobotSpec) -> Finds[dict[str, float]]:
    """Return the limits that the file sets, in SI units, by code."""
    limits = {}
    for name, setting in spec.rules.items():
        code = code_of(name)
        if code is None or not isinstance(setting, RuleSpec) or setting.limit is None:
            continue
        span = spec.span_of(("rules", name, "limit"))
        limit = CATALOGUE[code].limit
        if limit is None:
            limited_codes = ", ".join(code.code for code in CATALOGUE.values() if code.limit)
            yield finding(
                "TF107",
                f"{code} {CATALOGUE[code].name} has no limit",
                span,
                help=f"these have one: {limited_codes}",
            )
            continue
        dimension, kind, sample = _KINDS[limit[1]]
        if setting.limit.dimension not in {NUMBER, dimension}:
            message = f"the limit of {code} is {kind}"
            yield finding("TF104", message, span, help=f"for example {sample}")
        else:
            limits[code] = setting.limit.value
    return limits


def zones_of(spec: RobotSpec) -> tuple[Zone, ...]:
    """Return the zones that the robot's sensors must cover."""
    return tuple(
        Zone(
            name,
            spec.key_span(("coverage", name)),
            zone.frame,
            center=zone.center,
            size=zone.box,
            by=zone.by,
            least=zone.least,
        )
        for name, zone in spec.coverage.items()
    )
