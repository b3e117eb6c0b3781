"""STEP files, read anew: by a CAD kernel in a process of its own, and as text."""
