"""Numbers only: the geometry and optics of the turtleback reflector (numpy, scipy)."""
