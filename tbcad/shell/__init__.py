"""The shell: the convex mirrors of one camera as one thick solid."""
