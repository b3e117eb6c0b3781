"""A part printed first, to try seats and fits."""
