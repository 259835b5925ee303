"""Gymnasium environments, registered on `import shipgym`."""
