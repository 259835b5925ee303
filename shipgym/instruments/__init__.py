"""Sensor sets: what instruments show, as files of plain functions on named records."""
