"""Releases of a robot on its computers.

Carried there by ssh, started and kept by systemd, judged by tfcompose there.

Each host runs one unit for each robot, ``tfcompose up plan.json --host NAME``, and not one for
each process, as ``export systemd`` writes them. Only then is there a launcher on the host: it
starts in order and by readiness, restarts with a backoff, has one guard that sees every edge of
every host, and answers ``ps``, ``logs``, ``events`` and ``wait``. So what is live is said by who
watches it, and a deployment needs no observer of its own; units of single processes would leave it
to guess. systemd does what it is good at: it starts the launcher at boot and when it fails, and
ends everything in its control group.

A release is a folder named by its content: what is there already is not sent again, and a second
deployment changes nothing. It comes into effect in two phases. On trial it is started from the
runtime directory, which no boot survives; only once every edge of every host is live does
``current`` lead to it. A host that loses its power meanwhile, or whose connection to whoever
deploys is cut, is back on the release before without anybody's help. All hosts end what runs
before any starts, because an edge may have moved from one host to another, and has no two
publishers meanwhile; where nothing of that kind changes, launchers go on, follow the release, and
start only what is different again.

``release`` makes the folder, ``unit`` what systemd starts, ``connection`` reaches the hosts,
``agent`` is what acts there, ``following``
whether the robot can go on meanwhile, ``rollout`` decides.
"""
