"""What starts a plan, keeps it going and ends it.

``machine`` decides, as a pure function over the values in ``state`` and ``events``; ``supervisor`` acts: it turns
pipes, signals and time into events, and starts, signals and reads the processes. It knows the plan, not the compiler,
and loads neither pydantic nor YAML.
"""
