"""The records of a build: untrusted files, read strictly."""
