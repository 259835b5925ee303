"""What a model is worth: predictions, choice of structure and method, certainty."""
