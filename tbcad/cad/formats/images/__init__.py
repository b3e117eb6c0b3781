"""Pictures: raw, TIFF, OpenEXR, Radiance, PNG."""
