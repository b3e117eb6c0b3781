"""One small file for each artefact that tbcad writes."""
