"""Refinement of a model by what it simulates, and priors."""
