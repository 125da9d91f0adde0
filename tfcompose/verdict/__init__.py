"""What was seen of an edge, against what the plan says of it: the verdict of the guard, of verify and of the doctor.

Pure functions over a planned edge and what was seen of it. The guard gives its verdicts message by message, verify edge
by edge, the doctor by publisher: with the same codes and in the same words.
"""
