"""Tolerances: simulated builds with random errors, and the coverage of each."""
