"""What people look at, made from the files of an export alone."""
