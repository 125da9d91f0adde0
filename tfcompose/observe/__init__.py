"""The live tree: buffer and echo."""
