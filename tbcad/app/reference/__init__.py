"""Meanings of tbcad's words: terms, keys of a design, and where each is used."""
