"""Comparison of observations with the plan, for the guard, doctor, verify and monitor.

All functions are pure functions of observations. Ages and gaps are in seconds, rates in Hz. The
guard judges each message, verify judges each edge, and doctor judges each publisher. They use the
same codes and the same texts.
"""
