"""Where a symbol comes from and where it goes: from the paper's equation to the engine's line that calls its function.

A way has five stations at most, each a list of places:

    paper        the equation, as the comparison with the paper has it
    derivation   the line of maxima/ that derives it, and what was proved of the steps that compute it
    data         the groups of steps in generated/data/programs.json, and the functions that are made of them
    code         the lines of generated C and Python
    engine       the lines that call these functions

Lines are found in the files themselves, so that they are those of the sources at hand. An installed package has no
maxima/; its files are then named without lines.
"""

import difflib
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from pathlib import Path

from omniroll import generated_data
from omniroll.errors import InvalidValueError

STATIONS = ("paper", "derivation", "data", "code", "engine")
MOST_PLACES = 12  # at one station; the rest is counted
FORMULA = re.compile(r"(?:.*:)?(\w+)\Z")  # 7.1:m13 is about m13
INDEXED = re.compile(r"[\[({].*")  # nu[0] is about nu, Mstar[1, 3] about Mstar


@dataclass(frozen=True)
class Place:
    """file: path in the project; line: 0 where it is not known."""

    file: str
    line: int
    text: str


@dataclass
class Way:
    """The stations of a symbol, in order; those that it has."""

    name: str
    meaning: str = ""
    stations: dict[str, list[Place]] = field(default_factory=lambda: {station: [] for station in STATIONS})

    def as_dict(self) -> dict:
        """Plain data: names and lists."""
        places = {station: [vars(place) for place in places] for station, places in self.stations.items() if places}
        return {"name": self.name, "meaning": self.meaning, "stations": places}


def way(name: str) -> Way:
    """The way of a symbol of the paper, a formula (7.1:m13), a step, a function of a kernel or in C, or an effect.

    Raises InvalidValueError for a name that is none of these, with the nearest ones.
    """
    plain = name.removeprefix("omniroll_").removeprefix("lanes_")
    effects = {effect["name"]: effect for effect in generated_data.load("effects")["effects"]}
    if plain in effects:
        return _of_effect(effects[plain])
    if plain in _functions():
        return _of_function(plain)
    symbol = FORMULA.match(plain)[1] if plain in _formulas() else plain
    names = _names_of(symbol)
    if not names and plain not in _formulas():
        known = {*effects, *_functions(), *_formulas(), *_all_symbols()}
        near = difflib.get_close_matches(plain, sorted(known), n=5, cutoff=0.5)
        raise InvalidValueError("SYMBOL", name, f"is not known; nearest: {', '.join(near) or 'none'}")
    return _of_symbol(name, symbol, names or {symbol})


# The data


@cache
def _programs() -> dict:
    return generated_data.load("programs")


@cache
def _functions() -> dict[str, list[dict]]:
    """The functions of the programs by name: one entry for each form that a roller model has."""
    found: dict[str, list[dict]] = {}
    for function in _programs()["functions"]:
        found.setdefault(function["name"], []).append(function)
    return found


@cache
def _formulas() -> dict[str, dict]:
    text = resources.files("omniroll.generated").joinpath("formulas", "formulas.json").read_text(encoding="utf-8")
    return {record["id"]: record for record in json.loads(text)["formulas"]}


def _defined(body: Iterable[dict]) -> Iterator[tuple[str, str]]:
    """(kind, name) of each step."""
    for node in body:
        if "loop" in node:
            yield from _defined(node["body"])
        else:
            kind = next((k for k in ("let", "var", "add", "update") if k in node), None)
            if kind:
                yield kind, node[kind]


@cache
def _groups_of(name: str) -> tuple[str, ...]:
    """The groups of steps that give a value to a name."""
    return tuple(
        group for group, steps in _programs()["steps"].items() if any(own == name for _, own in _defined(steps["body"]))
    )


def _used(body: Iterable[dict]) -> Iterator[str]:
    for node in body:
        if "use" in node:
            yield node["use"]
            yield from _used(_programs()["steps"][node["use"]]["body"])
        elif "loop" in node:
            yield from _used(node["body"])


@cache
def _functions_with(groups: tuple[str, ...]) -> tuple[str, ...]:
    """The functions that are made of one of the groups."""
    return tuple(
        name for name, forms in _functions().items() if any(set(groups) & set(_used(form["body"])) for form in forms)
    )


@cache
def _all_symbols() -> frozenset[str]:
    """Every name that a step defines, every symbol of the paper with its name in the code, every field and argument."""
    names = {own for steps in _programs()["steps"].values() for _, own in _defined(steps["body"])}
    for symbol, entry in generated_data.load("symbols")["symbols"].items():
        names |= {symbol, INDEXED.sub("", entry["code"])} - {""}
    for base in _programs()["bases"]:
        names |= {field["name"] for field in base["model"]}
    for forms in _functions().values():
        for form in forms:
            names |= {argument["name"] for argument in form["arguments"]}
            names |= {own for _, own in _defined(form["body"])} | set(form["elements"])
    return frozenset(names)


def _names_of(symbol: str) -> set[str]:
    """The names under which a symbol stands in maxima/ and in the code."""
    names = {symbol} & _all_symbols()
    for own, entry in generated_data.load("symbols")["symbols"].items():
        code = INDEXED.sub("", entry["code"])
        if symbol in (own, code, entry["code"], entry.get("maxima")):
            names |= {own, code} if code else {own}
    return names


# The ways


def _of_symbol(name: str, symbol: str, names: set[str]) -> Way:
    entries = generated_data.load("symbols")["symbols"]
    meaning = next((entry["meaning"] for own, entry in entries.items() if symbol in (own, entry["code"])), "")
    found = Way(name, meaning)
    groups = tuple(dict.fromkeys(group for own in sorted(names) for group in _groups_of(own)))
    functions = _functions_with(groups) or _functions_that_read(names)
    found.stations["paper"] = _paper(name, symbol)
    found.stations["derivation"] = [*_derived(symbol, names), *_proved(groups)]
    found.stations["data"] = _data(groups, functions)
    found.stations["code"] = _code(names)
    found.stations["engine"] = _engine(functions)
    return found


def _of_function(name: str) -> Way:
    forms = _functions()[name]
    found = Way(name, forms[0]["summary"])
    groups = tuple(dict.fromkeys(group for form in forms for group in _used(form["body"])))
    numbers = list(dict.fromkeys(number for form in forms for number in form["equations"]))
    found.stations["paper"] = [place for number in numbers for place in _paper(number, number)]
    found.stations["derivation"] = [*_chapters(numbers), *_proved(groups)]
    found.stations["data"] = _data(groups, (name,))
    found.stations["code"] = [
        *_lines(
            _generated("c"),
            rf"\b(?:omniroll_{name}|omniroll_constants)\(" if name == "prepare" else rf"\bomniroll_{name}\(",
        ),
        *_lines(_generated("python"), rf"\bdef {name}\("),
    ] or _written_on_demand(name)
    found.stations["engine"] = _engine((name,))
    return found


def _written_on_demand(name: str) -> list[Place]:
    """Where a function stands that only other sets have than those that are generated beforehand."""
    line, _ = _first(_generated("data"), "programs.json", f'"name": "{name}"')
    text = "C and Python are written from here when a scene calls for it: omniroll kernel SCENE --output DIR"
    return [Place("generated/data/programs.json", line, text)]


def _of_effect(effect: dict) -> Way:
    name = effect["name"]
    found = Way(name, effect["meaning"])
    source = effect["source"]
    groups = tuple(group for group, steps in _programs()["steps"].items() if steps["source"] == source)
    functions = tuple(
        own
        for own, forms in _functions().items()
        if any(name in case for form in forms for case in form.get("cases", []))
    )
    found.stations["derivation"] = [Place(f"maxima/{source}", 1, "the file that derives it"), *_proved(groups)]
    found.stations["data"] = [
        Place("generated/data/effects.json", *_first(_generated("data"), "effects.json", f'"name": "{name}"')),
        *_data(groups, functions),
    ]
    found.stations["code"] = _code(set(effect["neutral"]))
    found.stations["engine"] = [
        *_engine(functions),
        *_lines(_package("effects"), rf"\"{name}\""),
    ]
    return found


# The stations


def _paper(name: str, symbol: str) -> list[Place]:
    """The entries of the comparison that are about a symbol, or the one of that name."""
    records = [_formulas()[name]] if name in _formulas() else []
    for own, record in _formulas().items():
        about = FORMULA.match(own)
        if about and about[1] == symbol and record not in records:
            records.append(record)
    if not records and re.fullmatch(r"\d+\.\d+", symbol):
        records = [record for own, record in _formulas().items() if own.startswith(f"{symbol}:")]
    return [
        Place("generated/formulas/formulas.md", *_first(_generated("formulas"), "formulas.md", record["id"]))
        if not record["text"]["printed"]
        else Place(
            "generated/formulas/formulas.md",
            _first(_generated("formulas"), "formulas.md", record["id"])[0],
            f"({record['id']}) {record['verdict']}: {record['text']['printed']}",
        )
        for record in records
    ]


def _derived(symbol: str, names: set[str]) -> list[Place]:
    """The lines of maxima/ that give a symbol its value; of one that is given from outside, the first uses."""
    symbols = generated_data.load("symbols")["symbols"]
    own_names = (symbols[own].get("maxima", own) for own in names & symbols.keys())
    wanted = names | {INDEXED.sub("", own) for own in own_names}
    pattern = "|".join(map(re.escape, sorted(wanted)))
    defined = rf"^(?:{pattern})(?:_of_\w+)?(?:\(.*?\))?\s*:=?|'(?:let|var|add|update), (?:{pattern}),"
    rooms = _maxima("paper", "forms", "effects", "programs")
    used = rf"\b(?:{pattern})\b"
    found = _lines(rooms, defined) or _first_in_each_file(_lines(rooms, used))
    return found or _first_in_each_file(_lines(_maxima("comparison"), used))


def _first_in_each_file(places: list[Place]) -> list[Place]:
    """What is given, not derived, is named where each file first uses it."""
    return list({place.file: place for place in reversed(places)}.values())[::-1]


def _chapters(numbers: list[str]) -> list[Place]:
    """The files of maxima/paper that derive an equation."""
    found = []
    for number in numbers:
        found += _lines(_maxima("paper"), rf"^chapter\(.*\b{re.escape(number)}\b")
    return list(dict.fromkeys(found))


def _proved(groups: tuple[str, ...]) -> list[Place]:
    """The proofs of the groups of steps, each with its claim."""
    proofs = {proof["name"]: proof for proof in generated_data.load("proofs")["proofs"]}
    names = list(dict.fromkeys(name for group in groups for name in _programs()["steps"][group]["proofs"]))
    places = []
    for name in names:
        file = proofs[name]["file"]
        line, _ = _first(_maxima_folder(), file, f'"{name}"')
        if not line:  # a name that is put together, for instance of a roller model and a function
            line, _ = _first(_maxima_folder(), file, f'"{name.rpartition(", ")[2]}"')
        places.append(Place(f"maxima/{file}", line, f"proved: {name}: {proofs[name]['claim']}"))
    return places


def _data(groups: tuple[str, ...], functions: tuple[str, ...]) -> list[Place]:
    places = []
    for group in groups:
        line, _ = _first(_generated("data"), "programs.json", f'"{group}": {{')
        source = _programs()["steps"][group]["source"]
        places.append(Place("generated/data/programs.json", line, f"steps {group}, from maxima/{source}"))
    if functions:
        line, _ = _first(_generated("data"), "programs.json", f'"name": "{functions[0]}"')
        places.append(Place("generated/data/programs.json", line, f"functions {', '.join(functions)}"))
    return places


def _code(names: set[str]) -> list[Place]:
    """The lines of C and Python that give one of the names a value, else those that read it."""
    pattern = "|".join(map(re.escape, sorted(names)))
    places = []
    for folder in ("c", "python"):
        given = _lines(_generated(folder), rf"(?:^|[\s.>])(?:{pattern})(?:_i|_)?(?:\[.*?\])*\s*\+?=[^=]")
        places += _first_of_each_text(given or _lines(_generated(folder), rf"\b(?:{pattern})\b"))
    return places


def _first_of_each_text(places: list[Place]) -> list[Place]:
    """Lines that say the same stand once, with how often they stand."""
    times = Counter(place.text for place in places)
    first = {place.text: place for place in reversed(places)}
    return [
        replace(first[text], text=text if number == 1 else f"{text}   ({number} times)")
        for text, number in times.items()
    ]


def _functions_that_read(names: set[str]) -> tuple[str, ...]:
    """The functions with such an argument or element."""
    return tuple(
        name
        for name, forms in _functions().items()
        if any(names & ({a["name"] for a in form["arguments"]} | set(form["elements"])) for form in forms)
    )


def _engine(functions: tuple[str, ...]) -> list[Place]:
    """The lines of the compiled and of the Python engine that call the functions."""
    if not functions:
        return []
    pattern = "|".join(map(re.escape, functions))
    solved = r"|^\s*core_rates\(" if "forward_dynamics" in functions else ""  # a set's header calls it by this name
    return [
        *_lines(_package_folder("omniroll.csrc"), rf"\b(?:lanes|omniroll|set)_(?:{pattern})\({solved}"),
        *_lines(_package("engine", "effects", "kernels", "results"), rf"\.(?:{pattern})\(|call\(\"(?:{pattern})\""),
    ]


# Files


def _generated(folder: str) -> Path:
    return Path(str(resources.files("omniroll.generated"))) / folder


def _package(*rooms: str) -> list[Path]:
    root = Path(str(resources.files("omniroll")))
    return [root / room for room in rooms]


def _package_folder(package: str) -> Path:
    return Path(str(resources.files(package)))


def _maxima_folder() -> Path:
    """The derivation's folder, in a checkout beside generated/."""
    return Path(str(resources.files("omniroll.generated"))).parent / "maxima"


def _maxima(*rooms: str) -> list[Path]:
    return [_maxima_folder() / room for room in rooms]


def _shown(file: Path) -> str:
    """A file's path as the project names it."""
    parts = file.parts
    for top in ("generated", "maxima", "runtime", "csrc", "omniroll"):
        if top in parts:
            at = len(parts) - 1 - parts[::-1].index(top)
            own = "/".join(parts[at:])
            return {"csrc": f"runtime/{own}", "omniroll": f"runtime/{own}"}.get(top, own)
    return file.name


@cache
def _text(file: Path) -> tuple[str, ...]:
    try:
        return tuple(file.read_text(encoding="utf-8").splitlines())
    except FileNotFoundError:
        return ()


def _lines(folders: Path | list[Path], pattern: str) -> list[Place]:
    """The lines that match, in the order of the files' names."""
    wanted = re.compile(pattern)
    places = []
    for folder in folders if isinstance(folders, list) else [folders]:
        if not folder.is_dir():
            continue
        for file in sorted(path for path in folder.iterdir() if path.suffix in (".c", ".h", ".py", ".mac")):
            for number, text in enumerate(_text(file), 1):
                if wanted.search(text):
                    places.append(Place(_shown(file), number, text.strip()))
    return places


def _first(folder: Path, file: str, text: str) -> tuple[int, str]:
    """The first line of a file that holds a text: its number and itself; 0 where there is none."""
    for number, line in enumerate(_text(folder / file), 1):
        if text in line:
            return number, line.strip()
    return 0, ""
