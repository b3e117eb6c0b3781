"""Mirrors on pedestals: cells cut by planes, with grooves between them.

Borders between cells, corners of grooves and the sides of the mirrors above them (`borders`), which
borders are too short to be kept (`plan`), and the cells with their walls (`cells`).
"""
