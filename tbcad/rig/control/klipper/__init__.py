"""Klipper behind Moonraker, as the controller of a run."""
