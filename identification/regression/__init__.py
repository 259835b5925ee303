"""From recorded trials to regressions: samples, forces, preprocessing."""
