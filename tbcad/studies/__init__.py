"""Studies: what the paper claims, measured again, as tables and plots."""
