"""Looks at the live tree, or at a recording: the commands monitor, verify, doctor, echo and tree."""
