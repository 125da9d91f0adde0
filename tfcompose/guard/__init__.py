"""The guard, a process of the plan.

It observes /tf and reports who publishes an edge that another process owns.

``judge`` decides over messages and publishers, ``liveness`` over rates; ``relay`` passes messages
on in strict mode, ``channel`` talks to the launcher. Must not import ``spec``,
``compiler``, ``launcher``, ``cli``, ``tools``, ``pydantic``, ``yaml``: it runs on the robot, from
the plan alone.
"""
