"""Learned policies, which steer without torch."""
