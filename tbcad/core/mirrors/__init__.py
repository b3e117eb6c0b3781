"""The mirrors of both cameras: poses, radii, cells, and the record of them."""
