"""The chain of `shipgym autopilot`: design, episodes over the uncertainty, report."""
