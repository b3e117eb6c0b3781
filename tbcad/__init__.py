"""Light-field cameras from convex mirrors: the optics, the parts, and the proof on the files."""

__version__ = "0.1.0"
