"""Which contacts at rest stick and which slip: the complementarity problem of set-valued friction in the plane.

m contacts that do not slip take forces F_i, each from a disc or an ellipse: |F_i/reach_i| <= 1, where the division is
by components. Their slip velocities change at the rates s' = D F + a. A contact takes any such force while its slip
stays zero, and when it slips, the one that takes the most power: F_i . s_i' is least. With D symmetric and positive
these are the conditions of a minimum,

  F makes F^T D F/2 + a^T F least within the product of the discs,

which is strictly convex: there is one F, always.

It is found by going round the contacts, each solved exactly, until it is clear who slips; Newton's rule on the
conditions themselves gives the last digits.

A disc may be cut by a strip, |F_i1| <= strip_i: what stands behind such a contact takes no more in that direction. A
normal of the cut disc is the sum of a normal of the disc and one of the strip. So the rate has two parts: one along the
normal of the disc, and one across the strip.
"""

from dataclasses import dataclass

import numpy as np

SWEEPS, BETWEEN = 400, 8  # rounds over the contacts, and how many before each try of Newton's rule
NEWTON = 30
SETTLED = 1e-14
ON_THE_EDGE = 1e-7  # of the radius: contacts nearer to it may slip
INSIDE_ROUNDS, PRODUCTS_LEFT = 80, 1e-18  # from inside: at most so many rounds, and what they leave of p s
LEAST_SLACK = 1e-14  # of a disc: the rounds end there, since with less rounding hides how its force may turn
FALLS, FALLS_LESS, WHOLE = 0.1, 0.5, 0.5  # what a round leaves of p s; behind one of which less than WHOLE was made
STAYS_INSIDE = 0.9  # of the way to the edge of p > 0 and s > 0
STEADIES = 1e-14  # of the diagonal, more: keeps components that no rate depends on where they are
LEAST_SCALE = 1e-30  # of the problem's size
DRAWN, ROUNDS = 1e-6, 60  # of D's diagonal: how strongly forces that need not be unique are drawn, and how often
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Decided:
    """force (m, c), within the discs; pull (m,) >= 0: how strongly a contact slips, -s' . F/reach^2 along its disc.

    rate   (m, c) the rates of the slip velocities
    yields (m,) >= 0: how strongly what is behind the strip gives way, - s_1' F_1 without what the disc has of it; 0
           without strips
    """

    force: np.ndarray
    pull: np.ndarray
    rate: np.ndarray
    yields: np.ndarray | float = 0.0


def decide(
    matrix: np.ndarray,
    given: np.ndarray,
    reach: np.ndarray,
    near: np.ndarray | None = None,
    strip: np.ndarray | None = None,
) -> Decided:
    """The minimum above; `near` (m, c) are forces that are thought to be near it.

    matrix  (m, c, m, c) symmetric and positive: D, of contacts with c directions
    given   (m, c) a, the rates of the slip velocities without these forces
    reach   (m, c) positive, the half-axes of the ellipses
    strip   (m,) positive, the largest first components of the forces; None: the discs set their bounds
    """
    shape = given.shape
    width = _widths(strip, reach)
    scaled, wanted, unit = _of_unit_discs(matrix, given, reach)
    start = None if near is None else (near / reach).ravel()
    place = _minimum(scaled / unit, wanted / unit, shape, start, width)
    rate = ((scaled @ place + wanted) / reach.ravel()).reshape(shape)
    place = place.reshape(shape)
    pull = np.maximum(-(place * rate * reach).sum(axis=1), 0.0)
    return Decided(place * reach, pull, rate)


def _widths(strip: np.ndarray | None, reach: np.ndarray) -> np.ndarray | None:
    """(m,) of strips that cut unit discs, infinite where one is wider; None where there are none."""
    return None if strip is None else np.where(strip < reach[:, 0], strip / reach[:, 0], np.inf)


def _of_unit_discs(matrix: np.ndarray, given: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """The problem (m c, m c), (m c,) of unit discs, and its largest number."""
    size = given.size
    scaled = (matrix * reach[:, :, None, None] * reach).reshape(size, size)
    wanted = (given * reach).ravel()
    return scaled, wanted, max(float(np.abs(wanted).max()), float(np.abs(scaled).max()))


def decide_semidefinite(
    matrix: np.ndarray,
    given: np.ndarray,
    reach: np.ndarray,
    strip: np.ndarray | None = None,
    from_inside: bool = False,
) -> Decided:
    """The same where D is semidefinite: there is one rate, and forces that need not be unique.

    strip        (m,) positive, the largest first components of the forces; None: the discs set their bounds
    from_inside  whether the rounds begin at the minimum over discs as an interior-point method finds it: those of
                 contacts that are only just pulled would go on for thousands

    Rockafellar's proximal point: D with a small part of its diagonal more, and the forces drawn to those of the round
    before. Along what D feels the rounds converge as fast as that part is small; along what it does not feel they stay.
    Beside contacts, free rollers are so light that a part of the largest number would hide what D feels of them.
    """
    size = given.size
    part = DRAWN * np.diag(matrix.reshape(size, size)).reshape(given.shape)
    shifted = matrix + part[:, :, None, None] * np.eye(size).reshape(matrix.shape)
    force, near = np.zeros(given.shape), None
    if from_inside:
        scaled, wanted, unit = _of_unit_discs(matrix, given, reach)
        force = near = _from_inside(scaled / unit, wanted / unit, given.shape, _widths(strip, reach)) * reach
    for _ in range(ROUNDS):
        before = force
        near = force = decide(shifted, given - part * before, reach, near, strip).force
        if (np.abs(force - before) <= SETTLED * reach).all():
            break
    rate = np.tensordot(matrix, force, 2) + given
    if strip is not None:
        return _in_parts(force, rate, reach, strip)
    return Decided(force, np.maximum(-(force * rate).sum(axis=1), 0.0), rate)


def _in_parts(force: np.ndarray, rate: np.ndarray, reach: np.ndarray, strip: np.ndarray) -> Decided:
    """The two parts of what contacts do: along the disc, and across the strip where the force is at its edge."""
    place, weighted = force / reach, rate * reach
    at_edge = np.abs(force[:, 0]) >= strip * (1 - ON_THE_EDGE)
    on_disc = np.linalg.norm(place, axis=1) >= 1 - ON_THE_EDGE
    across = np.where(on_disc, -weighted[:, 1] / np.where(on_disc & at_edge, place[:, 1], 1.0), 0.0)  # in a corner
    along = np.where(at_edge, across, -(place * weighted).sum(axis=1))
    yields = -place[:, 0] * weighted[:, 0] - along * place[:, 0] ** 2
    return Decided(force, np.maximum(along, 0.0), rate, np.where(at_edge, np.maximum(yields, 0.0), 0.0))


def residuals(found: Decided, given: np.ndarray, reach: np.ndarray) -> tuple[float, float, float]:
    """How far a solution is from the law: cone, complementarity, most power; relative to what the forces do.

    A force may leave its ellipse by no part of it; it lies inside only where its contact does not slip; and where one
    slips, no force of the ellipse takes more power.
    """
    place = found.force / reach
    size = np.linalg.norm(place, axis=1)
    weighted = found.rate * reach
    moving = np.linalg.norm(weighted, axis=1)
    whole = float((np.abs(weighted) + np.abs(given * reach)).max())
    beyond = float(np.maximum(size - 1, 0).max())
    inside = float((moving * np.maximum(1 - size, 0)).max()) / whole
    less = float(np.abs(moving + (weighted * place).sum(axis=1)).max()) / whole
    return beyond, inside, less


def _from_inside(
    matrix: np.ndarray, wanted: np.ndarray, shape: tuple[int, int], strip: np.ndarray | None = None
) -> np.ndarray:
    """(m, c) the minimum over unit discs, cut by strips (m,), by an interior-point method: with slacks
    s = (1 - y^T W y)/2 of discs and strips and pulls p, matrix y + wanted = - sum p W y, and the products p s fall
    together. Of forces that are not unique it finds such as are amid all that balance."""
    count, width = shape
    owner, weights = np.arange(count), np.ones(shape)
    if strip is not None:
        cut = np.flatnonzero(np.isfinite(strip))
        of_strips = np.zeros((len(cut), width))
        of_strips[:, 0] = 1 / strip[cut] ** 2
        owner, weights = np.append(owner, cut), np.concatenate([weights, of_strips])
    blocks = np.arange(count * width).reshape(shape)
    sizes = np.abs(wanted) + np.abs(matrix).sum(axis=1)
    scale = np.maximum(sizes.reshape(shape).max(axis=1), LEAST_SCALE)[owner]
    steadies = STEADIES * np.maximum(np.diag(matrix), LEAST_SCALE)
    place, pull, slack, falls = np.zeros(shape), scale.copy(), np.full(len(owner), 0.5), FALLS

    def of_contacts(values: np.ndarray) -> np.ndarray:
        found = np.zeros(shape)
        np.add.at(found, owner, values)
        return found

    for _ in range(INSIDE_ROUNDS):
        left = float((pull * slack / scale).mean())
        if not (left > PRODUCTS_LEFT and slack.min() > LEAST_SLACK):
            break
        normal = weights * place[owner]
        aim, off = falls * left * scale, slack + ((normal * place[owner]).sum(axis=1) - 1) / 2
        along = (aim + pull * off) / slack - pull
        system = matrix + np.diag(of_contacts(pull[:, None] * weights).ravel() + steadies)
        own = blocks[owner]
        curves = np.einsum("k,ki,kj->kij", pull / slack, normal, normal)
        np.add.at(system, (own[:, :, None], own[:, None, :]), curves)
        right = -(matrix @ place.ravel() + wanted) - of_contacts((pull + along)[:, None] * normal).ravel()
        unit = 1 / np.sqrt(np.diag(system))
        step = (unit * np.linalg.solve(unit[:, None] * system * unit, unit * right)).reshape(shape)
        slacks = -off - (normal * step[owner]).sum(axis=1)
        pulls = (aim - pull * (slack + slacks)) / slack
        part = 1.0
        for value, change in ((slack, slacks), (pull, pulls)):
            falling = change < 0
            part = min(part, float((-STAYS_INSIDE * value[falling] / change[falling]).min(initial=1.0)))
        place, slack, pull = place + part * step, slack + part * slacks, pull + part * pulls
        falls = FALLS if part > WHOLE else FALLS_LESS
    bound = pull > slack * scale
    place = place / np.where(bound[:count], np.linalg.norm(place, axis=1), 1.0)[:, None]
    edges = owner[count:][bound[count:]]
    if len(edges):
        place[edges, 0] = np.copysign(strip[edges], place[edges, 0])
    return place


def _minimum(
    matrix: np.ndarray,
    wanted: np.ndarray,
    shape: tuple[int, int],
    start: np.ndarray | None = None,
    strip: np.ndarray | None = None,
) -> np.ndarray:
    """(m c,) the minimum over unit discs, cut by strips (m,); `start` (m c,) is thought to be near it."""
    if start is not None and (found := _polished(matrix, wanted, start, shape, strip)) is not None:
        return found
    count, width = shape
    blocks = [slice(k * width, (k + 1) * width) for k in range(count)]
    place = np.zeros(count * width)
    for sweep in range(1, SWEEPS + 1):
        before = place.copy()
        for k, own in enumerate(blocks):
            rest = wanted[own] + matrix[own] @ place - matrix[own, own] @ place[own]
            place[own] = _one_disc(matrix[own, own], rest)
            if strip is not None and abs(place[own.start]) > strip[k]:
                place[own] = _on_edge(matrix[own, own], rest, np.copysign(strip[k], place[own.start]))
        settled = np.abs(place - before).max() <= SETTLED
        if settled or sweep % BETWEEN == 0:
            polished = _polished(matrix, wanted, place, shape, strip)
            if polished is not None:
                return polished
        if settled:
            break
    return place


def _one_disc(matrix: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The g (c,) with |g| <= 1 for which g^T matrix g/2 + wanted . g is least.

    Inside, or on the circle, where (matrix + pull) g = -wanted for the pull >= 0 with |g| = 1: Newton's rule on 1/|g|,
    which is concave in the pull and nearly linear (Hebden).
    """
    values, axes = np.linalg.eigh(matrix)
    along = axes.T @ wanted
    place = -along / values
    pull = 0.0
    if place @ place > 1:
        for _ in range(NEWTON):
            shifted = values + pull
            size = np.sqrt(((along / shifted) ** 2).sum())
            step = (size - 1) * size**2 / ((along**2 / shifted**3).sum())
            pull += step
            if abs(step) <= EPS * (pull + values[0]):
                break
        place = -along / (values + pull)
        place /= np.sqrt(place @ place)
    return axes @ place


def _on_edge(matrix: np.ndarray, wanted: np.ndarray, edge: float) -> np.ndarray:
    """The same where the first of two components is `edge`, since the minimum over the disc lies beyond that."""
    most = np.sqrt((1 - edge) * (1 + edge))
    return np.array([edge, np.clip(-(wanted[1] + matrix[1, 0] * edge) / matrix[1, 1], -most, most)])


def _polished(
    matrix: np.ndarray,
    wanted: np.ndarray,
    place: np.ndarray,
    shape: tuple[int, int],
    strip: np.ndarray | None = None,
) -> np.ndarray | None:
    """The minimum by Newton's rule, from those that slip at `place` on, and those at the edges of their strips; None
    where that does not lead to it."""
    disc = place.reshape(shape)
    pull = -(disc * (matrix @ place + wanted).reshape(shape)).sum(axis=1)
    slips = (np.linalg.norm(disc, axis=1) >= 1 - ON_THE_EDGE) & (pull > 0)
    strip = np.full(shape[0], np.inf) if strip is None else strip
    edges = np.where(np.abs(disc[:, 0]) >= strip * (1 - ON_THE_EDGE), np.sign(disc[:, 0]), 0.0)
    for _ in range(2 * shape[0] * (1 if np.isinf(strip).all() else 2)):
        place = _at_edges(place, edges, strip, shape)
        found, pull, exact = _with_slipping(matrix, wanted, place, np.flatnonzero(slips), shape, edges != 0)
        if not exact:
            return None
        disc = found.reshape(shape)
        length = np.linalg.norm(disc, axis=1)
        wrong = np.where(slips, pull < 0, length > 1 + 4 * EPS)
        given_way = -edges * ((matrix @ found + wanted).reshape(shape) + pull[:, None] * disc)[:, 0]
        beyond = np.where(edges != 0, given_way < 0, np.abs(disc[:, 0]) > strip * (1 + 4 * EPS))
        if not (wrong.any() or beyond.any()):
            return (disc / np.maximum(length, 1.0)[:, None]).ravel()
        slips = slips ^ wrong
        edges = np.where(beyond, np.where(edges != 0, 0.0, np.sign(disc[:, 0])), edges)
    return None


def _at_edges(place: np.ndarray, edges: np.ndarray, strip: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(m c,) with the first components of those at edges (m,), +-1 or 0, put there."""
    if not edges.any():
        return place
    found, at = place.reshape(shape).copy(), edges != 0
    found[at, 0] = edges[at] * strip[at]
    return found.ravel()


def _with_slipping(
    matrix: np.ndarray,
    wanted: np.ndarray,
    place: np.ndarray,
    slipping: np.ndarray,
    shape: tuple[int, int],
    at_edge: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Newton's rule on the conditions where `slipping` are on their circles, and those `at_edge` (m,) bool keep their
    first components: forces, pulls, whether it ended."""
    (count, width), size = shape, len(place)
    disc, pull = place.reshape(shape), np.zeros(count)
    pull[slipping] = -(disc * (matrix @ place + wanted).reshape(shape)).sum(axis=1)[slipping]
    place, last, kept = place.copy(), np.inf, width * np.flatnonzero(at_edge)
    for _ in range(NEWTON):
        disc = place.reshape(shape)
        missing = matrix @ place + wanted + (pull[:, None] * disc).ravel()
        missing[kept] = 0.0
        over = ((disc**2).sum(axis=1)[slipping] - 1) / 2
        system = np.zeros((size + len(slipping),) * 2)
        system[:size, :size] = matrix + np.diag(np.repeat(pull, width))
        for k, contact in enumerate(slipping):
            own = slice(contact * width, (contact + 1) * width)
            system[own, size + k] = system[size + k, own] = place[own]
        system[kept] = 0.0
        system[kept, kept] = 1.0
        try:
            step = np.linalg.solve(system, np.concatenate([missing, over]))
        except np.linalg.LinAlgError:  # where a strip is as wide as its disc, edge and circle are one
            return place, pull, False
        place, change = place - step[:size], float(np.abs(step).max())
        pull[slipping] -= step[size:]
        if not np.isfinite(change) or change <= SETTLED or (change >= last and change < ON_THE_EDGE):
            break
        last = change
    return place, pull, change < ON_THE_EDGE
