"""Autopilots and ships outside Python: C99 and FMUs."""
