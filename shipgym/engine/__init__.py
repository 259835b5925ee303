"""The engine: compiling ships and tasks, and sailing many of them at once."""
