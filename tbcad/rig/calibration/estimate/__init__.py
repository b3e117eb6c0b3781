"""The machine that explains measured highlights best: maximum a posteriori."""
