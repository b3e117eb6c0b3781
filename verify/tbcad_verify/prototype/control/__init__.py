"""Programs and settings of the controllers, run and read."""
