"""One field of density and colour, fitted to all rays of a light field."""
