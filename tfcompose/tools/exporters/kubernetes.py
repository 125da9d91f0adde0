"""Export for Kubernetes: a ConfigMap, a workload for each process, and a kustomization.

A process that keeps running becomes a StatefulSet with a single pod. A StatefulSet starts a new
pod only after the old pod has ended, even in an update, after a deletion or after the loss of a
node. Therefore no edge ever has two publishers
(https://kubernetes.io/docs/concepts/workloads/controllers/statefulset/). A Deployment can run two
pods at the same time, even with the strategy ``Recreate``.
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
#: The maximum size of a ConfigMap, in bytes
#: (https://kubernetes.io/docs/concepts/configuration/configmap/).
MOST_BYTES = 1_000_000
#: The maximum length of a workload's name. The names and labels of its pods then have at most 63
#: characters, which is Kubernetes's limit.
_LONGEST = 48
_PLAN = "plan.json"
#: A path in the plan's folder, as a process's command or environment contains it.
_IN_FOLDER = re.compile(r"\$\{build_dir\}/(?!\.\.)([^\s\"',:;]+)")
_NO_KEY = re.compile(r"[^A-Za-z0-9_.-]")
_ROBOT, _PROCESS = "app.kubernetes.io/part-of", "app.kubernetes.io/name"
#: An annotation of a pod: the digest of everything that the process starts with. If a new plan
#: changes the digest, Kubernetes restarts the pod; it keeps all other pods running.
_CONTENT = "tfcompose/content"


@dataclass(frozen=True, slots=True)
class Cluster:
    """Properties of the cluster in which the pods run."""

    image: str
    #: The plan's folder on each node. If empty, a ConfigMap holds the plan.
    folder: str = ""


def cluster_name(name: str) -> str:
    """Return the name as an RFC 1123 label, because Kubernetes accepts no other names."""
    return re.sub(r"[^a-z0-9]+", "-", plain_name(name).lower())[:_LONGEST].strip("-") or "robot"


def files_of(plan: Plan, process: PlanProcess) -> tuple[str, ...]:
    """Return the relative paths of the files in the plan's folder that the process reads.

    The plan is the first file.
    """
    files = {path for argument in process.texts for path in _IN_FOLDER.findall(argument)}
    if process.params_file:
        files.add(process.params_file)
    if plan.describes(process):
        files.add(process.description or plan.description)
    return (_PLAN, *sorted(files))


def kubernetes(
    plan: Plan, cluster: Cluster, texts: Mapping[str, str]
) -> tuple[tuple[File, ...], list[str]]:
    """Return the manifests, and a sentence for each property of the plan that they do not keep.

    ``texts`` maps the paths that ``files_of`` returns for all processes to the texts of these
    files.
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
    """Return a sentence for each difference between Kubernetes and ``up``."""
    gaps = gaps_of(plan, _KUBERNETES) + outside_of(plan, INSIDE)
    for process in plan.started:
        for name, what in after(plan, process).items():
            if not _waiting_for(plan, name, what):
                gaps.append(
                    f"{process.name} does not wait for {name}: a pod cannot see when it is {what}"
                )
    return gaps


def _waiting_for(plan: Plan, name: str, what: str) -> list[str]:
    """Return the command that succeeds once another process may start.

    ``name`` is the process that the other waits for, and ``what`` is the condition after it, such
    as ``ready``. The command is empty if a pod cannot test the condition.
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
    """Return the headless service that a StatefulSet must name, although DDS does not use it."""
    spec = {"clusterIP": "None", "selector": {_ROBOT: robot}}
    return _manifest("Service", "v1", robot, robot, {"spec": spec})


def _config_map(robot: str, texts: Mapping[str, str]) -> dict[str, Any]:
    keys = _keys(texts)
    data = {keys[path]: text for path, text in texts.items()}
    return _manifest("ConfigMap", "v1", f"{robot}-plan", robot, {"data": data})


def _keys(texts: Mapping[str, str]) -> dict[str, str]:
    """Return the key of each file in the ConfigMap, by path; a key cannot contain a folder."""
    return distinct(texts.keys(), lambda path: _NO_KEY.sub("_", path))


def _stateful_set(name: str, robot: str, pod: dict[str, Any]) -> dict[str, Any]:
    """Return the workload of a process that keeps running.

    With ``Parallel``, an update also replaces a pod that never became ready.
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
    """Return the workload of a process that ends.

    Its name contains a digest of its content, because Kubernetes cannot change an existing Job.
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
    """Return the pod template of a process.

    The pod uses the network and the shared memory of its node, because DDS needs both.
    """
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
    """Return the labels that select the node for a host.

    These are the ``node_selector`` of the host in the robot file or, without it, the host name.
    """
    declared = plan.hosts.get(host)
    return (
        declared.node_selector
        if declared and declared.node_selector
        else {"kubernetes.io/hostname": host}
    )


def _digest(plan: Plan, process: PlanProcess, texts: Mapping[str, str]) -> str:
    """Return the digest of the process's part of the plan and of the files that it reads."""
    files = [texts[path] for path in files_of(plan, process) if path != _PLAN]
    poses = [
        edge.pose for edge in plan.edges_of(process.name)
    ]  # a pod reads its plan at the start
    data = msgspec.json.encode([plan.start_settings(process), poses, files])
    return hashlib.sha256(data).hexdigest()[:16]


def _environment(plan: Plan) -> dict[str, str]:
    """Return the environment variables that the probes need.

    The process itself gets more variables from the plan.
    """
    discovery = (
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": plan.ros.discovery.upper()} if plan.ros.discovery else {}
    )
    return {
        "ROS_DOMAIN_ID": str(plan.ros.domain_id or 0),
        **discovery,
        **middleware_variables(plan.ros, {}),
    }


def _probes(plan: Plan, process: PlanProcess) -> dict[str, Any]:
    """Return the startup and liveness probes of an owner, which test its first edge."""
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
    """Escape the text, because Kubernetes replaces ``$(NAME)`` by a variable."""
    return text.replace("$(", "$$(")
