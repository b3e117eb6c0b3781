"""Balls, caps, magnets and fasteners in their seats and holes."""
