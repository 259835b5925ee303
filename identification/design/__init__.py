"""Which terms a model needs, and which trial to run next."""
