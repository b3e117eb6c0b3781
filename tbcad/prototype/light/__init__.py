"""Light on the object and the dark behind it: lamps on stands, and a shroud of card."""
