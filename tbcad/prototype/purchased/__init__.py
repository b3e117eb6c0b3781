"""Purchased parts, from CSV files."""
