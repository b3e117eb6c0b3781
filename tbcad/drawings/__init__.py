"""Drawings of a build: a sheet for each made part, the optical layout, the assembly."""
