"""Views and refocused pictures, synthesised from a light field."""
