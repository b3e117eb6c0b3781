"""Simulated builds of the prototype: what each one's balls show."""
