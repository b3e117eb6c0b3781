"""The records of an export: untrusted files, read strictly."""
