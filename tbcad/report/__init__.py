"""Pictures of an export, drawn from its files alone."""
