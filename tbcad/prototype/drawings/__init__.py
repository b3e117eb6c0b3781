"""Drawings of what is cut, drilled or tapped by hand: a sheet each, as PDF and DXF."""
