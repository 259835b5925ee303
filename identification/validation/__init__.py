"""Quality of a model's predictions, and what speaks against it."""
