"""From the photographs of a run to the machine that took them, with its uncertainty."""
