"""Every kind of finding: its code, name, family and severity. A code is never used again for something else.

This module imports nothing of the package and is loaded by every process that can find something.
The page of each code is in ``tfcompose.compiler.pages``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, get_args

Severity = Literal["error", "warning"]

#: Where a finding comes from. Codes of the guard are also found by ``doctor`` and ``verify``, on
#: the live tree.
Family = Literal[
    "load",
    "language",
    "tree",
    "ownership",
    "poses",
    "names",
    "sensors",
    "bodies",
    "processes",
    "guard",
    "live",
    "environment",
]
FAMILIES: tuple[Family, ...] = get_args(Family)


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of finding.

    ``severity`` is that of its findings unless they say otherwise. An ``unbuildable`` robot cannot
    be built while the finding is there: no tree, an edge that nobody publishes, a process that
    never starts. ``limit`` is what ``rules`` can set instead: how far is too far, in SI, and
    whether it is a length (m), an angle (rad) or a part (%).
    """

    code: str
    name: str
    family: Family
    severity: Severity
    unbuildable: bool = False
    limit: tuple[float, str] | None = None

    @property
    def can_be_allowed(self) -> bool:
        """Whether a comment or an entry under ``rules`` may silence it; a file that is not understood has no excuse."""
        return not self.unbuildable and self.family not in {"load", "language"}


CATALOGUE: dict[str, Code] = {
    code.code: code
    for code in (
        # text, YAML, XML, files that are named
        Code("TF001", "unreadable_file", "load", "error"),
        Code("TF002", "syntax", "load", "error"),
        Code("TF003", "duplicate_key", "load", "error"),
        Code("TF004", "key_not_text", "load", "error"),
        Code("TF005", "unknown_tag", "load", "error"),
        Code("TF006", "null_entry", "load", "error"),
        Code("TF007", "not_finite", "load", "error"),
        Code("TF008", "too_large", "load", "error"),
        Code("TF009", "unknown_profile", "load", "error"),
        Code("TF010", "overlay_removes_nothing", "load", "warning"),
        Code("TF011", "bad_merge", "load", "error"),
        Code("TF012", "allow_allows_nothing", "load", "warning"),
        Code("TF013", "allow_without_reason", "load", "warning"),
        Code("TF014", "overlay_changes_nothing", "load", "warning"),
        Code("TF015", "include_loop", "load", "error"),
        Code("TF016", "bad_setting", "load", "error"),
        Code("TF017", "unknown_rule", "load", "error"),
        Code("TF018", "bad_xml", "load", "error"),
        Code("TF019", "file_not_there", "load", "error"),
        Code("TF020", "not_imported", "load", "warning"),
        Code("TF021", "outside_tree", "load", "error"),
        Code("TF022", "unsafe_expression", "load", "error"),
        # keys, types, values
        Code("TF101", "unknown_key", "language", "error"),
        Code("TF102", "missing_key", "language", "error"),
        Code("TF103", "wrong_type", "language", "error"),
        Code("TF104", "unknown_unit", "language", "error"),
        Code("TF105", "bad_expression", "language", "error"),
        Code("TF106", "value_not_allowed", "language", "error"),
        Code("TF107", "keys_exclude_each_other", "language", "error"),
        # parents, cycles, roots
        Code("TF201", "two_parents", "tree", "error", unbuildable=True),
        Code("TF202", "cycle", "tree", "error", unbuildable=True),
        Code("TF203", "unknown_frame", "tree", "error", unbuildable=True),
        Code("TF204", "several_roots", "tree", "error"),
        Code("TF205", "edge_given_twice", "tree", "error"),
        Code("TF206", "no_frames", "tree", "error", unbuildable=True),
        Code("TF207", "wrong_chain_order", "tree", "warning"),
        Code("TF208", "base_footprint_below_base_link", "tree", "warning"),
        Code("TF209", "unused_frame", "tree", "error"),
        # who publishes an edge
        Code("TF301", "edge_with_two_owners", "ownership", "error"),
        Code("TF302", "unknown_owner", "ownership", "error", unbuildable=True),
        Code("TF303", "owner_cannot_publish", "ownership", "error"),
        Code("TF304", "isolated_from_nothing", "ownership", "error"),
        Code("TF305", "static_edge_with_rate", "ownership", "warning"),
        Code("TF306", "one_node_two_levels", "ownership", "warning"),
        Code("TF307", "rate_too_low", "ownership", "warning"),
        Code("TF308", "driver_publishes_too", "ownership", "warning"),
        Code("TF309", "many_static_publishers", "ownership", "warning"),
        Code("TF310", "switched_edge_without_owner", "ownership", "error"),
        Code("TF311", "switched_edge_static", "ownership", "error"),
        Code("TF312", "part_with_other_settings", "ownership", "error"),
        Code("TF313", "part_without_one_root", "ownership", "error"),
        Code("TF314", "publish_frequency_too_low", "ownership", "warning"),
        Code("TF315", "joint_outside_description", "ownership", "error"),
        Code("TF316", "shared_frame_in_description", "ownership", "error"),
        Code("TF317", "stock_publisher_publishes_too", "ownership", "error"),
        Code("TF318", "frame_without_prefix", "ownership", "error"),
        Code("TF330", "node_publishes_too", "ownership", "error"),
        Code("TF331", "claim_not_declared", "ownership", "warning"),
        Code("TF332", "owner_not_known_to_publish", "ownership", "warning"),
        Code("TF333", "parameter_disagrees", "ownership", "error"),
        Code("TF334", "parameters_of_another_node", "ownership", "error"),
        Code("TF335", "clocks_mixed", "ownership", "error"),
        # poses, units, conventions
        Code("TF401", "optical_frame_not_rotated", "poses", "error"),
        Code("TF402", "quaternion_not_unit", "poses", "error"),
        Code("TF403", "rotation_not_orthonormal", "poses", "error"),
        Code("TF404", "pose_cannot_be_solved", "poses", "error"),
        Code("TF405", "placed_by_nominal_values", "poses", "warning"),
        Code("TF410", "degrees_as_radians", "poses", "warning"),
        Code("TF411", "rounded_right_angle", "poses", "warning"),
        Code("TF412", "quaternion_w_first", "poses", "warning"),
        Code("TF413", "camera_looks_away", "poses", "warning"),
        Code("TF414", "far_from_the_robot", "poses", "warning"),
        # names
        Code("TF501", "bad_frame_name", "names", "error"),
        Code("TF502", "name_used_twice", "names", "error"),
        Code("TF503", "upper_case_name", "names", "warning"),
        Code("TF504", "unused_variable", "names", "warning"),
        Code("TF505", "part_brings_a_taken_name", "names", "error"),
        # presets, calibrations, mounts
        Code("TF601", "unknown_preset", "sensors", "error"),
        Code("TF603", "unknown_option", "sensors", "error"),
        Code("TF604", "driver_cannot", "sensors", "error"),
        Code("TF605", "preset_value_unknown", "sensors", "error"),
        Code("TF606", "bad_preset", "sensors", "error"),
        Code("TF607", "preset_shadowed", "sensors", "warning"),
        Code("TF610", "calibration_unreadable", "sensors", "error"),
        Code("TF611", "calibration_format_unknown", "sensors", "error"),
        Code("TF612", "calibration_entry_missing", "sensors", "error"),
        Code("TF613", "calibration_entry_ambiguous", "sensors", "error"),
        Code("TF614", "calibration_not_rigid", "sensors", "error"),
        Code("TF615", "calibration_probably_inverse", "sensors", "error"),
        Code("TF616", "calibration_far_from_nominal", "sensors", "warning"),
        Code("TF617", "calibration_all_zero", "sensors", "error"),
        Code("TF618", "calibration_copied", "sensors", "warning"),
        Code("TF619", "calibration_entry_unused", "sensors", "warning"),
        Code("TF620", "camera_without_optical_frame", "sensors", "warning"),
        Code("TF621", "sensors_at_one_pose", "sensors", "warning"),
        Code("TF622", "mount_copied", "sensors", "warning"),
        Code("TF623", "serial_missing", "sensors", "warning"),
        Code("TF624", "serial_used_twice", "sensors", "error"),
        Code("TF625", "sides_swapped", "sensors", "warning"),
        Code("TF640", "sensor_inside_body", "sensors", "warning", limit=(0.02, "m")),
        Code("TF641", "view_blocked", "sensors", "warning", limit=(0.5, "%")),
        Code("TF642", "blind_sector", "sensors", "warning", limit=(1.5707963267948966, "rad")),
        Code("TF643", "camera_sees_only_robot", "sensors", "warning", limit=(0.95, "%")),
        Code("TF644", "camera_sees_only_floor", "sensors", "warning", limit=(1.0, "m")),
        Code("TF645", "sensors_dazzle_each_other", "sensors", "warning", limit=(5.0, "m")),
        Code("TF646", "zone_not_covered", "sensors", "warning"),
        # joints, bodies, materials, foreign URDFs, meshes
        Code("TF701", "mimic_without_master", "bodies", "error"),
        Code("TF702", "mimic_loop", "bodies", "error"),
        Code("TF703", "unknown_joint", "bodies", "error"),
        Code("TF704", "joint_without_limits", "bodies", "error"),
        Code("TF705", "inverted_limits", "bodies", "error"),
        Code("TF706", "zero_limit", "bodies", "warning"),
        Code("TF707", "axis_not_unit", "bodies", "warning"),
        Code("TF708", "mimic_chain", "bodies", "warning"),
        Code("TF709", "inertia_missing", "bodies", "warning"),
        Code("TF710", "impossible_inertia", "bodies", "warning"),
        Code("TF711", "inertia_off_from_shape", "bodies", "warning"),
        Code("TF712", "root_link_with_inertia", "bodies", "warning"),
        Code("TF713", "material_with_two_colours", "bodies", "warning"),
        Code("TF714", "material_without_colour", "bodies", "error"),
        Code("TF715", "joint_without_owner", "bodies", "error"),
        Code("TF716", "soft_limit_outside", "bodies", "warning"),
        Code("TF717", "interface_claimed_twice", "bodies", "error"),
        Code("TF718", "mimic_joint_commanded", "bodies", "error"),
        Code("TF719", "xml_block_out_of_place", "bodies", "error"),
        Code("TF720", "unknown_urdf_word", "bodies", "error"),
        Code("TF721", "bad_urdf_value", "bodies", "error"),
        Code("TF722", "urdf_name_twice", "bodies", "error"),
        Code("TF723", "mesh_not_found", "bodies", "error"),
        Code("TF724", "package_not_found", "bodies", "error"),
        Code("TF725", "mesh_without_volume", "bodies", "error"),
        Code("TF726", "mesh_in_no_package", "bodies", "error"),
        Code("TF727", "joint_key_without_effect", "bodies", "warning"),
        Code("TF728", "joint_named_like_a_frame", "bodies", "warning"),
        Code("TF729", "substitution_in_urdf", "bodies", "warning"),
        Code("TF730", "body_in_no_urdf", "bodies", "warning"),
        Code("TF731", "negative_damping", "bodies", "warning"),
        # processes, the guard and the live tree
        Code("TF801", "foreign_publisher", "guard", "error"),
        Code("TF802", "second_parent_seen", "guard", "error"),
        Code("TF803", "undeclared_edge", "guard", "error"),
        Code("TF804", "owner_silent", "guard", "error"),
        Code("TF805", "owner_slow", "guard", "warning"),
        Code("TF806", "volatile_static_writer", "guard", "error"),
        Code("TF807", "edge_taken_before_start", "guard", "error"),
        Code("TF808", "process_failed", "processes", "error"),
        Code("TF809", "wrong_topic", "guard", "error"),
        Code("TF810", "executable_not_found", "processes", "error"),
        Code("TF811", "edge_never_seen", "live", "error"),
        Code("TF812", "start_order_loop", "processes", "error", unbuildable=True),
        Code("TF813", "unknown_process", "processes", "error", unbuildable=True),
        Code("TF814", "no_live_pose", "live", "error"),
        Code("TF815", "process_without_role", "processes", "warning"),
        Code("TF816", "path_cannot_be_told", "processes", "error"),
        Code("TF817", "process_not_ready", "processes", "error"),
        Code("TF818", "required_without_role", "processes", "warning"),
        Code("TF819", "unknown_host", "processes", "error"),
        Code("TF820", "live_loop", "guard", "error"),
        Code("TF821", "self_transform", "guard", "warning"),
        Code("TF822", "two_writers", "guard", "warning"),
        Code("TF823", "stamp_repeated", "guard", "warning"),
        Code("TF824", "stamp_went_back", "guard", "warning"),
        Code("TF825", "wrong_clock", "guard", "error"),
        Code("TF826", "best_effort_writer", "guard", "error"),
        Code("TF827", "isolation_leak", "guard", "error"),
        Code("TF828", "driver_pose_differs", "live", "warning"),
        Code("TF829", "switch_not_taken", "processes", "error"),
        Code("TF830", "two_trees", "live", "error"),
        Code("TF831", "refused_transform", "live", "error"),
        Code("TF832", "wrong_type_on_tf", "live", "error"),
        Code("TF833", "stamped_late", "live", "warning"),
        Code("TF834", "host_clock_off", "live", "error"),
        Code("TF835", "stamped_ahead", "live", "warning"),
        Code("TF836", "clock_missing", "live", "error"),
        Code("TF837", "two_clocks", "live", "error"),
        Code("TF838", "low_rate_seen", "live", "warning"),
        Code("TF839", "gap", "live", "warning"),
        Code("TF840", "data_frame_unknown", "live", "error"),
        Code("TF841", "data_beyond_tf", "live", "error"),
        Code("TF842", "joint_states_unheard", "live", "warning"),
        Code("TF843", "no_joint_states", "live", "error"),
        Code("TF844", "joint_without_state", "live", "error"),
        Code("TF845", "no_tf", "live", "error"),
        Code("TF846", "wrong_live_pose", "live", "error"),
        Code("TF847", "needed_but_optional", "processes", "warning"),
        Code("TF848", "gate_never_opens", "processes", "error"),
        Code("TF849", "volatile_static_reader", "live", "warning"),
        Code("TF850", "latched_edge_replaced", "guard", "warning"),
        Code("TF851", "key_without_effect", "processes", "warning"),
        Code("TF852", "past_the_fence", "guard", "error"),
        Code("TF853", "too_much_tf", "guard", "error"),
        Code("TF854", "other_robot", "guard", "error"),
        Code("TF855", "component_elsewhere", "processes", "error"),
        Code("TF856", "container_without_components", "processes", "warning"),
        Code("TF857", "host_not_declared", "processes", "error"),
        Code("TF858", "host_without_processes", "processes", "warning"),
        Code("TF859", "parameter_with_unit", "processes", "warning"),
        Code("TF870", "not_with_this_rmw", "processes", "error"),
        Code("TF871", "other_rmw", "processes", "error"),
        Code("TF872", "second_router", "processes", "error"),
        Code("TF873", "router_out_of_reach", "processes", "error"),
        Code("TF880", "fleet_edge_twice", "processes", "error"),
        Code("TF881", "robots_apart", "processes", "warning"),
        Code("TF882", "router_not_reached", "live", "error"),
        Code("TF883", "stale_link", "live", "error"),
        Code("TF884", "shared_edge_missing", "live", "error"),
        Code("TF885", "robot_clock_differs", "live", "warning"),
        Code("TF886", "fleet_robot_unknown", "processes", "error"),
        Code("TF887", "shared_edge_unknown", "processes", "warning"),
        # ROS, plans, bags, extras
        Code("TF901", "no_ros", "environment", "error"),
        Code("TF902", "bad_plan", "environment", "error"),
        Code("TF903", "rule_crashed", "environment", "error"),
        # TF904 was no_xacro, from when xacro was no dependency.
        Code("TF905", "no_trimesh", "environment", "error"),
        Code("TF906", "no_rosbags", "environment", "error"),
        Code("TF907", "bad_bag", "environment", "error"),
        Code("TF908", "other_ros_settings", "environment", "warning"),
        Code("TF909", "ros_settings_contradict", "environment", "error"),
        Code("TF910", "written_otherwise", "environment", "error"),
        Code("TF911", "setting_refused", "environment", "error"),
        Code("TF912", "not_deployable", "environment", "error"),
        Code("TF913", "host_unreachable", "environment", "error"),
        Code("TF914", "host_unfit", "environment", "error"),
        Code("TF915", "host_locked", "environment", "error"),
        Code("TF916", "hosts_apart", "environment", "error"),
        Code("TF917", "release_failed", "environment", "error"),
        Code("TF920", "no_zenoh", "environment", "error"),
        Code("TF921", "not_confined", "environment", "warning"),
    )
}


def code_of(word: str) -> str | None:
    """Return the code that a code in any case, or a name, means; None if there is none."""
    upper = word.upper()
    return (
        upper
        if upper in CATALOGUE
        else next((code.code for code in CATALOGUE.values() if code.name == word), None)
    )


def similar_words(word: str) -> list[str]:
    """Return the codes and names that an unknown word may be a slip of: none if it is a whole code, as TF999 is."""
    if re.fullmatch(r"TF\d{3}", word.upper()):
        return []
    return [*CATALOGUE, *(code.name for code in CATALOGUE.values())]


def can_be_allowed(code: str) -> bool:
    """Return whether findings of the code can be silenced; those of an unknown code cannot."""
    return code in CATALOGUE and CATALOGUE[code].can_be_allowed
