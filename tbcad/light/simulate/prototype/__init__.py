"""Capture with the prototype: the photographs of its stops, merged into the shell's pictures."""
