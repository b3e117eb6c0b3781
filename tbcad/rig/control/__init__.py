"""The machine driven through a run: its controller, its camera, and the order of exposures."""
