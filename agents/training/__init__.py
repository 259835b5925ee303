"""Learned autopilots: settings, training, tuning, and their policies as files."""
