"""A plan for Kubernetes: a ConfigMap, a workload per process, and a kustomization.

A process that keeps running is a StatefulSet of one pod, because only a StatefulSet promises at
most one: it starts no second pod before the first has ended, in an update, after a deletion or
when a node is lost, so that no edge has two publishers
(https://kubernetes.io/docs/concepts/workloads/controllers/statefulset/). A Deployment does not,
even with ``Recreate``.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import msgspec

from tfcompose.model.files import File
from tfcompose.model.plan.middleware import middleware_variables
from tfcompose.model.process_keys import PROCESS_KEYS
from tfcompose.tools.exporters.supervisors import (
    INSIDE,
    after,
    command_of,
    distinct,
    exported_processes,
    gaps_of,
    outside_of,
    plain_name,
    plain_names,
    probe_of,
    settings_of,
    waiting_s,
    yaml_text,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan, PlanProcess
    from tfcompose.model.process_keys import Exported

_KUBERNETES = tuple(key.kubernetes for key in PROCESS_KEYS)
#: How much a ConfigMap takes, in bytes
#: (https://kubernetes.io/docs/concepts/configuration/configmap/).
MOST_BYTES = 1_000_000
#: The longest name of a workload, so that names and labels of its pods have at most 63 characters.
_LONGEST = 48
_PLAN = "plan.json"
#: A file that a process names by its place in the plan's folder.
_IN_FOLDER = re.compile(r"\$\{build_dir\}/(?!\.\.)([^\s\"',:;]+)")
_NO_KEY = re.compile(r"[^A-Za-z0-9_.-]")
_ROBOT, _PROCESS = "app.kubernetes.io/part-of", "app.kubernetes.io/name"
#: Of a pod: a digest of what the process is started with, so that a new plan restarts what it
#: changes, and no other.
_CONTENT = "tfcompose/content"


@dataclass(frozen=True, slots=True)
class Cluster:
    """The environment of the pods."""

    image: str
    #: The plan's folder on each node; empty: a ConfigMap holds the plan.
    folder: str = ""


def cluster_name(name: str) -> str:
    """Return the name as an RFC 1123 label, which Kubernetes requires."""
    return re.sub(r"[^a-z0-9]+", "-", plain_name(name).lower())[:_LONGEST].strip("-") or "robot"


def files_of(plan: Plan, process: PlanProcess) -> tuple[str, ...]:
    """Return the files in the plan's folder that the process reads, by relative path.

    The plan is first.
    """
    files = {found for argument in process.texts for found in _IN_FOLDER.findall(argument)}
    if process.params_file:
        files.add(process.params_file)
    if plan.describes(process):
        files.add(process.description or plan.description)
    return (_PLAN, *sorted(files))


def kubernetes(
    plan: Plan, cluster: Cluster, texts: Mapping[str, str]
) -> tuple[tuple[File, ...], list[str]]:
    """Return the manifests, and the properties of the plan that they lose.

    ``texts`` are the files of all processes, ``files_of``, by their paths in the plan's folder.
    """
    robot = cluster_name(plan.robot)
    names = plain_names(plan, lambda name: cluster_name(f"{robot}-{name}"))
    exported = exported_processes(plan)
    manifests = {"service": _service(robot)}
    if not cluster.folder:
        manifests["plan"] = _config_map(robot, texts)
    for process in plan.started:
        name = names[process.name]
        pod = _pod(plan, exported[process.name], _labels(robot, name), cluster, texts)
        manifests[name] = (
            _job(name, robot, pod, _settings(exported[process.name], "job"))
            if exported[process.name].awaited
            else _stateful_set(name, robot, pod)
        )
    files = [File(f"{name}.yaml", yaml_text(manifest)) for name, manifest in manifests.items()]
    kustomization = {
        "apiVersion": "kustomize.config.k8s.io/v1beta1",
        "kind": "Kustomization",
        "resources": [file.path for file in files],
    }
    return (File("kustomization.yaml", yaml_text(kustomization)), *files), _gaps(plan)


def _settings(exported: Exported, section: str) -> dict[str, Any]:
    settings = settings_of(_KUBERNETES, exported)
    return {setting.name: setting.value for setting in settings if setting.section == section}


def _gaps(plan: Plan) -> list[str]:
    """Return what Kubernetes does otherwise, one sentence each."""
    gaps = gaps_of(plan, _KUBERNETES) + outside_of(plan, INSIDE)
    for process in plan.started:
        for name, what in after(plan, process).items():
            if not _waiting_for(plan, name, what):
                gaps.append(
                    f"{process.name} does not wait for {name}: a pod cannot see when it is {what}"
                )
    return gaps


def _waiting_for(plan: Plan, name: str, what: str) -> list[str]:
    """Return the command that succeeds when the process is as it is waited for.

    Empty where a pod cannot see that.
    """
    process = plan.process(name)
    if seconds := waiting_s(process, what):
        return ["sleep", f"{seconds:g}"]
    if what != "ready" or not plan.edges_of(name):
        return []
    return ["sh", "-c", 'until "$@"; do sleep 1; done', "sh", *probe_of(plan, process)]


def _labels(robot: str, name: str) -> dict[str, str]:
    return {_ROBOT: robot, _PROCESS: name}


def _manifest(
    kind: str, version: str, name: str, robot: str, content: dict[str, Any]
) -> dict[str, Any]:
    """Return an object of the robot with the labels that Kubernetes recommends."""
    labels = {**_labels(robot, name), "app.kubernetes.io/managed-by": "tfcompose"}
    return {
        "apiVersion": version,
        "kind": kind,
        "metadata": {"name": name, "labels": labels},
        **content,
    }


def _service(robot: str) -> dict[str, Any]:
    """Return the headless service that a StatefulSet has to name; DDS does not use it."""
    spec = {"clusterIP": "None", "selector": {_ROBOT: robot}}
    return _manifest("Service", "v1", robot, robot, {"spec": spec})


def _config_map(robot: str, texts: Mapping[str, str]) -> dict[str, Any]:
    keys = _keys(texts)
    data = {keys[path]: text for path, text in texts.items()}
    return _manifest("ConfigMap", "v1", f"{robot}-plan", robot, {"data": data})


def _keys(texts: Mapping[str, str]) -> dict[str, str]:
    """Return the key of each file, by its path; a ConfigMap has no folders."""
    return distinct(texts.keys(), lambda path: _NO_KEY.sub("_", path))


def _stateful_set(name: str, robot: str, pod: dict[str, Any]) -> dict[str, Any]:
    """Return a workload that runs on.

    With ``Parallel`` an update replaces a pod that never became ready, too.
    """
    spec = {
        "serviceName": robot,
        "replicas": 1,
        "podManagementPolicy": "Parallel",
        "selector": {"matchLabels": _labels(robot, name)},
        "template": pod,
    }
    return _manifest("StatefulSet", "apps/v1", name, robot, {"spec": spec})


def _job(name: str, robot: str, pod: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Return a workload that ends.

    Its name changes with its content, because a job cannot be changed.
    """
    content = pod["metadata"]["annotations"][_CONTENT]
    template = {**pod, "spec": {**pod["spec"], "restartPolicy": "OnFailure"}}
    spec = {**settings, "template": template}
    return _manifest("Job", "batch/v1", f"{name}-{content[:8]}", robot, {"spec": spec})


def _pod(
    plan: Plan,
    exported: Exported,
    labels: dict[str, str],
    cluster: Cluster,
    texts: Mapping[str, str],
) -> dict[str, Any]:
    """Return the process's pod template, on its node's network and shared memory for DDS."""
    process = exported.process
    common = {
        "image": cluster.image,
        "env": [
            {"name": name, "value": _escape(value)} for name, value in _environment(plan).items()
        ],
        "workingDir": INSIDE,
        "volumeMounts": [{"name": "plan", "mountPath": INSIDE, "readOnly": True}],
    }
    waits = [
        {"name": f"wait-{number}", **common, "command": command_words}
        for number, command_words in enumerate(
            _waiting_for(plan, *waited) for waited in after(plan, process).items()
        )
        if command_words
    ]
    command = command_of(process, "python3", f"{INSIDE}/{_PLAN}")
    container = {
        "name": "process",
        **common,
        "args": [_escape(argument) for argument in command],
        **_probes(plan, process),
        **_settings(exported, "container"),
    }
    spec = {
        "hostNetwork": True,
        "hostIPC": True,
        "dnsPolicy": "ClusterFirstWithHostNet",
        **({"nodeSelector": _node_selector(plan, process.host)} if process.host else {}),
        **_settings(exported, "pod"),
        **({"initContainers": waits} if waits else {}),
        "containers": [container],
        "volumes": [{"name": "plan", **_volume(plan, process, labels[_ROBOT], cluster, texts)}],
    }
    return {
        "metadata": {"labels": labels, "annotations": {_CONTENT: _digest(plan, process, texts)}},
        "spec": spec,
    }


def _node_selector(plan: Plan, host: str) -> dict[str, str]:
    """Return the labels of the node that is the host.

    Those that the robot file gives it, else its host name.
    """
    declared = plan.hosts.get(host)
    return (
        declared.node_selector
        if declared and declared.node_selector
        else {"kubernetes.io/hostname": host}
    )


def _digest(plan: Plan, process: PlanProcess, texts: Mapping[str, str]) -> str:
    """Return the digest of what the process is started with.

    Its part of the plan, and the files that it reads.
    """
    files = [texts[path] for path in files_of(plan, process) if path != _PLAN]
    data = msgspec.json.encode([plan.start_settings(process), files])
    return hashlib.sha256(data).hexdigest()[:16]


def _environment(plan: Plan) -> dict[str, str]:
    """Return what the probes need as well as the process, which has more from the plan."""
    discovery = (
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": plan.ros.discovery.upper()} if plan.ros.discovery else {}
    )
    return {
        "ROS_DOMAIN_ID": str(plan.ros.domain_id or 0),
        **discovery,
        **middleware_variables(plan.ros, {}),
    }


def _probes(plan: Plan, process: PlanProcess) -> dict[str, Any]:
    """Return what tells the kubelet that the process has come up, and that it still lives.

    An edge of its own.
    """
    if not plan.edges_of(process.name):
        return {}
    probe = {"exec": {"command": probe_of(plan, process)}, "timeoutSeconds": 10}
    return {
        "startupProbe": {**probe, "periodSeconds": 5, "failureThreshold": 24},
        "livenessProbe": {**probe, "periodSeconds": 20, "failureThreshold": 3},
    }


def _volume(
    plan: Plan, process: PlanProcess, robot: str, cluster: Cluster, texts: Mapping[str, str]
) -> dict[str, Any]:
    if cluster.folder:
        return {"hostPath": {"path": cluster.folder, "type": "Directory"}}
    keys = _keys(texts)
    items = [{"key": keys[path], "path": path} for path in files_of(plan, process)]
    return {"configMap": {"name": f"{robot}-plan", "items": items}}


def _escape(text: str) -> str:
    """Return the text as Kubernetes reads it back: it fills in ``$(NAME)`` itself."""
    return text.replace("$(", "$$(")
