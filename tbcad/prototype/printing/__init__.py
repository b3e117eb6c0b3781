"""Printed parts: the printer's bed, how a part lies on it, its mesh."""
