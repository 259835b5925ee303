"""Regressions of recorded trials: samples, forces, preprocessing."""
