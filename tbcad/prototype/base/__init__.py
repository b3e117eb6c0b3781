"""The base: the printed carrier of the balls, its seats, its hub and its joints."""
