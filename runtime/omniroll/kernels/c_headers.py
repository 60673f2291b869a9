"""Reads the declarations of the generated C headers, for cffi. The build runs this file by itself."""

import re

NUMBER_TYPES = {  # C type and the macro that chooses it
    "double": ("double", None),
    "float": ("float", "OMNIROLL_FLOAT"),
    "long_double": ("long double", "OMNIROLL_LONG_DOUBLE"),
}
PROTOTYPE = re.compile(
    r"^[ \t]*(?:OMNIROLL_API\s+)?((?:void|int|size_t|real_t)\s+omniroll_\w+\s*\([^;{}]*\)\s*;)", re.MULTILINE
)


def is_set_header(name: str) -> bool:
    """Whether a file of generated/c is the header of a set of effects."""
    return name.startswith("omniroll_") and name.endswith(".h")


def without_comments(text: str) -> str:
    """C source `text` with each comment replaced by one space."""
    return re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.DOTALL)


def prototypes(header: str) -> list[str]:
    """The function declarations of one generated header, in its order.

    Raises ValueError where the header names a function whose declaration is not read.
    """
    code = without_comments(header)
    found = PROTOTYPE.findall(code)
    named = re.findall(r"\bomniroll_\w+\s*\(", code)
    if not found or len(found) != len(named):
        raise ValueError(f"generated header: {len(named)} functions named, {len(found)} declarations read")
    return found


def declarations(number_type: str, headers: list[str]) -> str:
    """What cffi must know of `headers` (their texts) where real_t is `number_type`'s C type."""
    c_type, _ = NUMBER_TYPES[number_type]
    lines = [f"typedef {c_type} real_t;"]
    for header in headers:
        lines += prototypes(header)
    return "\n".join(lines)


def engine_declarations(header: str, sets: tuple[str, ...] | None = None) -> str:
    """What cffi must know of the engine's header, engine.h; its functions stand in the list ENGINE_SETS.

    sets: other sets of effects than those of the list.
    """
    joined = header.replace("\\\n", " ")
    code = "\n".join(line for line in without_comments(joined).splitlines() if not line.startswith("#"))
    listed = re.search(r"#define ENGINE_SETS\(each\)(.*)", joined)
    pattern = re.search(r"#define ENGINE_FUNCTIONS\(set\)(.*)", joined)
    if not listed or not pattern:
        raise ValueError("engine.h: no list of sets or of functions")
    wanted = re.findall(r"each\((\w+)\)", listed[1]) if sets is None else sets
    return code.replace("ENGINE_SETS(ENGINE_FUNCTIONS)", "\n".join(pattern[1].replace("##set##", s) for s in wanted))
