"""Stage ``load``: YAML text becomes a Source that knows where everything stands."""
