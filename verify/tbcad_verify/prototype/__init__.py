"""Verification of the prototype: whether its files show every mirror, unobstructed, in full.

As everywhere in the verification, the record gives only the requirements and starting values.
"""
