"""Cameras that a run photographs with, one module for each kind."""
