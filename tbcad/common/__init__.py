"""Files, processes, progress and colours that every room shares."""
