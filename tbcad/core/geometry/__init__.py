"""Vectors, rotations, ellipsoids, round cones and primitives, numbers only (numpy, scipy)."""
