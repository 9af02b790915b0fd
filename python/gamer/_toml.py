"""TOML texts of dictionaries: parameter files and galaxy files."""

from . import _core


def value_text(value):
    """A value in TOML syntax; numbers read back exactly."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return _core.toml_string(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    if isinstance(value, dict):
        items = (f"{key_text(key)} = {value_text(item)}" for key, item in value.items())
        return "{" + ", ".join(items) + "}"
    raise TypeError(f"TOML has no values of type {type(value).__name__}")


def key_text(key):
    return key if _core.is_bare_key(key) else _core.toml_string(key)


def _is_table(value):
    return isinstance(value, dict)


def _is_tables(value):
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def dumps(tree):
    """The text of a tree whose sections are tables or lists of tables."""
    lines = []
    for section, content in tree.items():
        if _is_table(content):
            blocks = [(f"[{key_text(section)}]", content)]
        elif _is_tables(content):
            blocks = [(f"[[{key_text(section)}]]", item) for item in content]
        else:
            lines.insert(0, f"{key_text(section)} = {value_text(content)}")
            continue
        for title, table in blocks:
            if lines:
                lines.append("")
            lines.append(title)
            lines += [f"{key_text(key)} = {value_text(value)}" for key, value in table.items()]
    return "\n".join(lines) + "\n"
