"""Solids: the only package that uses the CAD kernel to build shapes."""
