"""How a prototype is assembled: steps with their parts, worked out from a build's files."""
