"""Stage ``language``: sources, merged over each other, become a typed spec.

pydantic models are the one description of the language: of its validation, its JSON Schema and its reference.
"""

from tfcompose.language.include import set_value, with_includes
from tfcompose.language.overlay import as_part, composed, lay_over, profiles_in
from tfcompose.language.validate import Validated, validate, validate_node_preset, validate_preset

__all__ = [
    "Validated",
    "as_part",
    "composed",
    "lay_over",
    "profiles_in",
    "set_value",
    "validate",
    "validate_node_preset",
    "validate_preset",
    "with_includes",
]
