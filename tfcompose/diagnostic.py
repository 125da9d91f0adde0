"""What tfcompose says about a robot: findings with a code, a place and a way out.

One space of codes serves lint, guard and the live tools, so that a second publisher that was predicted and one that
was seen read alike. A code is never used again for something else.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a file. Lines and columns count from 1; the end is exclusive."""

    file: str
    line: int = 1
    column: int = 1
    end_line: int = 1
    end_column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Note:
    """A further place, or fact, that belongs to a finding."""

    message: str
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Edit:
    """A stretch of a file and the text that belongs there. An empty stretch inserts.

    ``text`` is a scalar's value, which keeps the quotes that stand there, or YAML that is written as it is.
    """

    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding.

    ``message`` is one line with the names and values involved and holds no advice; advice is ``help``; the other
    place of a conflict is a note. ``span`` is None for what was seen on a live tree. ``edits`` together are the one
    safe answer, where there is one.
    """

    code: str
    name: str
    severity: Severity
    message: str
    span: Span | None = None
    notes: tuple[Note, ...] = ()
    help: str = ""
    edits: tuple[Edit, ...] = ()

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """By place, then by code: the order in which findings are shown."""
        at = self.span or Span("")
        return (at.file, at.line, at.column, self.code, self.message)


@dataclass(frozen=True, slots=True)
class Allow:
    """A comment in a file that lets findings with these codes stand on ``line``, and says why."""

    codes: tuple[str, ...]
    line: int
    reason: str
    at: Span


class RejectedError(Exception):
    """Raised by a stage that cannot go on; it holds everything that the stage found, in order."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(sorted(diagnostics, key=lambda found: found.sort_key))
        super().__init__("; ".join(found.message for found in self.diagnostics))


def finding(  # noqa: PLR0913 (a finding has that many parts; all but three are named)
    code: str,
    message: str,
    span: Span | None,
    *,
    help: str = "",  # noqa: A002 (the field's name)
    notes: Iterable[Note] = (),
    severity: Severity = "error",
    edits: Iterable[Edit] = (),
) -> Diagnostic:
    """Return the finding with the name that ``CODES`` gives its code."""
    return Diagnostic(code, CODES[code], severity, message, span, tuple(notes), help, tuple(edits))


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that a person most likely meant by ``word``, or None."""
    find = import_module("difflib").get_close_matches  # loaded when a word is wrong
    found = find(word.lower(), {name.lower(): name for name in known}, n=1, cutoff=0.6)
    return next((name for name in known if name.lower() == found[0]), None) if found else None


def slip_of(word: str, known: Iterable[str]) -> str | None:
    """Return the only known word that ``word`` is a slip of the pen away from, or None.

    That is: another case; or else one letter too many, too few, wrong, or changed for its neighbour.
    """
    others = [name for name in known if name != word]
    cased = [name for name in others if name.lower() == word.lower()]
    near = cased or [name for name in others if len(word) > 1 and _is_one_slip(word, name)]
    return near[0] if len(near) == 1 else None


def _is_one_slip(a: str, b: str) -> bool:
    if abs(len(a) - len(b)) > 1:
        return False
    same = next((at for at, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    a, b = a[same:], b[same:]
    swapped = a[1::-1] == b[:2] and a[2:] == b[2:] and len(a) > 1
    return a[1:] == b[1:] or a[1:] == b or a == b[1:] or swapped


def did_you_mean(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return advice that names the word that was probably meant, or ``otherwise`` where none is near."""
    near = nearest(word, list(known))
    return f"did you mean {near}?" if near else otherwise


# Every code with its name. Those of the check stage have a file each in ``tfcompose/check/rules``.
CODES = {
    # text and YAML
    "TF001": "unreadable_file",
    "TF002": "syntax",
    "TF003": "duplicate_key",
    "TF004": "key_not_text",
    "TF005": "unknown_tag",
    "TF006": "null_entry",
    "TF007": "not_finite",
    "TF008": "too_large",
    "TF009": "unknown_profile",
    "TF010": "overlay_removes_nothing",
    "TF011": "bad_merge",
    "TF012": "allow_allows_nothing",
    "TF013": "allow_without_reason",
    "TF014": "overlay_changes_nothing",
    "TF015": "include_loop",
    "TF016": "bad_setting",
    "TF017": "unknown_rule",
    "TF018": "bad_xml",
    # validate: keys, types, values
    "TF101": "unknown_key",
    "TF102": "missing_key",
    "TF103": "wrong_type",
    "TF104": "unknown_unit",
    "TF105": "bad_expression",
    "TF106": "value_not_allowed",
    "TF107": "keys_exclude_each_other",
    # the tree
    "TF201": "two_parents",
    "TF202": "cycle",
    "TF203": "unknown_frame",
    "TF204": "several_roots",
    "TF205": "edge_given_twice",
    "TF206": "no_frames",
    "TF207": "wrong_chain_order",
    "TF208": "base_footprint_below_base_link",
    # ownership
    "TF301": "edge_with_two_owners",
    "TF302": "unknown_owner",
    "TF303": "owner_cannot_publish",
    "TF304": "isolated_from_nothing",
    "TF305": "static_edge_with_rate",
    "TF306": "one_node_two_levels",
    "TF307": "rate_too_low",
    "TF308": "driver_publishes_too",
    # poses and conventions
    "TF401": "optical_frame_not_rotated",
    "TF402": "quaternion_not_unit",
    "TF403": "rotation_not_orthonormal",
    "TF404": "pose_cannot_be_solved",
    "TF405": "placed_by_nominal_values",
    "TF410": "degrees_as_radians",
    "TF411": "rounded_right_angle",
    "TF412": "quaternion_w_first",
    "TF413": "camera_looks_away",
    "TF414": "far_from_the_robot",
    # names
    "TF501": "bad_frame_name",
    "TF502": "name_used_twice",
    "TF503": "upper_case_name",
    "TF504": "unused_variable",
    # sensors
    "TF601": "unknown_preset",
    "TF603": "unknown_option",
    "TF604": "driver_cannot",
    "TF610": "calibration_unreadable",
    "TF611": "calibration_format_unknown",
    "TF612": "calibration_entry_missing",
    "TF613": "calibration_entry_ambiguous",
    "TF614": "calibration_not_rigid",
    "TF615": "calibration_probably_inverse",
    "TF616": "calibration_far_from_nominal",
    "TF617": "calibration_all_zero",
    "TF618": "calibration_copied",
    "TF619": "calibration_entry_unused",
    "TF620": "camera_without_optical_frame",
    "TF621": "sensors_at_one_pose",
    "TF622": "mount_copied",
    "TF623": "serial_missing",
    "TF624": "serial_used_twice",
    # bodies and joints
    "TF701": "mimic_without_master",
    "TF702": "mimic_loop",
    "TF703": "unknown_joint",
    "TF704": "joint_without_limits",
    "TF705": "inverted_limits",
    "TF706": "zero_limit",
    "TF707": "axis_not_unit",
    "TF708": "mimic_chain",
    "TF709": "inertia_missing",
    "TF710": "impossible_inertia",
    "TF711": "inertia_off_from_shape",
    "TF712": "root_link_with_inertia",
    # a URDF that somebody else wrote
    "TF720": "unknown_urdf_word",
    "TF721": "bad_urdf_value",
    "TF722": "urdf_name_twice",
    "TF723": "mesh_not_found",
    "TF724": "package_not_found",
    # processes, guard, live tree
    "TF801": "foreign_publisher",
    "TF802": "second_parent_seen",
    "TF803": "undeclared_edge",
    "TF804": "owner_silent",
    "TF805": "owner_slow",
    "TF806": "volatile_static_writer",
    "TF807": "edge_taken_before_start",
    "TF808": "process_failed",
    "TF809": "wrong_topic",
    "TF810": "executable_not_found",
    "TF811": "edge_never_seen",
    "TF812": "start_order_loop",
    "TF813": "unknown_process",
    "TF814": "no_live_pose",
    "TF815": "process_without_role",
    # the environment
    "TF901": "no_ros",
    "TF902": "bad_plan",
    "TF903": "rule_crashed",
    "TF904": "no_xacro",
}
