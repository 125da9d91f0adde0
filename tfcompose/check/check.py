"""Every rule over one robot. A rule that crashes is a finding, and the others go on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.check.rules.tf201_two_parents import two_parents
from tfcompose.check.rules.tf202_cycle import cycle
from tfcompose.check.rules.tf203_unknown_frame import unknown_frame
from tfcompose.check.rules.tf204_several_roots import several_roots
from tfcompose.check.rules.tf205_edge_given_twice import edge_given_twice
from tfcompose.check.rules.tf206_no_frames import no_frames
from tfcompose.check.rules.tf207_wrong_chain_order import wrong_chain_order
from tfcompose.check.rules.tf208_base_footprint_below_base_link import base_footprint_below_base_link
from tfcompose.check.rules.tf209_unused_frame import unused_frame
from tfcompose.check.rules.tf301_edge_with_two_owners import edge_with_two_owners
from tfcompose.check.rules.tf302_unknown_owner import unknown_owner
from tfcompose.check.rules.tf303_owner_cannot_publish import owner_cannot_publish
from tfcompose.check.rules.tf305_static_edge_with_rate import static_edge_with_rate
from tfcompose.check.rules.tf306_one_node_two_levels import one_node_two_levels
from tfcompose.check.rules.tf307_rate_too_low import rate_too_low
from tfcompose.check.rules.tf308_driver_publishes_too import driver_publishes_too
from tfcompose.check.rules.tf309_many_static_publishers import many_static_publishers
from tfcompose.check.rules.tf310_switched_edge_without_owner import switched_edge_without_owner
from tfcompose.check.rules.tf311_switched_edge_static import switched_edge_static
from tfcompose.check.rules.tf314_publish_frequency_too_low import publish_frequency_too_low
from tfcompose.check.rules.tf334_parameters_of_another_node import parameters_of_another_node
from tfcompose.check.rules.tf335_clocks_mixed import clocks_mixed
from tfcompose.check.rules.tf401_optical_frame_not_rotated import optical_frame_not_rotated
from tfcompose.check.rules.tf410_degrees_as_radians import degrees_as_radians
from tfcompose.check.rules.tf411_rounded_right_angle import rounded_right_angle
from tfcompose.check.rules.tf412_quaternion_w_first import quaternion_w_first
from tfcompose.check.rules.tf413_camera_looks_away import camera_looks_away
from tfcompose.check.rules.tf414_far_from_the_robot import far_from_the_robot
from tfcompose.check.rules.tf501_bad_frame_name import bad_frame_name
from tfcompose.check.rules.tf503_upper_case_name import upper_case_name
from tfcompose.check.rules.tf504_unused_variable import unused_variable
from tfcompose.check.rules.tf615_calibration_probably_inverse import calibration_probably_inverse
from tfcompose.check.rules.tf616_calibration_far_from_nominal import calibration_far_from_nominal
from tfcompose.check.rules.tf617_calibration_all_zero import calibration_all_zero
from tfcompose.check.rules.tf618_calibration_copied import calibration_copied
from tfcompose.check.rules.tf620_camera_without_optical_frame import camera_without_optical_frame
from tfcompose.check.rules.tf621_sensors_at_one_pose import sensors_at_one_pose
from tfcompose.check.rules.tf622_mount_copied import mount_copied
from tfcompose.check.rules.tf623_serial_missing import serial_missing
from tfcompose.check.rules.tf624_serial_used_twice import serial_used_twice
from tfcompose.check.rules.tf701_mimic_without_master import mimic_without_master
from tfcompose.check.rules.tf702_mimic_loop import mimic_loop
from tfcompose.check.rules.tf704_joint_without_limits import joint_without_limits
from tfcompose.check.rules.tf705_inverted_limits import inverted_limits
from tfcompose.check.rules.tf706_zero_limit import zero_limit
from tfcompose.check.rules.tf707_axis_not_unit import axis_not_unit
from tfcompose.check.rules.tf708_mimic_chain import mimic_chain
from tfcompose.check.rules.tf709_inertia_missing import inertia_missing
from tfcompose.check.rules.tf710_impossible_inertia import impossible_inertia
from tfcompose.check.rules.tf711_inertia_off_from_shape import inertia_off_from_shape
from tfcompose.check.rules.tf712_root_link_with_inertia import root_link_with_inertia
from tfcompose.check.rules.tf713_material_with_two_colours import material_with_two_colours
from tfcompose.check.rules.tf714_material_without_colour import material_without_colour
from tfcompose.check.rules.tf715_joint_without_owner import joint_without_owner
from tfcompose.check.rules.tf716_soft_limit_outside import soft_limit_outside
from tfcompose.check.rules.tf717_interface_claimed_twice import interface_claimed_twice
from tfcompose.check.rules.tf718_mimic_joint_commanded import mimic_joint_commanded
from tfcompose.check.rules.tf728_joint_named_like_a_frame import joint_named_like_a_frame
from tfcompose.check.rules.tf730_body_in_no_urdf import body_in_no_urdf
from tfcompose.check.rules.tf731_negative_damping import negative_damping
from tfcompose.check.rules.tf812_start_order_loop import start_order_loop
from tfcompose.check.rules.tf815_process_without_role import process_without_role
from tfcompose.check.rules.tf818_required_without_role import required_without_role
from tfcompose.check.rules.tf847_needed_but_optional import needed_but_optional
from tfcompose.check.rules.tf848_gate_never_opens import gate_never_opens
from tfcompose.findings import Finding, Severity, Span, finding

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.model import Robot


WARNING: Severity = "warning"


@dataclass(frozen=True, slots=True)
class Rule:
    """A code and the function that finds it; the function's name is the rule's, its docstring the rule's page."""

    code: str
    check: Callable[[Robot], Iterator[Finding]]
    severity: Severity = "error"

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
    Rule("TF207", wrong_chain_order, WARNING),
    Rule("TF208", base_footprint_below_base_link, WARNING),
    Rule("TF209", unused_frame),
    Rule("TF301", edge_with_two_owners),
    Rule("TF302", unknown_owner),
    Rule("TF303", owner_cannot_publish),
    Rule("TF305", static_edge_with_rate, WARNING),
    Rule("TF306", one_node_two_levels, WARNING),
    Rule("TF307", rate_too_low, WARNING),
    Rule("TF308", driver_publishes_too, WARNING),
    Rule("TF309", many_static_publishers, WARNING),
    Rule("TF310", switched_edge_without_owner),
    Rule("TF311", switched_edge_static),
    Rule("TF314", publish_frequency_too_low, WARNING),
    Rule("TF334", parameters_of_another_node),
    Rule("TF335", clocks_mixed),
    Rule("TF401", optical_frame_not_rotated),
    Rule("TF410", degrees_as_radians, WARNING),
    Rule("TF411", rounded_right_angle, WARNING),
    Rule("TF412", quaternion_w_first, WARNING),
    Rule("TF413", camera_looks_away, WARNING),
    Rule("TF414", far_from_the_robot, WARNING),
    Rule("TF501", bad_frame_name),
    Rule("TF503", upper_case_name, WARNING),
    Rule("TF504", unused_variable, WARNING),
    Rule("TF615", calibration_probably_inverse),
    Rule("TF616", calibration_far_from_nominal, WARNING),
    Rule("TF617", calibration_all_zero),
    Rule("TF618", calibration_copied, WARNING),
    Rule("TF620", camera_without_optical_frame, WARNING),
    Rule("TF621", sensors_at_one_pose, WARNING),
    Rule("TF622", mount_copied, WARNING),
    Rule("TF623", serial_missing, WARNING),
    Rule("TF624", serial_used_twice),
    Rule("TF701", mimic_without_master),
    Rule("TF702", mimic_loop),
    Rule("TF704", joint_without_limits),
    Rule("TF705", inverted_limits),
    Rule("TF706", zero_limit, WARNING),
    Rule("TF707", axis_not_unit, WARNING),
    Rule("TF708", mimic_chain, WARNING),
    Rule("TF709", inertia_missing, WARNING),
    Rule("TF710", impossible_inertia, WARNING),
    Rule("TF711", inertia_off_from_shape, WARNING),
    Rule("TF712", root_link_with_inertia, WARNING),
    Rule("TF713", material_with_two_colours, WARNING),
    Rule("TF714", material_without_colour),
    Rule("TF715", joint_without_owner),
    Rule("TF716", soft_limit_outside, WARNING),
    Rule("TF717", interface_claimed_twice),
    Rule("TF718", mimic_joint_commanded),
    Rule("TF728", joint_named_like_a_frame, WARNING),
    Rule("TF730", body_in_no_urdf, WARNING),
    Rule("TF731", negative_damping, WARNING),
    Rule("TF812", start_order_loop),
    Rule("TF815", process_without_role, WARNING),
    Rule("TF818", required_without_role, WARNING),
    Rule("TF847", needed_but_optional, WARNING),
    Rule("TF848", gate_never_opens),
)


def as_severe(found: Finding, severity: Severity) -> Finding:
    """Return the finding as a rule of that severity gives it: a rule of errors may warn, one of warnings only warns."""
    return replace(found, severity=WARNING) if severity == WARNING else found


def check(robot: Robot, codes: frozenset[str] | None = None) -> list[Finding]:
    """Return what the rules find, in no particular order; with ``codes`` only the rules of these."""
    found: list[Finding] = []
    for rule in RULES:
        if codes is not None and rule.code not in codes:
            continue
        try:
            found += [as_severe(one, rule.severity) for one in rule.check(robot)]
        except Exception as error:  # noqa: BLE001 (a rule's fault must not hide the others' findings)
            message = f"the rule {rule.code} {rule.name} crashed: {type(error).__name__}: {error}"
            found.append(finding("TF903", message, Span(robot.file), help="this is a fault of tfcompose: report it"))
    return found
