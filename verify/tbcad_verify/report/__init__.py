"""Checks, the report of a verification, and its tables."""
