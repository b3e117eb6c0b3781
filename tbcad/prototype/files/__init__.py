"""The files of the prototype: parts, tables, program and record."""
