"""Stage ``validate``: a Source becomes a typed RobotSpec."""

from tfcompose.validate.validate import Validated, validate, validate_preset

__all__ = ["Validated", "validate", "validate_preset"]
