"""What to build: the spec, and the mirrors that follow from it."""
