"""The CAD kernel, wrapped: B-rep pieces, solids, meshes, checks."""
