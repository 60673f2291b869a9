"""The mathematics of the paper's LaTeX, read once and written as plain text or as MathML.

Only what the paper and the comparison use: symbols, scripts, fractions, accents, fences, matrices, words.
What is not known is an error, so that nothing is shown wrongly.

Why no library makes the MathML: latex2mathml 3.81 drops the last row of a matrix whose last cell is empty, which two of
the formulas have (M* and V as printed), and sets no space around sin and cos. The reader is needed in any case, for the
plain text and for the tests that put numbers into the formulas.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from html import escape

from .programs import ContractError

GREEK = {
    "alpha": "\u03b1", "beta": "\u03b2", "gamma": "\u03b3", "delta": "\u03b4", "theta": "\u03b8",
    "kappa": "\u03ba", "lambda": "\u03bb", "mu": "\u03bc", "nu": "\u03bd", "xi": "\u03be", "eta": "\u03b7",
    "rho": "\u03c1", "sigma": "\u03c3", "tau": "\u03c4", "phi": "\u03c6", "chi": "\u03c7", "omega": "\u03c9",
    "pi": "\u03c0", "Lambda": "\u039b", "Delta": "\u0394",
}  # fmt: skip
FUNCTIONS = ("sin", "cos", "max", "dim")
SIGNS = {  # command: (plain, MathML)
    "sum": ("sum", "\u2211"), "partial": ("d", "\u2202"), "times": ("x", "\u00d7"), "in": ("in", "\u2208"),
    "equiv": ("==", "\u2261"), "ge": (">=", "\u2265"), "le": ("<=", "\u2264"), "ne": ("!=", "\u2260"),
    "pm": ("+-", "\u00b1"), "dots": ("...", "\u2026"), "cdots": ("...", "\u22ef"), "vdots": ("...", "\u22ee"),
    "ddots": ("...", "\u22f1"), "perp": ("perp", "\u22a5"),
}  # fmt: skip
SPACES = {"quad": "  ", ",": "", ";": " ", " ": " ", "thinspace": ""}
RELATIONS = {"+", "-", "=", "<", ">", "==", ">=", "<=", "!=", "in", "+-"}
ACCENTS = {"dot": ("'", "\u02d9"), "ddot": ("''", "\u00a8")}
STYLES = {"mathbf": "bold", "boldsymbol": "bold", "mathcal": "script", "mathbb": "double", "mathrm": ""}
SCRIPT_LETTERS = {"M": "\u2133", "P": "\U0001d4ab", "L": "\u2112"}
DOUBLE_LETTERS = {"R": "\u211d"}
BRACKETS = {"bmatrix": "[]", "pmatrix": "()", "matrix": ("", "")}
THIN = "<mspace width='0.17em'/>"
TOKEN = re.compile(r"\\([A-Za-z]+|.)|(\d+)|(\s+)|(.)", re.DOTALL)


class MathError(ContractError):
    """LaTeX that this module does not know."""


@dataclass(frozen=True)
class Leaf:
    """kind: name, number, sign, fence, function, word, space."""

    kind: str
    plain: str
    shown: str


@dataclass(frozen=True)
class Row:
    items: tuple["Node", ...]


@dataclass(frozen=True)
class Script:
    base: "Node"
    below: "Node | None"
    above: "Node | None"


@dataclass(frozen=True)
class Fraction:
    above: "Node"
    below: "Node"


@dataclass(frozen=True)
class Root:
    body: "Node"


@dataclass(frozen=True)
class Accent:
    mark: str
    body: "Node"


@dataclass(frozen=True)
class Matrix:
    kind: str
    rows: tuple[tuple["Node", ...], ...]


Node = Leaf | Row | Script | Fraction | Root | Accent | Matrix


class Reader:
    """Reads one formula; tokens are ("command", name), ("number", digits), ("sign", character)."""

    def __init__(self, text: str):
        marked, self.words = marked_words(text)
        self.text, self.place = text, 0
        self.tokens: list[tuple[str, str]] = []
        for command, digits, _, sign in TOKEN.findall(marked):
            if command:
                self.tokens.append(("command", command))
            elif digits:
                self.tokens.append(("number", digits))
            elif sign:
                self.tokens.append(("sign", sign))

    @classmethod
    def read(cls, text: str) -> Row:
        reader = cls(text)
        row = reader.row(())
        if reader.place < len(reader.tokens):
            raise reader.unknown(reader.tokens[reader.place])
        return row

    def unknown(self, token: object) -> MathError:
        return MathError(f"{token} in {self.text!r}")

    def next(self) -> tuple[str, str]:
        if self.place >= len(self.tokens):
            raise MathError(f"{self.text!r} ends too early")
        self.place += 1
        return self.tokens[self.place - 1]

    def ahead(self) -> tuple[str, str] | None:
        return self.tokens[self.place] if self.place < len(self.tokens) else None

    def row(self, ends: tuple[tuple[str, str], ...]) -> Row:
        """Up to one of `ends`, which is not taken."""
        items: list[Node] = []
        while (token := self.ahead()) is not None and token not in ends:
            if token in (("sign", "^"), ("sign", "_")):
                items.append(self.script(items.pop() if items else Row(())))
            else:
                items.append(self.item())
        return Row(tuple(items))

    def script(self, base: Node) -> Script:
        """With `_`, `^` or both, in either order, after base."""
        found = Script(base, None, None) if not isinstance(base, Script) else base
        _, sign = self.next()
        body = self.argument()
        return Script(found.base, *((body, found.above) if sign == "_" else (found.below, body)))

    def argument(self) -> Node:
        if self.ahead() == ("sign", "{"):
            self.next()
            body = self.row((("sign", "}"),))
            self.next()
            return body
        return self.item()

    def item(self) -> Node:
        kind, text = self.next()
        if kind == "number":
            return Leaf("number", text, text)
        if kind == "command":
            return self.command(text)
        if text == "{":
            self.place -= 1
            return self.argument()
        if text == "\x00":  # a word
            words = self.words.pop(0)
            return Leaf("word", words, words)
        if text.isalpha():
            return Leaf("name", text, text)
        if text in "+-=<>()[],;:./|*'?":
            return Leaf("sign", text, {"-": "\u2212", "*": "\u2217"}.get(text, text))
        raise self.unknown(text)

    def command(self, name: str) -> Node:
        if name in GREEK:
            return Leaf("name", name, GREEK[name])
        if name in FUNCTIONS:
            return Leaf("function", name, name)
        if name in SIGNS:
            return Leaf("sign", *SIGNS[name])
        if name in SPACES:
            return Leaf("space", SPACES[name], SPACES[name])
        if name in "{}":
            return Leaf("sign", name, name)
        if name == "frac":
            return Fraction(self.argument(), self.argument())
        if name == "sqrt":
            return Root(self.argument())
        if name in ACCENTS:
            return Accent(name, self.argument())
        if name in STYLES:
            return styled(self.argument(), STYLES[name])
        if name == "left":
            return self.fenced()
        if name == "begin":
            return self.matrix()
        raise self.unknown(name)

    def fenced(self) -> Row:
        r"""From \left( to \right): one row, so that scripts belong to all of it."""
        opening = self.item()
        inner = self.row((("command", "right"),))
        self.next()
        return Row((as_fence(opening), *inner.items, as_fence(self.item())))

    def matrix(self) -> Matrix:
        name = "".join(leaf.plain for leaf in self.argument().items)  # type: ignore[union-attr]
        if name not in BRACKETS:
            raise self.unknown(name)
        rows: list[list[Node]] = [[]]
        while True:
            rows[-1].append(self.row((("sign", "&"), ("command", "\\"), ("command", "end"))))
            token = self.next()
            if token == ("command", "\\"):
                rows.append([])
            elif token == ("command", "end"):
                self.argument()
                return Matrix(name, tuple(map(tuple, rows)))


def as_fence(node: Node) -> Node:
    """A bracket that grows with what it holds."""
    if not isinstance(node, Leaf):
        raise MathError(f"{node} is no bracket")
    return replace(node, kind="fence")


def marked_words(text: str) -> tuple[str, list[str]]:
    r"""The text with a mark for every \text{...}, and what stands in them."""
    return re.sub(r"\\text\{[^{}]*\}", "\x00", text), re.findall(r"\\text\{([^{}]*)\}", text)


def styled(node: Node, style: str) -> Node:
    match node:
        case Row(items):
            return Row(tuple(styled(item, style) for item in items))
        case Leaf("name" | "number", plain, shown):
            return Leaf("name", plain, letter(shown, style))
    return node


def letter(text: str, style: str) -> str:
    """A character of a mathematical alphabet."""
    if style == "script":
        return SCRIPT_LETTERS[text]
    if style == "double":
        return DOUBLE_LETTERS[text]
    if style != "bold" or len(text) > 1:
        return text
    if text in GREEK.values():
        return chr(0x1D6C2 + ord(text) - ord("\u03b1")) if text >= "\u03b1" else text
    start = {"0": 0x1D7CE, "a": 0x1D41A, "A": 0x1D400}
    first = "0" if text.isdigit() else "a" if text.islower() else "A"
    return chr(start[first] + ord(text) - ord(first))


# Plain text


def plain(latex: str) -> str:
    """Plain text of a formula, in one line."""
    return re.sub(r"\s+", " ", text_of(Reader.read(latex))).strip()


def text_of(node: Node) -> str:
    match node:
        case Leaf("sign", text, _) if text in RELATIONS:
            return f" {text} "
        case Leaf(_, text, _):
            return text
        case Row(items):
            return row_text(items)
        case Script(base, below, above):
            return text_of(base) + script_text("_", below) + script_text("^", above)
        case Fraction(above, below):
            return f"{as_factor(above)}/{as_factor(below)}"
        case Root(body):
            return f"sqrt({text_of(body).strip()})"
        case Accent(mark, body):
            return text_of(body) + ACCENTS[mark][0]
        case Matrix(kind, rows):
            opening, closing = BRACKETS[kind]
            inner = "; ".join(", ".join(text_of(cell).strip() for cell in row) for row in rows)
            return f"{opening or '['}{inner}{closing or ']'}"
    raise MathError(f"no text for {node}")


def row_text(items: tuple[Node, ...]) -> str:
    """Neighbours are set apart where one word would otherwise run into the next."""
    text = ""
    for place, item in enumerate(items):
        new = text_of(item)
        starts = place == 0 or text.rstrip()[-1:] in ("", "(", "[", ",", "{") or text.rstrip()[-1:] == "="
        if new in (" - ", " + ") and starts:
            new = new.strip()
        if text and new and needs_space(text, new):
            text += " "
        text += new
    return text


def needs_space(text: str, new: str) -> bool:
    before, after = text[-1], new[0]
    if before in ",:":
        return after != " "
    if after.isalnum():
        return before.isalnum() or before in ")]'}*"
    return after in "([{" and (before.isalnum() or before in "*'") and not text.endswith(FUNCTIONS)


def script_text(sign: str, body: Node | None) -> str:
    if body is None:
        return ""
    letters = [item.plain for item in body.items if isinstance(item, Leaf)] if isinstance(body, Row) else []
    if letters and len(letters) == len(body.items) and re.fullmatch(r"\w+", "".join(letters)):
        if all(len(part) == 1 for part in letters):
            return f"{sign}{''.join(letters)}"
    text = re.sub(r"\s*=\s*", "=", text_of(body).strip())
    return f"{sign}{text}" if re.fullmatch(r"-?[\w.*']+", text) else f"{sign}({text})"


def as_factor(node: Node) -> str:
    text = text_of(node).strip()
    return text if re.fullmatch(r"[\w.^*'()]+|\w+\([^()]*\)", text) else f"({text})"


# MathML


def mathml(latex: str, display: bool = False) -> str:
    """A <math> element."""
    kind = ' display="block"' if display else ""
    return f"<math{kind}>{markup(Reader.read(latex))}</math>"


def markup(node: Node) -> str:
    match node:
        case Leaf(kind, _, shown):
            return leaf_markup(kind, shown)
        case Row(items):
            return f"<mrow>{''.join(spaced(items))}</mrow>"
        case Script(Leaf("sign", "sum", _) as base, below, above):
            return scripts("munder", "mover", "munderover", base, below, above)
        case Script(base, below, above):
            return scripts("msub", "msup", "msubsup", base, below, above)
        case Fraction(above, below):
            return f"<mfrac>{markup(above)}{markup(below)}</mfrac>"
        case Root(body):
            return f"<msqrt>{markup(body)}</msqrt>"
        case Accent(mark, body):
            return f'<mover accent="true">{markup(body)}<mo>{ACCENTS[mark][1]}</mo></mover>'
        case Matrix(kind, rows):
            cells = "".join(f"<mtr>{''.join(f'<mtd>{markup(c)}</mtd>' for c in row)}</mtr>" for row in rows)
            opening, closing = BRACKETS[kind]
            return f"<mrow><mo>{opening}</mo><mtable>{cells}</mtable><mo>{closing}</mo></mrow>"
    raise MathError(f"no MathML for {node}")


def spaced(items: tuple[Node, ...]) -> Iterator[str]:
    """The items of a row, with thin spaces around names of functions."""
    for before, item in zip((None, *items), items, strict=False):
        if is_function(item):
            yield THIN * (before is not None and not is_bracket_or_sign(before)) + markup(item) + THIN
        else:
            yield markup(item)


def is_bracket_or_sign(node: Node) -> bool:
    return isinstance(node, Leaf) and node.kind in ("sign", "fence", "space")


def is_function(node: Node) -> bool:
    """A function's name, perhaps with an exponent; its argument follows."""
    base = node.base if isinstance(node, Script) else node
    return isinstance(base, Leaf) and base.kind == "function"


def leaf_markup(kind: str, shown: str) -> str:
    text = escape(shown)
    match kind:
        case "number":
            return f"<mn>{text}</mn>"
        case "name":
            return f"<mi>{text}</mi>"
        case "function":
            return f"<mi>{text}</mi>"
        case "fence":
            return f"<mo>{text}</mo>"
        case "word":
            return f"<mtext>{text}</mtext>"
        case "space":
            return f"<mspace width='{0.17 if not shown else 0.5 * len(shown)}em'/>"
    return f'<mo stretchy="false">{text}</mo>'


def scripts(under: str, over: str, both: str, base: Node, below: Node | None, above: Node | None) -> str:
    inner = markup(base)
    if below is None:
        return f"<{over}>{inner}{markup(above)}</{over}>"  # type: ignore[arg-type]
    if above is None:
        return f"<{under}>{inner}{markup(below)}</{under}>"
    return f"<{both}>{inner}{markup(below)}{markup(above)}</{both}>"


# Prose with formulas in it


def prose(text: str, formula: Callable[[str], str]) -> str:
    """Text in which every $...$ is replaced by formula(what stands between)."""
    return re.sub(r"\$([^$]*)\$", lambda found: formula(found[1]), text)
