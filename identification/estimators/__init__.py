"""Support vector machines and what they are compared with."""
