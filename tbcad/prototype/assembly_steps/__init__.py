"""How a prototype is assembled: steps with their parts, worked out from an export's files."""
