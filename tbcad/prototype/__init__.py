"""The prototype: steel balls on a base that turns, its stage and its frame."""
