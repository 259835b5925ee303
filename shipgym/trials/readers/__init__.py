"""Readers of logs: a file for each kind, with a function that makes a table of it."""
