"""Sensor sets: models of instruments, as files of plain functions on named records."""
