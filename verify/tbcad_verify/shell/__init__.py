"""Checks of both shells, on mirrors recovered from their meshes."""
