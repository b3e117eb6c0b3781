"""The real camera and lens that a design needs."""
