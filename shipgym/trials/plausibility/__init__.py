"""Checks of a log: impossible values, and channels that contradict each other.

Most often a unit, a sign, a frame or a clock is wrong. A check refuses what cannot be
right with an InputError, which also holds the settings with which the log may be read
instead; what may be wrong it returns as remarks.
"""
