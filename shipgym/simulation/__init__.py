"""Compiling ships and simulating them."""

from shipgym.simulation.simulate import open_loop, simulate

__all__ = ["open_loop", "simulate"]
