"""The record of an export: files that nobody vouches for, read strictly."""
