"""How exactly the machine must be made: random machines, each with what it sees."""
