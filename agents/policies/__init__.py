"""Learned policies and the shield around them, without torch."""
