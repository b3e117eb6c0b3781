"""A machine as it is: camera, axis, spheres and LEDs, designed, simulated or calibrated."""
