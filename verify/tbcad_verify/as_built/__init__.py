"""The prototype as a calibration found it: what it covers, and what to shim."""
