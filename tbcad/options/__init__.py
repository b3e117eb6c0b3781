"""The declaration of each command: its fields are options, keywords of Python, and JSON."""
