"""Uncertainty of the coefficients."""
