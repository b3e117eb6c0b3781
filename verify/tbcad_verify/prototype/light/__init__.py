"""Light of the lamps, and light that the balls reflect."""
