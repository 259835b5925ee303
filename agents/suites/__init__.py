"""Suites: tasks with the seeds of their episodes, and the costs and settings that are kept with them."""
