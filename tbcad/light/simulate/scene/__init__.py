"""Scene of the simulated light: object, mirrors and cameras."""
