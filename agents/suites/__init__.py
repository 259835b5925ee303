"""Suites: tasks with their episodes, and the costs and settings kept with them."""
