"""How well a model predicts, and what speaks against it."""
