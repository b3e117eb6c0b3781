"""The photographs of a run, merged by the state of the machine that took them."""
