"""Releases of a robot on its computers: copied over ssh, started and restarted by systemd.

Each host runs one unit per robot, ``tfcompose up plan.json --host NAME``, not one per process, as
``export systemd`` writes them. Only then is there a launcher on the host: it starts in order and
by readiness, restarts with a backoff, has one guard that sees every edge of every host, and
answers ``ps``, ``logs``, ``events`` and ``wait``. A deployment reads from it which edges are live
and needs no observer; units of single processes would leave it to guess. systemd starts the
launcher at boot and after a failure, and ends everything in its control group.

A release is a folder named by its content: files that a host already has are not sent again, and a
second deployment changes nothing. It takes effect in two phases. On trial it is started from the
runtime directory, which is empty after a reboot; only once every edge of every host is live does
``current`` point to it. A host that loses power meanwhile, or its connection to the deploying
computer, returns to the previous release without help. All hosts stop before any starts, because
an edge may have moved from one host to another and must not have two publishers. If nothing of
that kind changes, launchers keep running, follow the release, and restart only the processes that
differ.

``release`` makes the folder, ``unit`` the systemd unit, ``connection`` reaches the hosts,
``agent`` acts there, ``following`` decides whether the robot can keep running, ``rollout`` runs
the deployment.
"""
