"""Vectors, ellipsoids, cones and simple bodies: numbers only (numpy, scipy)."""
