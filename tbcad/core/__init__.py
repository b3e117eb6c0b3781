"""Geometry, optics, the keys of a design, its mirrors, and the camera that sees them."""
