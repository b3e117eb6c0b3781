"""Reflectance fields: how an object looks in the light of each lamp, and so in any light."""
