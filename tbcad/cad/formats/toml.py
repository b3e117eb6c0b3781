"""Values as TOML; Python's own library reads it only."""


def toml_text(value: object) -> str:
    """A value as TOML, whose lists are tuples here."""
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(toml_text, value)) + "]"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    return str(value).lower() if isinstance(value, bool) else repr(value)
