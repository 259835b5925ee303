"""The chain of `shipgym autopilot`: design, flights over the uncertainty, report."""
