"""Results as tables, plots and the files of a study."""
