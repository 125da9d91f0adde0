"""Docs tool: the topics, commands, codes and keys as a site of static pages."""
