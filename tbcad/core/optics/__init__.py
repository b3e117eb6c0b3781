"""The optics of the turtleback reflector, numbers only (numpy, scipy)."""
