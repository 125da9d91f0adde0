"""Shows a robot in the browser, and moves what is mounted.

A new pose becomes edits of the robot file.

``edit`` is pure functions over the file's text; ``scene`` and ``panel`` stand on viser. Files are
read, compiled and written by whoever starts the view.
"""
