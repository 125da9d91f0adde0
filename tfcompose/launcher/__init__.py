"""Starts a plan, restarts processes that fail, and stops all processes in order.

``machine`` decides: it is a pure function over the values of ``state`` and ``events``.
``supervisor`` acts: it turns pipes, signals and time into events, and starts, signals and reads
processes. Must not import ``spec``, ``compiler``, ``guard``, ``cli``, ``tools``, ``pydantic``,
``yaml``: it knows the plan, and talks to other processes through messages.
"""
