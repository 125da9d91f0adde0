"""Tools around the product: importers, exporters, the browser view, deployment and fleets.

A tool may use every wing; no wing uses a tool, and no tool another.
"""
