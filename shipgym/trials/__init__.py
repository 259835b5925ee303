"""Recorded manoeuvres: trials, their files, units and plausibility."""
