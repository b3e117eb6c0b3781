"""Simulated photographs, their light field, views, refocusing, and studies of the paper."""
