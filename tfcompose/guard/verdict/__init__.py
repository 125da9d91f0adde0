"""Comparison of observations with the plan, for the guard, doctor, verify and monitor.

Pure functions over observations; ages and gaps are seconds, rates hertz. The guard judges message
by message, verify edge by edge, doctor publisher by publisher, with the same codes and in the same
words.
"""
