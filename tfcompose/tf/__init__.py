"""The live tree: ROS nodes and the graph, TF messages, observing topics and bags, and the buffer that stands in for tf2.

Must not import ``spec``, ``compiler``, ``guard``, ``launcher``, ``cli``, ``tools``, ``pydantic``,
``yaml``.
"""
