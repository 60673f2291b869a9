"""Filling templates: the one environment, and what the templates use beside the printers."""

import re
import textwrap
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from .infix import broken
from .latex import escaped
from .programs import Array, Function, Loop

SOURCE = "maxima/derive.mac"
PLACE_WORDS = {
    "once": "once",
    "wheel": "per wheel",
    "slot": "per free-roller slot",
    "pair": "per pair of wheels",
    "earlier": "per wheel and wheel before it",
    "roller": "per free roller",
}


def template(file: str, **values: object) -> str:
    """The text of one emitted file. file: the template's name without .j2."""
    return ENVIRONMENT.get_template(f"{file}.j2").render(
        template=f"codegen/templates/{file}.j2", source=SOURCE, **values
    )


def sizes(array: Array) -> str:
    """[N][n-1] after the array's name in comments."""
    return "".join(f"[{size}]" for size in array.shape)


def wrapped(text: str, before: str, then: str | None = None, width: int = 110) -> str:
    """Prose in lines of which the first starts with `before`, each other one with `then` or `before`."""
    return (
        "\n".join(
            textwrap.wrap(
                text,
                width,
                initial_indent=before,
                subsequent_indent=before if then is None else then,
                break_long_words=False,
                break_on_hyphens=False,
            )
        )
        or before.rstrip()
    )


def comment(text: str, width: int = 110) -> str:
    """Prose as one C comment."""
    return wrapped(text, "/* ", " * ", width - 3) + " */"


def commented(text: str) -> str:
    """A block of a template as one C comment with its line's end."""
    return comment(text.strip(), 118) + "\n"


def paragraph(text: str, before: str = " * ") -> str:
    """A block of a template as a paragraph within a comment."""
    return wrapped(text.strip(), before, width=118) + "\n"


def field(declaration: str, before: str, array: Array, width: int = 116) -> str:
    """A field of a struct with its unit and its meaning: beside it, or above where the line would be too long."""
    text = f"{before}{array.unit}: {array.meaning}"
    line = f"    {declaration} /* {text} */"
    return line if len(line) <= width else f"{wrapped(f'{text} */', '    /* ', '     * ')}\n    {declaration}"


def count_of(array: Array, holder: str) -> str:
    """The number of elements of an array as C text; the counts stand in the struct `holder`."""
    sizes = {"N": f"{holder}->wheels", "n-1": f"({holder}->rollers_per_wheel - 1)"}
    return "*".join(str(sizes.get(size, size)) for size in array.shape)


# Numbers of the header's example: a vehicle of 15 cm whose wheels have a radius of 5 cm; any other number is zero.
EXAMPLE = {
    "mass": "2.0", "yaw_inertia": "0.02", "wheel_inertia": "5e-4", "roller_inertia": "1e-6", "yaw_scale": "1.0",
    "platform_radius": "0.15", "wheel_radius": "0.05", "roller_axis_radius": "0.038",
    "wheel_angles": "0 2.0944 4.1888", "wheel_places": "0.15 0 -0.075 0.13 -0.075 -0.13", "center_of_mass": "0.01 0",
    "axle_damping": "1e-4 1e-4 1e-4", "axle_torque": "1e-3 1e-3 1e-3", "axle_fade_speed": "0.1",
    "roller_damping": "1e-7 1e-7 1e-7", "roller_torque": "1e-6 1e-6 1e-6", "roller_fade_speed": "0.1",
    "gravity": "9.81", "slope_angle": "0.02",
    "arc_radii": "0.012 0.012 0.012",
    "torque_constant": "0.02", "resistance": "1.0", "motor_gear_ratio": "10.0", "back_emf": "0.02",
}  # fmt: skip


def example_count(array: Array) -> str:
    """The number of elements of an array of the example."""
    return "*".join("WHEELS" if size == "N" else str(size) for size in array.shape)


def example_numbers(array: Array, prefix: str) -> str:
    """The example's value of a constant, or its values."""
    return ", ".join(f"({prefix}_real){number}" for number in EXAMPLE.get(array.name, "0").split())


def broken_list(head: str, items: list[str], width: int = 110) -> str:
    """`head` with the items and a closing bracket, broken between items."""
    lines = [head]
    for place, item in enumerate(items):
        text = item + (")" if place == len(items) - 1 else ", ")
        if len(lines[-1]) + len(text.rstrip()) > width - 4:
            lines[-1] = lines[-1].rstrip()
            lines.append(" " * 8)
        lines[-1] += text
    return "\n".join(lines)


def work(function) -> str:
    """The operation counts as one sentence."""
    places = []
    for place, counts in function.operations.items():
        told = ", ".join(f"{number} {kind}" for kind, number in counts.items() if number)
        if told:
            places.append(f"{PLACE_WORDS[place]} {told}")
    return f"Operations: {'; '.join(places) or 'none'}. Intermediates: {function.intermediates}."


def made_of(function: Function) -> str:
    """The groups of steps that a function was made from, by the files that they stand in, as a sentence."""
    files: dict[str, list[str]] = {}
    for name in function.groups:
        files.setdefault(function.sources[name], []).append(name)
    told = [f"{', '.join(names)} (maxima/{file})" for file, names in files.items()]
    return f" Steps: {'; '.join(told)}." if told else ""


def equations_of(numbers: Iterable[str]) -> str:
    """(3.1), (3.4) and plain words for what is not a number."""
    return ", ".join(f"({n})" if re.fullmatch(r"\d+\.\d+(:\w+)?", n) else n for n in numbers)


def sources(text: str) -> str:
    """The numbers of equations in a text, each in brackets."""
    return re.sub(r"(?<![\w.])\d+\.\d+", r"(\g<0>)", text)


def called(names: list[str], text: str) -> list[str]:
    """The functions that the text calls."""
    return [name for name in names if re.search(rf"\b{name}\(", text)]


def is_loop(node: object) -> bool:
    return isinstance(node, Loop)


def environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(Path(__file__).with_name("templates")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    made.filters |= {
        "sizes": sizes,
        "wrapped": wrapped,
        "broken_list": broken_list,
        "work": work,
        "made_of": made_of,
        "equations": equations_of,
        "sources": sources,
        "tex": escaped,
        "called": called,
        "comment": comment,
        "broken": broken,
        "commented": commented,
        "paragraph": paragraph,
        "field": field,
        "count_of": count_of,
        "example_count": example_count,
        "example_numbers": example_numbers,
    }
    made.tests["loop"] = is_loop
    return made


ENVIRONMENT = environment()
