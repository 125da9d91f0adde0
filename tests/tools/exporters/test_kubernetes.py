"""The plan for Kubernetes: valid objects, one publisher an edge, targeted restarts."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import kubernetes_validate
import pytest
import yaml

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.plans import built, compiled_plan
from tests.support.robots import DRIVEN
from tfcompose.model.plan.file import read_plan
from tfcompose.tools.exporters.kubernetes import Cluster, cluster_name, files_of, kubernetes

ROBOTS = Path(__file__).parents[3] / "robots"
VERSIONS = ("1.31", "1.37")

HOSTED = """
tfcompose: 1
robot: big_rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  mast: {parent: base_link, xyz: [0, 0, 1]}
processes:
  static: {host: brain}
  spawner: {run: [spawn, "$(HOME)"], host: brain}
  drive: {run: [drive], node: drive, ready: {time: 3 s}, host: rear.local, after: {spawner: done, static: ready}}
  late: {run: [late], host: rear.local, after: {drive: ready, spawner: started}}
"""  # noqa: E501 (a text as its reader has it)


def manifests(
    text: str, cluster: Cluster | None = None, **changes: str
) -> tuple[dict[str, Any], list[str]]:
    """Return the objects of a robot by their files, and what is not kept.

    ``changes`` replace files' texts.
    """
    files = built(text) | changes
    plan = read_plan(files["plan.json"], "plan.json")
    paths = {path for process in plan.started for path in files_of(plan, process)}
    made, gaps = kubernetes(
        plan, cluster or Cluster("robot:1"), {path: files[path] for path in sorted(paths)}
    )
    return {file.path: yaml.safe_load(file.text) for file in made}, gaps


def workloads(made: dict[str, Any]) -> dict[str, Any]:
    return {
        document["metadata"]["name"]: document
        for document in made.values()
        if document["kind"] in ("StatefulSet", "Job")
    }


def pod_of(made: dict[str, Any], name: str) -> dict[str, Any]:
    (workload,) = [workload for path, workload in workloads(made).items() if path.startswith(name)]
    pod: dict[str, Any] = workload["spec"]["template"]
    return pod


@pytest.mark.parametrize("version", VERSIONS)
def test_kubernetes_takes_the_objects_of_every_robot(version: str) -> None:
    texts = [
        DRIVEN,
        HOSTED,
        *(
            (path.read_text("utf-8"))
            for path in sorted(ROBOTS.glob("*.yaml"))
            if path.stem not in {"picker", "two_rovers"}
        ),
    ]
    for text in texts:
        for cluster in (Cluster("robot:1"), Cluster("robot:1", "/opt/robot")):
            made, _ = manifests(text, cluster)
            resources = made.pop("kustomization.yaml")["resources"]
            assert set(resources) == set(made)
            for document in made.values():
                kubernetes_validate.validate(document, version, strict=True)
            assert len(workloads(made)) == len(made) - (1 if cluster.folder else 2)


def test_no_edge_has_two_publishers_during_an_update() -> None:
    """A StatefulSet of one pod promises at most one; nothing else does."""
    made, _ = manifests(DRIVEN)
    for workload in workloads(made).values():
        assert (workload["kind"], workload["spec"]["replicas"]) == ("StatefulSet", 1)
        assert (
            workload["spec"]["selector"]["matchLabels"]
            == workload["spec"]["template"]["metadata"]["labels"]
        )


def test_a_process_awaited_until_done_is_a_job_and_each_runs_on_its_host() -> None:
    made, gaps = manifests(HOSTED)
    kinds = {name: workload["kind"] for name, workload in workloads(made).items()}
    (spawner,) = [name for name in kinds if name.startswith("big-rover-spawner-")]
    assert kinds[spawner] == "Job"
    assert workloads(made)[spawner]["spec"]["template"]["spec"]["restartPolicy"] == "OnFailure"
    fewer, _ = manifests(
        HOSTED.replace("spawner: {", "spawner: {restart: on-failure, max_restarts: 2, ")
    )
    (job,) = [workload for workload in workloads(fewer).values() if workload["kind"] == "Job"]
    assert job["spec"]["backoffLimit"] == 2
    assert {kinds[f"big-rover-{name}"] for name in ("static", "drive", "late", "guard")} == {
        "StatefulSet"
    }
    hosts = {
        name: pod_of(made, f"big-rover-{name}")["spec"].get("nodeSelector")
        for name in ("static", "drive", "guard")
    }
    on = "kubernetes.io/hostname"
    assert hosts == {"static": {on: "brain"}, "drive": {on: "rear.local"}, "guard": None}
    declared = "hosts: {brain: {node_selector: {computer: big}}, rear.local: {}}\nprocesses:\n"
    labelled, _ = manifests(HOSTED.replace("processes:\n", declared))
    hosts = {
        name: pod_of(labelled, f"big-rover-{name}")["spec"].get("nodeSelector")
        for name in ("static", "drive")
    }
    assert hosts == {"static": {"computer": "big"}, "drive": {on: "rear.local"}}
    unseen = {
        tuple(name for name in ("late", "drive") if name in line)
        for line in gaps
        if "wait for spawner" in line
    }
    assert unseen == {
        ("late",),
        ("drive",),
    }, "a pod cannot see that another was started, or is done"


def test_a_pod_waits_for_an_edge_or_a_delay_and_probes_an_edge_of_its_own() -> None:
    made, _ = manifests(DRIVEN)
    (wait,) = pod_of(made, "rover-slam")["spec"]["initContainers"]
    words = wait["command"]
    assert words[words.index("echo") + 1 :] == [
        "map",
        "dock",
        "--once",
        "--timeout",
        "5",
    ], "no namespace: /tf is shared"
    plan = compiled_plan(DRIVEN)
    for process in plan.started:
        (container,) = pod_of(made, f"rover-{process.name}")["spec"]["containers"]
        owned = [[edge.parent, edge.child] for edge in plan.edges_of(process.name)]
        for probe in ("startupProbe", "livenessProbe"):
            assert (probe in container) == bool(owned)
            if owned:
                words = container[probe]["exec"]["command"]
                assert words[words.index("echo") + 1 :][:2] == owned[0]
    late, _ = manifests(HOSTED)
    (wait,) = pod_of(late, "big-rover-late")["spec"]["initContainers"]
    assert wait["command"] == ["sleep", "3"]


def test_a_wait_goes_on_until_its_command_succeeds(tmp_path: Path) -> None:
    """With a program that fails twice in the place of ``python3``."""
    made, _ = manifests(DRIVEN)
    words = pod_of(made, "rover-slam")["spec"]["initContainers"][0]["command"]
    program = tmp_path / "python3"
    program.write_text(
        f'#!/bin/sh\necho "$4 $5" >> {tmp_path}/tries\n[ $(wc -l < {tmp_path}/tries) -gt 2 ]\n'
    )
    program.chmod(0o755)
    env = {"PATH": f"{tmp_path}:{os.environ['PATH']}", "ROS_DISTRO": "none"}
    assert processes.run(words, env=env).returncode == 0
    assert (tmp_path / "tries").read_text("utf-8").splitlines() == ["map dock"] * 3


def test_a_process_is_ended_as_the_plan_says() -> None:
    made, _ = manifests(DRIVEN)
    drive, slam = (pod_of(made, f"rover-{name}")["spec"] for name in ("drive", "slam"))
    assert (drive["terminationGracePeriodSeconds"], slam["terminationGracePeriodSeconds"]) == (
        2,
        10,
    )
    assert "lifecycle" not in drive["containers"][0], "SIGTERM is what the kubelet sends"
    assert "kill -s INT 1" in slam["containers"][0]["lifecycle"]["preStop"]["exec"]["command"][2]


def test_the_config_map_gives_each_pod_its_files_at_their_paths() -> None:
    made, _ = manifests(DRIVEN)
    data = made["plan.yaml"]["data"]
    files = built(DRIVEN)
    for name, paths in {
        "drive": ["plan.json", "params/drive.yaml"],
        "slam": ["plan.json"],
    }.items():
        (volume,) = pod_of(made, f"rover-{name}")["spec"]["volumes"]
        items = volume["configMap"]["items"]
        assert [item["path"] for item in items] == paths
        for item in items:
            assert data[item["key"]] == files[item["path"]]
            assert re.fullmatch(r"[A-Za-z0-9_.-]+", item["key"])
    on_nodes, _ = manifests(DRIVEN, Cluster("robot:1", "/opt/robot"))
    assert "plan.yaml" not in on_nodes
    assert (
        pod_of(on_nodes, "rover-drive")["spec"]["volumes"][0]["hostPath"]["path"] == "/opt/robot"
    )


def test_files_whose_paths_make_one_key_keep_their_texts() -> None:
    """``arm/drive`` is a process of a part, ``arm_drive`` one beside it."""
    plan = compiled_plan(DRIVEN)
    files = {"drive": "params/arm/drive.yaml", "slam": "params/arm_drive.yaml"}
    changed = [replace(process, params_file=files.get(process.name)) for process in plan.processes]
    texts = {path: path for process in changed for path in files_of(plan, process)}
    made = {
        file.path: yaml.safe_load(file.text)
        for file in kubernetes(replace(plan, processes=tuple(changed)), Cluster("i"), texts)[0]
    }
    for name, file in files.items():
        items = pod_of(made, f"rover-{name}")["spec"]["volumes"][0]["configMap"]["items"]
        (key,) = [item["key"] for item in items if item["path"] == file]
        assert made["plan.yaml"]["data"][key] == file


def test_a_new_plan_restarts_what_it_changes() -> None:
    def digests(text: str) -> dict[str, str]:
        made, _ = manifests(text)
        return {
            name: workload["spec"]["template"]["metadata"]["annotations"]["tfcompose/content"]
            for name, workload in workloads(made).items()
        }

    before, after = digests(DRIVEN), digests(DRIVEN.replace("wheel: 0.1", "wheel: 0.2"))
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"rover-drive"}
    moved = digests(DRIVEN.replace("xyz: [1, -2, 0.5]", "xyz: [1, -2, 0.6]"))
    assert {name for name in before if before[name] != moved[name]} == {"rover-static"}


def test_a_word_that_kubernetes_would_fill_in_stays_as_it_is() -> None:
    """The arguments name the process alone; the plan has its words.

    Names of processes are the user's.
    """
    plan = compiled_plan(HOSTED)
    named = replace(
        plan,
        processes=tuple(
            replace(process, name="a$(b)") if process.name == "late" else process
            for process in plan.processes
        ),
    )
    texts = {path: "" for process in named.started for path in files_of(named, process)}
    made = {
        file.path: yaml.safe_load(file.text) for file in kubernetes(named, Cluster("i"), texts)[0]
    }
    assert pod_of(made, "big-rover-a")["spec"]["containers"][0]["args"][-1] == "a$$(b)"


@pytest.mark.parametrize(
    ("name", "label"),
    [("Big Rover", "big-rover"), ("__", "robot"), ("r/2.x", "r-2-x"), ("a" * 90, "a" * 48)],
)
def test_names_are_labels(name: str, label: str) -> None:
    assert cluster_name(name) == label


def test_names_that_make_one_label_get_different_ones() -> None:
    text = HOSTED.replace("  late:", "  Late: {run: [x], host: brain}\n  late:")
    names = list(workloads(manifests(text)[0]))
    assert len({name for name in names if "late" in name}) == 2
    assert len(set(names)) == len(names)


def test_a_plan_that_a_config_map_cannot_hold_is_refused_with_a_way_out(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(DRIVEN)
    done = tfcompose_in(tmp_path, "build", "robot.yaml", "-o", "built")
    assert done.returncode == 0, done.stderr
    plan = tmp_path / "built" / "plan.json"
    params = tmp_path / "built" / "params" / "drive.yaml"
    params.write_text(params.read_text("utf-8") + f"# {'x' * 1_000_001}\n")
    words = ["export", "k8s", str(plan), "--image", "robot:1"]
    done = tfcompose_in(tmp_path, *words)
    assert (done.returncode, "--at" in done.stderr) == (2, True)
    assert not (tmp_path / "built" / "k8s").exists()
    assert tfcompose_in(tmp_path, *words, "--at", "/opt/robot").returncode == 0
    assert json.loads(plan.read_text("utf-8"))["robot"] == "rover"


def test_without_an_image_nothing_is_built(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(DRIVEN)
    done = tfcompose_in(tmp_path, "export", "k8s", "robot.yaml")
    assert (done.returncode, "--image" in done.stderr) == (2, True)
    assert not (tmp_path / "build").exists()
