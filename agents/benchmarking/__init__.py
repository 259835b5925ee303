"""Benchmark: run controllers in the tasks of a suite, rank them, report."""
