"""Deployment of a robot to its computers over ssh, as systemd units.

Each host runs a single unit for a robot, ``tfcompose up plan.json --host NAME``. ``export
systemd`` writes a unit for each process instead. With a single unit, the host has a launcher. The
launcher starts processes in order and by readiness, restarts them with a backoff, runs the guard,
and answers ``ps``, ``logs``, ``events`` and ``wait``. A deployment asks the launcher for the live
edges. With a unit for each process, it could not know them. systemd starts the launcher at boot
and after a failure, and ends all processes in its control group.

A release is a folder whose name is a digest of its content. Therefore a deployment does not send a
release that a host already has, and a second deployment changes nothing. A release starts on
trial: a unit in the runtime directory, which is empty after a reboot, starts it. After every edge
of every host is live, the link ``current`` points to the release. If a host loses power or its
connection during the trial, it returns to the previous release by itself.

Normally all hosts stop before a host starts the new release. An edge may have moved from a host to
another, and must not have two publishers. If no edge moves, the launchers keep running and restart
only the processes that differ.

``release`` makes the folder, and ``unit`` makes the systemd unit. ``connection`` connects to the
hosts. ``agent`` runs on a host. ``following`` decides if the robot can keep running. ``rollout``
runs the deployment.
"""
