"""Mirrors on pedestals: cells cut by planes, with grooves between them.

Borders between cells and corners of grooves (`borders`), the sides of the mirrors above them
(`sides`), which borders are too short to be kept (`plan`, at bounding planes `rims`), the cells
(`cells`) and what follows from their walls (`walls`, `wall_moments`).
"""
