"""Pictures of a build, drawn from its files alone."""
