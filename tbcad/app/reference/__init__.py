"""What the words of tbcad mean: terms, keys of a design, and where each is used."""
