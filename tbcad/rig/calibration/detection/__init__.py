"""Where a run's photographs show the LEDs: found, measured and matched, or rejected by name."""
