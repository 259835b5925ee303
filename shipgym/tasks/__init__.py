"""Tasks: what is asked of an autopilot."""
