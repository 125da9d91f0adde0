"""Values that wings exchange: the robot, the plan, files to write, and messages between processes.

The plan is the border: programs that run on a robot know the plan, but not the compiler, pydantic
or YAML. Must not import ``spec``, ``compiler``, ``tf``, ``guard``, ``launcher``, ``cli``,
``tools``, ``pydantic``, ``yaml``.
"""
