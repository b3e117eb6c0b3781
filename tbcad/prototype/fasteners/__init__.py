"""Small purchased parts in their places: screws, washers, nuts, inserts, dowels, magnets, LEDs."""
