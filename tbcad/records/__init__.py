"""One model for each file that tbcad writes and reads: fields, units, schema, reader, writer."""
