"""Whether a part can be made: its mesh measured once, and held against profiles of printers."""
