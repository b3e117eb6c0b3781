"""Angle zero of the base: the disc with mark and tab, the pin, the switch, homing."""
