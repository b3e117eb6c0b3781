"""Report of a calibration: the verdict in words, its record, tables and plots."""
