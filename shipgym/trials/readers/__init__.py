"""Logs of every kind as one table of columns: a file for each kind, with a function that reads it."""
