"""Simulated photographs and the light field made from them."""
