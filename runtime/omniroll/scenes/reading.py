"""A TOML file as tables, with the line of every key."""

import re
import sys
import tomllib
from os import PathLike
from typing import Any

from omniroll.scenes.problems import Problem, SceneError

MOST_BYTES = 1_000_000
HEADER = re.compile(r"\s*\[+\s*([^\[\]]+?)\s*\]+\s*(?:#.*)?")
KEY = re.compile(r"""\s*([\w."' -]+?)\s*=""")

Lines = dict[tuple[str, str | None], int]


def read(path: str | PathLike) -> tuple[dict[str, Any], Lines]:
    """The tables of a scene file, and the lines of their keys. Raises SceneError."""

    def refused(reason: str) -> SceneError:
        return SceneError(path, [Problem(None, None, None, reason)])

    try:
        with open(path, "rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise refused(getattr(error, "strerror", None) or str(error)) from None
    if len(raw) > MOST_BYTES:
        raise refused(f"longer than {MOST_BYTES} bytes, which no scene is")
    try:
        text = raw.decode("utf-8-sig")
        return tomllib.loads(text), lines_of(text)
    except UnicodeDecodeError as error:
        raise refused(f"byte {error.start} is not UTF-8 text") from None
    except tomllib.TOMLDecodeError as error:
        raise refused(f"not TOML: {error}") from None
    except RecursionError:
        raise refused("lists or tables stand too deep inside each other") from None
    except ValueError:  # what int() makes of thousands of digits
        raise refused(f"a whole number has too many digits{_where_digits_are_many(text)}") from None


def _where_digits_are_many(text: str) -> str:
    digits = re.search(rf"[0-9_]{{{sys.get_int_max_str_digits() or 1}}}", text)
    return f" (at line {text.count(chr(10), 0, digits.start()) + 1})" if digits else ""


def lines_of(text: str) -> Lines:
    """The first line, from 1, of every (table, key), and of every (table, None).

    tomllib keeps no lines, and a scan is enough for messages: lines inside a string that look like keys only
    add entries that nobody asks for.
    """
    lines: Lines = {}
    table: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        if header := HEADER.fullmatch(line):
            table = _names(header[1])
            lines.setdefault((table[0], None), number)
            lines.setdefault((".".join(table), None), number)
        elif key := KEY.match(line):
            place = table + _names(key[1])
            lines.setdefault((place[0], None), number)
            if len(place) > 1:
                lines.setdefault((place[0], place[1]), number)
                lines.setdefault((".".join(place[:-1]), place[-1]), number)
    return lines


def _names(dotted: str) -> list[str]:
    return [name.strip(" \"'") for name in dotted.split(".")]
