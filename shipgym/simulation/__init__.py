"""Compiling ships, simulating them, and measuring what was simulated."""

from shipgym.simulation.sensors import SEA_TRIAL, Sensor, Sensors, gauss_markov
from shipgym.simulation.simulate import open_loop, simulate

__all__ = ["SEA_TRIAL", "Sensor", "Sensors", "gauss_markov", "open_loop", "simulate"]
