"""Where a symbol comes from and where it goes: from the paper's equation to the engine's line that calls its function.

A way has five stations at most, each a list of places:

    paper        the equations, as the comparison with the paper has them: those of the symbol itself, else the first
                 that the symbol stands in, or those of the file that derives it
    derivation   the line of maxima/ that derives it, and what was proved of the steps that compute it
    data         the groups of steps in generated/data/programs.json, and the functions that are made of them
    code         the lines of generated C and Python
    engine       the lines that call these functions

Lines are found in the files themselves, so that they are those of the sources at hand. An installed package has no
maxima/; its files are then named without lines.
"""

import difflib
import itertools
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
from omniroll.kernels import spellings

STATIONS = ("paper", "derivation", "data", "code", "engine")
MOST_PLACES = {"paper": 3, "derivation": 5, "data": 1, "code": 3, "engine": 2}  # on one screen; the rest is counted
SIGN = re.compile(r"\\[A-Za-z]+|\S")
NO_SIGN = re.compile(r"\\(?:text|mathrm)\{[^{}]*\}|\\(?:left|right|quad|boldsymbol)\b")
BRACED = re.compile(r"\{\s*(\\[A-Za-z]+|[^\s{}\\])\s*\}")
COUNTING = (r" _ [ijkl] ", r" _ \{(?: [ijkl1]){2} \} ")  # the index of a wheel; of a roller on a wheel
NUMBERED = re.compile(r"\d+\.\d+\Z")  # of an equation
QUOTED = re.compile(r'"[^"]*"')
CHAPTER = re.compile(r'chapter\("([^"]*)", "([^"]*)"\)')
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


@cache
def way(name: str) -> Way:
    """The way of a symbol or an equation of the paper, a formula (7.1:m13), a step, a function of a kernel or in C, or
    an effect; symbols in the spellings of kernels/spellings.py.

    Raises InvalidValueError for a name that is none of these, with the nearest ones.
    """
    plain = name.removeprefix("omniroll_").removeprefix("lanes_")
    if plain not in _all_symbols():
        plain = spellings.ELEMENT.sub("", plain)
    effects = {effect["name"]: effect for effect in generated_data.load("effects")["effects"]}
    if plain in effects and plain not in _functions():
        return _of_effect(effects[plain])
    if plain in _functions():
        return _of_function(plain)
    number = spellings.equation_number(plain)
    if number and _chapters([number]) + _paper(number, number):
        return _of_equation(number)
    formula = plain if plain in _formulas() else None
    symbol = _subject(formula) if formula else spellings.looked_up(plain, _spelled_symbols(), without_index=False)
    if not (formula or symbol or _names_of(plain)):
        formula = spellings.looked_up(plain, _spelled_formulas(), without_index=False)
        symbol = _subject(formula) if formula else spellings.looked_up(plain, _spelled_symbols())
    if not (formula or symbol or _names_of(plain)):
        known = {*effects, *_functions(), *_formulas(), *_all_symbols()}
        near = difflib.get_close_matches(plain, sorted(known), n=5, cutoff=0.5)
        raise InvalidValueError("SYMBOL", name, f"is not known; nearest: {', '.join(near) or 'none'}")
    return _of_symbol(formula or symbol or plain, symbol or plain)


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


def _all_symbols() -> set[str]:
    """Every name in the programs, and every symbol of the paper."""
    return {*_in_programs(), *generated_data.load("symbols")["symbols"]}


@cache
def _in_programs() -> frozenset[str]:
    """Every name that a step defines, every name in the code of a symbol of the paper, every field and argument."""
    names = {own for steps in _programs()["steps"].values() for _, own in _defined(steps["body"])}
    for entry in generated_data.load("symbols")["symbols"].values():
        names |= {INDEXED.sub("", entry["code"])} - {""}
    for base in _programs()["bases"]:
        names |= set(base["model"])
    for forms in _functions().values():
        for form in forms:
            names |= _read_by(form) | set(form["outputs"]) | {own for _, own in _defined(form["body"])}
    return frozenset(names)


def _names_of(symbol: str) -> set[str]:
    """The names under which a symbol stands in maxima/ and in the code."""
    names = {symbol} & _all_symbols()
    for own, entry in generated_data.load("symbols")["symbols"].items():
        code = INDEXED.sub("", entry["code"])
        if symbol in (own, code, entry["code"], entry.get("maxima")):
            names |= {own, code} if code else {own}
    return names


@cache
def _spelled_symbols() -> dict[str, str]:
    """{normal spelling: symbol} of the paper's symbols: by their names and as LaTeX."""
    symbols = generated_data.load("symbols")["symbols"]
    by_latex = ((entry["latex"], own) for own, entry in symbols.items())
    return spellings.table([*((own, own) for own in symbols), *by_latex, *spellings.ALSO.items()])


@cache
def _spelled_formulas() -> dict[str, str]:
    """{normal spelling: formula} of what formulas are about: P_1 of 3.3:P1."""
    return spellings.table((own.rpartition(":")[2], own) for own, record in _formulas().items())


def _subject(formula: str) -> str | None:
    """The symbol that a formula is about: m13 of 7.1:m13, P of 3.3:P1, PL of PL:1."""
    head, _, tail = formula.rpartition(":")
    stem = re.sub(r"(?:\d+|s)\Z", "", tail)
    found = (spellings.looked_up(text, _spelled_symbols()) for text in (tail, stem, head) if text)
    return next(filter(None, found), None) if _formulas()[formula]["kind"] != "claim" else None


# The ways


def _of_equation(number: str) -> Way:
    found = Way(number, next((r["title"] for r in _formulas().values() if r["id"] == r["equation"] == number), ""))
    functions = tuple(name for name, forms in _functions().items() if any(number in f["equations"] for f in forms))
    chapters = _chapters([number])
    found.stations["paper"] = _paper(number, number)
    files = [place.file for place in chapters]
    proofs = _stated(files, rf"\({re.escape(number)}\)") or _stated(files[:1], "")
    found.stations["derivation"] = [*chapters[:1], *proofs, *chapters[1:]]
    found.stations["data"] = _data((), functions)
    found.stations["code"] = _calls_in_code(functions)
    found.stations["engine"] = _engine(functions)
    return found


@cache
def _of_symbol(name: str, symbol: str) -> Way:
    names = _names_of(symbol)
    entries = generated_data.load("symbols")["symbols"]
    meaning = next((entry["meaning"] for own, entry in entries.items() if symbol in (own, entry["code"])), "")
    found = Way(name, meaning)
    groups = tuple(dict.fromkeys(group for own in sorted(names) for group in _groups_of(own)))
    functions = _functions_with(groups) or _functions_that_read(names)
    found.stations["paper"] = _paper(name, symbol) or _first_in_the_paper(names) or _of_chapters(symbol, names)
    derived = _derived(symbol, names) if names else _compared(name)
    own = rf"\b(?:{'|'.join(map(re.escape, sorted(_names_in_maxima(names) or {symbol})))})\b"
    stated = _stated([place.file for place in derived[:1]], own)
    found.stations["derivation"] = [*derived[:1], *stated, *_proved(groups), *derived[1:]]
    found.stations["data"] = _data(groups, functions)
    found.stations["code"] = _code(names & _in_programs())
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
    found.stations["code"] = _calls_in_code((name,)) or _written_on_demand(name)
    found.stations["engine"] = _engine((name,))
    return found


def _calls_in_code(names: tuple[str, ...]) -> list[Place]:
    """Where functions stand in C and Python."""
    if not names:
        return []
    pattern = "|".join([*map(re.escape, names), *(["constants"] if "prepare" in names else [])])
    return [
        *_lines(_generated("c"), rf"\bomniroll_(?:{pattern})\("),
        *_lines(_generated("python"), rf"\bdef (?:{'|'.join(map(re.escape, names))})\("),
    ]


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
    """The formulas of the comparison that are about a symbol, those with a number first; or the entry of that name."""
    subjects = (symbol, name.rpartition(":")[2] if name in _formulas() else symbol)
    about = [
        own
        for own, record in _formulas().items()
        if record["kind"] != "claim" and any(_is_about(own, subject) for subject in subjects)
    ]
    found = [name] * (name in _formulas()) + sorted(about, key=lambda own: not own[0].isdigit())
    return [_entry(_formulas()[own]) for own in dict.fromkeys(found)]


def _is_about(formula: str, symbol: str) -> bool:
    """7.1:m13 is about m13, and all that begins with 7.1: is about (7.1)."""
    if NUMBERED.match(symbol):
        return formula.partition(":")[0] == symbol
    tail = formula.rpartition(":")[2]
    return tail == symbol or spellings.looked_up(tail, _spelled_symbols()) == symbol


def _entry(record: dict) -> Place:
    """Where the comparison speaks of a formula or a claim."""
    headed, named = (
        _first(_generated("formulas"), "formulas.md", f"{mark}`{record['id']}`")[0] for mark in ("### ", "")
    )
    printed = record["text"]["printed"] or record["text"]["title"]
    return Place("generated/formulas/formulas.md", headed or named, f"({record['id']}) {record['verdict']}: {printed}")


def _first_in_the_paper(names: set[str]) -> list[Place]:
    """The first formula that a symbol stands in, in the paper's order; its definition, where that is one."""
    symbols = generated_data.load("symbols")["symbols"]
    wanted = [_with_any_index(symbols[name]["latex"]) for name in sorted(names & symbols.keys())]
    in_order = sorted(_formulas().values(), key=lambda record: record["section"])
    holding = (record for record in in_order if any(signs.search(_printed_signs(record)) for signs in wanted))
    return [_entry(record) for record in itertools.islice(holding, 1)]


def _printed_signs(record: dict) -> str:
    """The signs of a formula; of a claim in words those of the formulas in it."""
    printed = record["printed"]
    return _signs(printed if record["kind"] == "formula" else " ".join(re.findall(r"\$([^$]*)\$", printed)))


def _signs(latex: str) -> str:
    """Each sign of LaTeX between two spaces, without words and without braces around one sign."""
    text = NO_SIGN.sub(" ", latex)
    while text != (text := BRACED.sub(r" \1 ", text)):
        pass
    return f" {' '.join(SIGN.findall(text))} "


def _with_any_index(latex: str) -> re.Pattern:
    """A symbol's signs, whichever index counts its wheel or its roller."""
    signs = _signs(latex)
    for one_or_two in COUNTING:
        if index := re.search(rf"{one_or_two}\Z", signs):
            return re.compile(re.escape(signs[: index.start()]) + one_or_two)
    return re.compile(re.escape(signs))


def _of_chapters(symbol: str, names: set[str]) -> list[Place]:
    """The equations of the files in maxima/paper that derive a symbol."""
    files = {place.file.removeprefix("maxima/") for place in _derived(symbol, names)}
    chapters = [CHAPTER.match(place.text) for place in _lines(_maxima("paper"), CHAPTER.pattern)]
    numbers = [number for found in chapters if found and found[1] in files for number in found[2].split()]
    return [place for number in numbers if NUMBERED.match(number) for place in _paper(number, number)]


def _derived(symbol: str, names: set[str]) -> list[Place]:
    """The lines of maxima/ that give a symbol its value; of one that paper/ takes as given, its first use there."""
    own_names = _names_in_maxima(names)
    steps = {name for name in names if _groups_of(name)}
    pattern = "|".join(map(re.escape, sorted(own_names | steps or names)))
    defined = rf"^(?:{pattern})(?:_of_\w+)?(?:\(.*?\))?\s*:=?|'(?:let|var|add|update), (?:{pattern}),"
    own = rf"\b(?:{'|'.join(map(re.escape, sorted(own_names or names)))})\b"
    found = _lines(_maxima("paper", "forms", "effects", "programs"), defined)
    if not any(place.file.startswith("maxima/paper/") for place in found):
        given = (place for place in _lines(_maxima("paper"), own) if re.search(own, QUOTED.sub("", place.text)))
        found = [*itertools.islice(given, 1), *found]
    return found or _first_in_each_file(
        _lines(_maxima("forms", "effects", "programs"), own) or _lines(_maxima("comparison"), own)
    )


def _names_in_maxima(names: set[str]) -> set[str]:
    """The names of symbols of the paper in maxima/paper."""
    symbols = generated_data.load("symbols")["symbols"]
    return {INDEXED.sub("", symbols[own].get("maxima", own)) for own in names & symbols.keys()}


def _stated(files: list[str], pattern: str) -> list[Place]:
    """The proofs in these files whose statement has the pattern, each with its claim."""
    places = []
    for file in dict.fromkeys(files):
        source = file.removeprefix("maxima/")
        text = "\n".join(_text(_maxima_folder() / source))
        for proof in generated_data.load("proofs")["proofs"]:
            start = text.find(f'prove("{proof["name"]}"') if proof["file"] == source else -1
            if start >= 0 and re.search(pattern, text[start : text.index(")$", start)]):
                places.append(Place(file, text.count("\n", 0, start) + 1, f"proved: {proof['name']}: {proof['claim']}"))
    return places


def _compared(name: str) -> list[Place]:
    """Where maxima/comparison says what was derived for a formula."""
    return _lines(_maxima("comparison"), rf'^\w+\("{re.escape(name)}"')


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
    if not names:
        return []
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
        if any(names & (_read_by(form) | set(form["outputs"])) for form in forms)
    )


def _read_by(form: dict) -> set[str]:
    """The inputs of a function and the symbols of their elements."""
    arguments = generated_data.load("arguments")["arguments"]
    inputs = [name if isinstance(name, str) else name[0] for name in form["inputs"]]  # [name, effect] with that alone
    return {*inputs, *(symbol for name in inputs for symbol in arguments[name]["elements"])}


def _engine(functions: tuple[str, ...]) -> list[Place]:
    """The lines of the compiled and of the Python engine that call the functions."""
    if not functions:
        return []
    pattern = "|".join(map(re.escape, functions))
    solved = _lines(_engine_rooms(), r"^\s*core_rates\(") if "forward_dynamics" in functions else []
    solved.sort(key=lambda place: not place.file.endswith("step/collocation.c"))  # each step's evaluations first
    return [
        *(replace(place, text=f"{place.text}   (core_rates calls forward_dynamics)") for place in solved),
        *_lines(_engine_rooms(), rf"\b(?:lanes|omniroll|set)_(?:{pattern})\("),
        *_lines(_package("engine", "effects", "kernels", "results"), rf"\.(?:{pattern})\(|call\(\"(?:{pattern})\""),
    ]


# Files


def _generated(folder: str) -> Path:
    return Path(str(resources.files("omniroll.generated"))) / folder


def _package(*rooms: str) -> list[Path]:
    root = Path(str(resources.files("omniroll")))
    return [root / room for room in rooms]


def _engine_rooms() -> list[Path]:
    """The folders of the engine's C."""
    root = Path(str(resources.files("omniroll.csrc")))
    return [root, *sorted(filter(Path.is_dir, root.iterdir()))]


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
    """The lines that match, in the order in which one reads the files."""
    wanted = re.compile(pattern)
    places = []
    for folder in folders if isinstance(folders, list) else [folders]:
        if not folder.is_dir():
            continue
        for file in sorted(filter(_is_source, folder.iterdir()), key=_reading_order):
            for number, text in enumerate(_text(file), 1):
                if wanted.search(text):
                    places.append(Place(_shown(file), number, text.strip()))
    return places


def _is_source(file: Path) -> bool:
    return file.suffix in (".c", ".h", ".py", ".mac")


def _reading_order(file: Path) -> tuple[int, str]:
    """The derivation's files as derive.mac lists them; of the generated ones, those with few effects first."""
    if file.suffix == ".mac":
        return _steps_of_the_derivation().get(f"{file.parent.name}/{file.stem}", 0), file.name
    return file.stem.count("_"), file.name


@cache
def _steps_of_the_derivation() -> dict[str, int]:
    names = re.findall(r'^ +"(\w+/\w+)"', "\n".join(_text(_maxima_folder() / "derive.mac")), re.MULTILINE)
    return {name: place for place, name in enumerate(names)}


def _first(folder: Path, file: str, text: str) -> tuple[int, str]:
    """The first line of a file that holds a text: its number and itself; 0 where there is none."""
    for number, line in enumerate(_text(folder / file), 1):
        if text in line:
            return number, line.strip()
    return 0, ""
