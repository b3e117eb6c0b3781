"""What a calibration found: the verdict in words, its record, tables and plots."""
