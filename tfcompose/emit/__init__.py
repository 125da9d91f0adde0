"""Stage ``emit``: a Robot becomes files, as text."""
