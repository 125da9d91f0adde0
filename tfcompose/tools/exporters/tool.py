"""The tool ``export``: it writes a plan for systemd, Docker Compose, Kubernetes or ros2 launch."""

from tfcompose.foundation.tool import Command, Tool, Topic

TOOL = Tool(
    name="export",
    package=__package__,
    codes=__package__,
    commands=(
        Command(
            "export",
            "Export the plan for systemd, docker compose, Kubernetes or ros2 launch",
            "tfcompose.tools.exporters.command",
            group="Ship",
            topic="exports",
            completes=(("host", "hosts"),),
            synonyms=(
                ("kubernetes", "export k8s"),
                *((kind, f"export {kind}") for kind in ("k8s", "compose", "systemd")),
            ),
        ),
    ),
    topics=(
        Topic(
            "exports",
            "systemd, docker compose, Kubernetes and launch files",
            group="Integration",
        ),
    ),
)
