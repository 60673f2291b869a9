"""What the site makes of docstrings."""

import re

TABLE = re.compile(r"(?P<names>[\w., ()-]*\w\)?) {2,}(?P<text>\S.*)")  # a name, two spaces or more, what it is
MARKED = re.compile(r"`([^`\n]+)`")


def process_docstring(app, what, name, thing, options, lines: list[str]) -> None:
    """Docstrings are plain text, whose tables are a name and what it is; the site wants reStructuredText."""
    lines[:] = restructured(lines)


def process_bases(app, name, thing, options, bases: list) -> None:
    """Bases that no user needs to know are not shown."""
    bases[:] = [base for base in bases if issubclass(base, BaseException)] or [object]


def restructured(lines: list[str]) -> list[str]:
    """A plain docstring as reStructuredText: tables of names as definition lists, the rest as it stands."""
    found: list[str] = []
    column = None  # where the texts of a table begin
    for line in lines:
        entry = TABLE.fullmatch(line) if not line.startswith(" ") else None
        if entry:
            if column is None and found and found[-1]:
                found.append("")
            column = entry.start("text")
            found += [f"**{escaped(entry['names'].strip())}**", f"   {escaped(entry['text'])}"]
        elif column is not None and line.startswith(" "):
            found.append(f"   {escaped(line.strip())}")
        elif line.startswith("    "):  # a table that stands inside a paragraph, or code
            found += [] if found and (found[-1].startswith(("| ", "    ")) or not found[-1]) else [""]
            found.append(f"| {escaped(line.strip())}")
        else:
            if found and (found[-1].startswith("| ") or (column is not None and found[-1])) and line:
                found.append("")
            column = None
            found.append(escaped(line.strip()))
    return [*found, ""]


def escaped(text: str) -> str:
    """Text whose marks mean nothing to reStructuredText but those of `code`."""
    parts = MARKED.split(text)
    plain = [re.sub(r"([\\*|_])", r"\\\1", part).replace("`", r"\`") for part in parts[::2]]
    code = [f"``{part}``" for part in parts[1::2]]
    return "".join(piece for pair in zip(plain, [*code, ""], strict=True) for piece in pair)
