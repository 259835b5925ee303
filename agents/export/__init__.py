"""Autopilots and ships outside Python: C99, FMUs, and a live link over NMEA 0183."""
