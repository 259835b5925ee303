"""Sensor sets: what a ship's instruments show, as files of plain functions on named records."""
