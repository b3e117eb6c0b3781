"""How weight bends a prototype as its base turns, by the solids that a build wrote."""
