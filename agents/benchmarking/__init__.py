"""The benchmark: suites of tasks, flights of all contestants, their metrics, statistics and result files."""
