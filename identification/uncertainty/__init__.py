"""How certain coefficients are."""
