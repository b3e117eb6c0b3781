"""Printability: each part is measured once, and compared with the profiles of printers."""
