"""All photographs of a run, simulated for a machine with random errors."""
