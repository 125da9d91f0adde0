"""Every rule over one robot. A rule that crashes is a finding, and the others go on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.check.rules.tf201_two_parents import two_parents
from tfcompose.check.rules.tf202_cycle import cycle
from tfcompose.check.rules.tf203_unknown_frame import unknown_frame
from tfcompose.check.rules.tf204_several_roots import several_roots
from tfcompose.check.rules.tf205_edge_given_twice import edge_given_twice
from tfcompose.check.rules.tf206_no_frames import no_frames
from tfcompose.check.rules.tf301_edge_with_two_owners import edge_with_two_owners
from tfcompose.check.rules.tf302_unknown_owner import unknown_owner
from tfcompose.check.rules.tf303_owner_cannot_publish import owner_cannot_publish
from tfcompose.check.rules.tf401_optical_frame_not_rotated import optical_frame_not_rotated
from tfcompose.check.rules.tf501_bad_frame_name import bad_frame_name
from tfcompose.check.rules.tf615_calibration_probably_inverse import calibration_probably_inverse
from tfcompose.check.rules.tf616_calibration_far_from_nominal import calibration_far_from_nominal
from tfcompose.check.rules.tf617_calibration_all_zero import calibration_all_zero
from tfcompose.check.rules.tf618_calibration_copied import calibration_copied
from tfcompose.check.rules.tf701_mimic_without_master import mimic_without_master
from tfcompose.check.rules.tf702_mimic_loop import mimic_loop
from tfcompose.check.rules.tf704_joint_without_limits import joint_without_limits
from tfcompose.check.rules.tf812_start_order_loop import start_order_loop
from tfcompose.diagnostic import Diagnostic, Span, finding

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.model import Robot


@dataclass(frozen=True, slots=True)
class Rule:
    """A code and the function that finds it; the function's name is the rule's, its docstring the rule's page."""

    code: str
    check: Callable[[Robot], Iterator[Diagnostic]]

    @property
    def name(self) -> str:
        """The rule's name."""
        return self.check.__name__


RULES: tuple[Rule, ...] = (
    Rule("TF201", two_parents),
    Rule("TF202", cycle),
    Rule("TF203", unknown_frame),
    Rule("TF204", several_roots),
    Rule("TF205", edge_given_twice),
    Rule("TF206", no_frames),
    Rule("TF301", edge_with_two_owners),
    Rule("TF302", unknown_owner),
    Rule("TF303", owner_cannot_publish),
    Rule("TF401", optical_frame_not_rotated),
    Rule("TF501", bad_frame_name),
    Rule("TF615", calibration_probably_inverse),
    Rule("TF616", calibration_far_from_nominal),
    Rule("TF617", calibration_all_zero),
    Rule("TF618", calibration_copied),
    Rule("TF701", mimic_without_master),
    Rule("TF702", mimic_loop),
    Rule("TF704", joint_without_limits),
    Rule("TF812", start_order_loop),
)


def check(robot: Robot) -> list[Diagnostic]:
    """Return what the rules find, in no particular order."""
    found: list[Diagnostic] = []
    for rule in RULES:
        try:
            found += rule.check(robot)
        except Exception as error:  # noqa: BLE001 (a rule's fault must not hide the others' findings)
            message = f"the rule {rule.code} {rule.name} crashed: {type(error).__name__}: {error}"
            found.append(finding("TF903", message, Span(robot.file), help="this is a fault of tfcompose: report it"))
    return found
