"""Values that wings hand to each other.

The robot, the plan, files to be written, and messages between processes.

The plan is the border: what runs on a robot knows it, and neither the compiler nor pydantic nor
YAML. Must not import ``spec``, ``compiler``, ``tf``, ``guard``, ``launcher``, ``cli``, ``tools``,
``pydantic``, ``yaml``.
"""
