"""What turns the base, and the load that it bears."""
