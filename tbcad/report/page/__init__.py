"""report.html: one file that shows a build; its data by Python, its views by scripts beside."""
