"""The machine with balls: whether its files show every mirror, with the whole object, unhindered.

Like all of the proof it takes from the record only what was asked for and where to begin looking.
"""
