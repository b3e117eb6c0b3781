"""The balls: which ones, in which place, and at which stop each shows which mirror."""
