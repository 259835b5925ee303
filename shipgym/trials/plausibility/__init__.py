"""Checks of a log: values that no ship can have, and channels that contradict each other.

Most often a unit, a sign, a frame or a clock is wrong. A check yields a `LogFinding` for
each thing that cannot be right, or may be wrong: what was expected and found, what to
do, and the settings with which the log may be read instead.
"""
