"""What the simulated light meets: object, mirrors and cameras."""
