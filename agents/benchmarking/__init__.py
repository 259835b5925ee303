"""The benchmark: controllers in the tasks of a suite, statistics, result files and their page."""
