"""Stage ``check``: a Robot becomes findings, one rule a file."""
