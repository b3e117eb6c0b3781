"""The folder of a run: photographs of all stops and what is known of each, real or simulated."""
