"""The guard, a process of the plan: reports nodes that publish an edge of another process.

``judge`` decides over messages and publishers, ``liveness`` over rates; ``relay`` forwards
messages in strict mode, ``channel`` talks to the launcher. Must not import ``spec``, ``compiler``,
``launcher``, ``cli``, ``tools``, ``pydantic``, ``yaml``: it runs on the robot, from the plan
alone.
"""
