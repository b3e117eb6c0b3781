"""A camera's lens, from files of other programs or from photographs of a checkerboard."""
