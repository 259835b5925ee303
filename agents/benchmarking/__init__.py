"""The benchmark: contestants in the tasks of a suite, statistics, result files and their page."""
