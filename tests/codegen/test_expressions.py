"""The canonical form does not see how the data was ordered, signed or nested."""

import math
import random
from fractions import Fraction

import pytest
from toy import EXACT, PRIME, evaluate, exact

from codegen.expressions import Canonical, Order, to_json

NAMES = ["a", "b", "c", "nu_2", "nu_10"]


def random_expression(rng, depth=4, functions=("sin", "cos", "sqrt")):
    """Data of a random expression that is defined everywhere."""
    if depth == 0 or rng.random() < 0.1:
        return rng.choice([*NAMES, rng.randint(-3, 3), ["/", rng.randint(-5, 5), rng.randint(1, 6)]])
    kind = rng.choice(["+", "+", "*", "*", "^", *functions])
    if kind in "+*":
        return [kind, *(random_expression(rng, depth - 1, functions) for _ in range(rng.randint(2, 4)))]
    if kind == "^":
        positive = ["+", 1, ["^", random_expression(rng, depth - 1, functions), 2]]
        return ["^", positive, rng.choice([-2, -1, 2, 3])]
    return [kind, random_expression(rng, depth - 1, functions)]


def negative(data):
    """The same expression with the other sign, as another Maxima may print it."""
    match data:
        case int():
            return -data
        case ["/", p, q]:
            return ["/", -p, q]
        case ["+", *terms]:
            return ["+", *map(negative, terms)]
        case ["*", first, *rest]:
            return ["*", negative(first), *rest]
    return ["*", -1, data]


def rewritten(data, rng):
    """Another way to write the same expression: other order, signs and brackets."""
    if not isinstance(data, list) or data[0] == "/":
        return data
    head, *parts = data
    if head == "^":
        return ["^", rewritten(parts[0], rng), parts[1]]
    parts = [rewritten(part, rng) for part in parts]
    if head in "+*":
        rng.shuffle(parts)
        if len(parts) > 2 and rng.random() < 0.4:
            parts = [parts[0], [head, *parts[1:]]]
        if head == "+" and rng.random() < 0.4:
            return ["*", -1, ["+", *map(negative, parts)]]
        return [head, *parts]
    if head == "sin" and rng.random() < 0.4:
        return ["*", -1, ["sin", negative(parts[0])]]
    if head == "cos" and rng.random() < 0.4:
        return ["cos", negative(parts[0])]
    return [head, *parts]


@pytest.mark.parametrize("seed", range(60))
def test_order_signs_and_brackets_do_not_matter(seed):
    rng = random.Random(seed)
    data = random_expression(rng)
    canonical = Canonical(Order(rng.sample(NAMES, 3)))
    expected = to_json(canonical.read(data))
    for _ in range(5):
        assert to_json(canonical.read(rewritten(data, rng))) == expected
    assert to_json(canonical.read(expected)) == expected, "canonical form is its own canonical form"


@pytest.mark.parametrize("seed", range(60))
def test_values_stay(seed):
    rng = random.Random(seed)
    data = random_expression(rng, functions=("sin", "cos"))  # the exact stand-in for a root is none
    values = {name: rng.randrange(1, PRIME) for name in NAMES}

    def plain(d):
        """The data's value without any canonical form."""
        match d:
            case int():
                return d % PRIME
            case str():
                return values[d]
            case ["/", p, q]:
                return exact(Fraction(p, q))
            case ["+", *terms]:
                return sum(map(plain, terms)) % PRIME
            case ["*", *factors]:
                return math.prod(map(plain, factors)) % PRIME
            case ["^", base, k]:
                return pow(plain(base), k, PRIME)
            case [name, argument]:
                return EXACT[name](plain(argument)) % PRIME

    e = Canonical().read(data)
    assert evaluate(e, values.__getitem__) == plain(data)


@pytest.mark.parametrize("data", [1.5, None, True, [], ["+"], ["tan", "x"], ["^", "x", 0.5], ["/", 1, 0], {"a": 1}])
def test_what_is_no_expression_is_refused(data):
    with pytest.raises(ValueError, match="not an expression"):
        Canonical().read(data)
