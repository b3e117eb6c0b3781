"""The output folder of a build: what is written, and how it replaces an older one."""
