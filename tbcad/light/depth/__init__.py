"""Depth of what a light field shows, found without a mesh."""
