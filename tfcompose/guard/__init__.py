"""The guard, a process of the plan, reports nodes that publish another process's edges.

``judge`` decides over messages and publishers, and ``liveness`` over rates. ``relay`` forwards
messages in strict mode, and ``channel`` talks to the launcher. Must not import ``spec``,
``compiler``, ``launcher``, ``cli``, ``tools``, ``pydantic``, ``yaml``: it runs on the robot, from
the plan alone.
"""
