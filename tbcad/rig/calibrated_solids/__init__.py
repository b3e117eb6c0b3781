"""A machine as it was built: what its calibration changes in coverage, models and tolerances."""
