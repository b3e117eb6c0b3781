"""Drawings of an export: a sheet for each made part, the optical layout, the assembly."""
