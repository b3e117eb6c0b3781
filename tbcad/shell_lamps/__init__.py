"""A ring of LEDs on each camera's lens, whose light the shell's mirrors throw onto the object."""
