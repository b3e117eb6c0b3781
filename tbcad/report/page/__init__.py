"""report.html: one file that shows an export; its data by Python, its views by scripts beside."""
