"""Light fields: simulated photographs, datasets, depth, fields, relighting, and their viewer."""
