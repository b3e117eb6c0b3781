"""What a user may choose: the keys of a design, read from TOML and checked."""
