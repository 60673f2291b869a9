"""Every proof of maxima/ can fail: one changed sign in what it claims stops it, by its own name.

The derivation runs once as it is. Then each proof is asked again with one sign flipped, in the same Maxima. A proof
inside a function is asked through the function, with the flip in the function's text. A claim that has no sign of its
own is asked with a flip in a definition before it, in the same chapter; one that holds whatever the signs are (no
coefficient depends on a free roller's angle, say) is asked in a wrong form.

A question that fails says nothing where it fails with no sign flipped, too: it is asked behind the whole derivation,
where names may have other values than at its place. So each is asked unchanged as well, and must hold then.

`python tests/flips.py` asks all of them, in some minutes; the tests ask those of maxima/paper/.
"""

import itertools
import json
import re
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from codegen.maxima import Maxima  # noqa: E402

FLIPS = 8  # flips of one proof that are tried before it counts as one that cannot fail

VEHICLE = 'prove_vehicle(1, 3, append(by_half(psi_1, 1/2), [ride_curve_1 = 0, ride_slope_1 = 0, ride_1 = l]), "")'
# How to ask a proof that stands in a function; functions that only pass a claim on have none of their own.
CALLS = {
    "prove_vehicle": VEHICLE,
    "prove_reduced": VEHICLE,
    "sum_over_rows": "sum_over_rows(subst(phi_dot = 0, twice_energy_roller))",
    "sum_of_omega": "map(sum_over_free_with_omega, free_reduced_force)",
    "sum_of_torque": 'yaw_momentum_rate("free")',
    "prove_vehicle_functions": 'prove_vehicle_functions("free")',
    "prove_system": 'prove_impacts("locked")',
    "prove_folded": 'prove_impacts("locked")',
    "prove_held_accelerations": 'prove_held_accelerations("free")',
    "prove_stuck_accelerations": 'prove_stuck_accelerations("free")',
    "prove_accelerations": 'prove_accelerations("free")',
    "prove_sharp_functions": 'prove_sharp_functions("locked")',
    "prove_sharp_holding": 'prove_sharp_holding("locked")',
    "prove_sharp_accelerations": 'prove_sharp_accelerations("free")',
    "prove_impacts": 'prove_impacts("free")',
    "prove_free_functions": 'prove_free_functions("free")',
    "prove_powers": 'prove_powers("free")',
    "prove_contact_loss": 'prove_contact_loss("locked")',
    "prove_free_friction": 'prove_free_friction("free")',
    "prove_effects": 'prove_effects("free")',
    "prove_free_decay": 'prove_free_decay("free")',
    "prove_slope_rule": "prove_slope_rule(axle_slip, axle_slip_steps, wheel_rate)",
    "prove_sharp_derivatives": 'prove_sharp_derivatives("locked")',
    "prove_derivatives": 'prove_derivatives("locked")',
    "prove_momenta_derivatives": 'prove_momenta_derivatives("free")',
    "prove_residual": 'prove_residual("free")',
    "prove_own": 'prove_own("free")',
    "prove_seen": 'prove_seen("locked")',
    "prove_lengths": 'prove_lengths("locked")',
    "prove_asking": 'prove_asking("locked")',
    "prove_impact": 'prove_impact("locked")',
    "prove_answers": 'prove_answers("answers folded along", "nu_dot_by_chi")',
    "prove_slip": 'prove_slip("free")',
    "prove_ground": 'prove_ground("free")',
    "prove_slip_rollers": 'prove_slip_rollers("free")',
    "prove_few": 'block([g_row_: first(row_names)], prove_few("massless", append(turn_steps[1], turn_steps[2]), J, '
    "0, 0))",
    "prove_standing": 'prove_standing("free", inertia_3, of_mecanum(\'standing_axial_row))',
    "prove_prepare": 'prove_prepare("prepare, four wheels")',
}
# Claims that hold whatever the signs are, asked of the wrong thing.
WRONG = {
    "sum of sines": "sum_over_rollers(1 + sin(chi + kappa))",
    "energy, platform": "[nu_1, -nu_2, nu_3, nu_s] . force_parts[1]",
    "brackets of the free rollers": "row(brackets_of(append(rest(P, -1), [p_phi_s*phi_s]), P), 4)",
    "{P, L*}, platform and free rollers' equations": "second(PL_parts)",
    "parts of the energy": "[gradient(T_platform, of_wheels), gradient(T_wheel, of_wheels)]",
    "parts of M*": "[col(Mstar_parts[1], 4), col(Mstar_parts[3], 4)]",
    "gyroscopic terms do no work": "map(lambda([g], [nu_1, nu_2, -nu_3, nu_s] . g), gyroscopic_parts)",
    "locked free rollers": "first_three(third(force_parts))",
    "ideal constraints": "on_constraints(dot(ground_force, velocity_on_platform(wheel_place)))",
    "moving point of reference": "level(cross(velocity_S, velocity_at(center) + vertical))",
    "sticking contact, slip": "subst([wheel_rate = chi_dot_of_nu, axial = contact_axial, "
    "wheel_acceleration = -time_derivative(chi_dot_of_nu), axial_acceleration = time_derivative(contact_axial)], "
    "slip_accelerations)",
    "slip, load balance, linear": "map(lambda([rate], diff(rest(slip_load_sums, -1), rate)), slip_speed_rates)",
    "loads of equal springs": "subst(first(solve(makelist(lsum(spring_change[k]*append([1], spring_places[k])[m], "
    "k, [1, 2, 3, 4]), m, 1, 3), rest(spring_change, -1))), "
    "lsum(spring_load(spring_places[k])^2*spring_change[k], k, [1, 2, 3, 4]))",
    "roller that sticks, slip, steps": "in_paper_symbols(in_ground_symbols(subst([contact_sticks = 1, "
    "axial = -yaw_rate_of_nu*sin(chi)], meaning(slip_rate_axle, append(slip_known, disk_turn_steps, "
    "disk_contact_steps, bearing_slip_rate_steps), []))) - psubst(rho_rules, axle_row . nu_dot))",
    "massless roller, speeds, steps": "subst(contact_sticks = 1, meaning(slip_axle + rho*rolling, in_series, [])) "
    "+ by_rho(axle_speed_of_nu)",
    "springs, plane": "map(lambda([v], diff(psubst(run(append(beside_steps, compression_steps), []), compression), "
    "v)), [place_1, place_2])",
    "sliding force, slope": "map(lambda([row], row . reverse(direction_of_slip)), sliding_slope)",
    "impact impulse, free": "impulse_of(free_impact_steps) - impact_wheel_impulse",
    "forward_dynamics": '(run_function("free", "forward_dynamics"), system_of(-output("nu_dot", 3)))',
    "forward_dynamics_derivatives": '(run_derivatives("free", "forward_dynamics_derivatives"), '
    'system_of(-output("nu_dot", 3)))',
    "U^T D U nu' = U^T D t + f": '(run_derivatives("locked", "forward_dynamics_derivatives_sharp"), '
    'folded_of(-output("nu_dot", 3)))',
    "accelerations": '(run_function("free", "accelerations"), system_of(-output("nu_dot", 3)))',
    "forward_dynamics_sharp": '(run_function("free", "forward_dynamics_sharp"), folded_of(-output("nu_dot", 3)))',
    "rate at a switch": "[diff(any_wheel['wheel_row], chi)]",
    "numbers of a kind": "psubst(run(kind_steps, [l_i = 2*l, r_i = r, n_i = n, B_i = B, weightless = 0, row_aside_i = "
    "0]), R_over_l_i) - psubst(run(append(vehicle_steps, tip_steps), []), R_over_l)",
    "springs, squares of a wheel": "map(lambda([v], diff(tilted_wheel, v)), rises_of_tilt)",
    "wheel that turns, on the ground": "psubst(run(append(load_share_steps, shared_forces_steps), "
    "[stands = 1, turns = 0]), [next_share, both_axle, both_rolling, beside_axle, beside_rolling])",
    "accelerations_sharp": '(run_function("free", "accelerations_sharp"), folded_of(-output("nu_dot", 3)))',
}
# Names that a later chapter takes for something else, as the chapter's own questions have them.
AS_THERE = {
    "effects/mecanum_wheels": "one_row: [second(wheels_of_the_paper)]",
    "effects/contact_mecanum": "one_row: [second(wheels_of_the_paper)]",
}
# What they ask takes long: one vehicle is asked.
WITHOUT_THEIR_LOOPS = ("machinery/write_data", "paper/brute_force", "paper/brute_force_wheels")
OMNI_WHEELS = "paper/omni_wheels"  # from there on wheels are the paper's
PASS_ON = {
    "prove", "prove_steps", "prove_exact", "prove_whole", "prove_of_slip", "prove_mecanum", "prove_round_mecanum",
    "prove_in_frame", "prove_of_frame",
}  # fmt: skip
PROOF = re.compile(r"\bprove(?:_steps|_exact|_whole|_mecanum|_round_mecanum|_in_frame|_of_frame)?\(")
OF_DERIVED = re.compile(r"\bprove_(?:(?:round_)?mecanum|of_frame)\($")
MACHINERY = ("claims", "steps", "effects", "tangents", "lagrange", "equations", "latex", "write_data")
NOT_DERIVED = {f"machinery/{name}" for name in MACHINERY}  # chapters without a claim


def chapters() -> list[str]:
    listed = (ROOT / "maxima/derive.mac").read_text().split("derivation_steps:")[1].split("]$")[0]
    return re.findall(r'^\s*"([\w/]+)"', listed, re.MULTILINE)


def chapters_of_any_wheel() -> list[str]:
    """Those of the paper's steps that are read before the wheels become the paper's."""
    return list(itertools.takewhile(lambda name: name != OMNI_WHEELS, chapters()))


def masked(text: str) -> str:
    """The text with comments and strings blanked out, of the same length."""
    return re.sub(r'/\*.*?\*/|"(?:\\.|[^"\\])*"', lambda found: " " * len(found[0]), text, flags=re.DOTALL)


def statements(text: str) -> list[tuple[str, str]]:
    """(statement, the same masked), without the final $."""
    cover, found, start = masked(text), [], 0
    for end in [m.start() for m in re.finditer(r"\$", cover)]:
        found.append((text[start:end], cover[start:end]))
        start = end + 1
    return found


def claims(statement: str, cover: str) -> list[tuple[str, int, int]]:
    """(proof's name, where its text starts and ends) for each proof of a statement."""
    found = []
    for call in PROOF.finditer(cover):
        depth, end = 0, call.end() - 1
        while True:
            depth += {"(": 1, ")": -1}.get(cover[end], 0)
            if depth == 0:
                break
            end += 1
        name = re.search(r'"((?:\\.|[^"\\])*)"', statement[call.start() : end])
        if name:
            found.append((name[1], call.end(), end))
    return found


def flips(statement: str, cover: str, start: int, end: int) -> list[str]:
    """The statement with one sign of the claim flipped, the last first: what is subtracted stands at the end."""
    places = [k for k in range(start, end) if cover[k] in "+-" and not re.match(r"[-+]\s*>", cover[k : k + 2])]
    places = places[::-1][:FLIPS]
    return [statement[:k] + {"+": "-", "-": "+"}[statement[k]] + statement[k + 1 :] for k in places]


def negated(statement: str, cover: str, start: int, end: int) -> str:
    """The statement with the sign of its claim's last argument flipped: what was derived."""
    depth, last = 0, start
    for k in range(start, end):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(cover[k], 0)
        last = k + 1 if depth == 0 and cover[k] == "," else last
    return f"{statement[:last]} -({statement[last:end]}){statement[end:]}"


def in_place_of(claim: str, original: str) -> str:
    """Evaluate the mutated text, then the original one, and fail if the first did."""
    return f"block([m_: errcatch({claim})], {original}, if m_ = [] then error(second(error)))"


def upstream(before: list[tuple[str, str]], claim: str) -> list[tuple[str, str]]:
    """Ways to ask a claim with one sign flipped in a definition before it, each with the same unchanged: in the nearest
    first, and in those that the claim does not name, nor what it names, last."""
    rests_on, others, used = [], [], set(re.findall(r"\w+", masked(claim)))
    for k in range(len(before) - 1, -1, -1):
        statement, cover = before[k]
        if "prove" in cover:
            continue
        is_used = not used.isdisjoint(re.findall(r"^\s*(\w+)", cover))
        if is_used:
            used |= set(re.findall(r"\w+", cover))
        rest = ", ".join(text for text, shown in before[k:] if "prove" not in shown)
        later = "".join(f", {text}" for text, shown in before[k + 1 :] if "prove" not in shown)
        plain, *own = [
            in_place_of(f"({text}{later}, {claim})", f"({rest})")
            for text in (statement, *flips(statement, cover, 0, len(cover)))
        ]
        (rests_on if is_used else others).extend((question, plain) for question in own)
    return (rests_on + others)[: 4 * FLIPS]


def questions(read: list[str]) -> list[tuple[str, list[tuple[str, str]]]]:
    """(name of the proof, ways to ask it with one change each, and without it) of chapters."""
    asked = []
    for chapter in read:
        if chapter in NOT_DERIVED:
            continue
        before: list[tuple[str, str]] = []
        for statement, cover in statements((ROOT / f"maxima/{chapter}.mac").read_text()):
            defined = re.match(r"\s*(\w+)\([^()]*\)\s*:=", cover)
            for name, start, end in claims(statement, cover) if not defined or defined[1] not in PASS_ON else []:
                mutants = flips(statement, cover, start, end)
                mutants += [negated(statement, cover, start, end)] if OF_DERIVED.search(cover[:start]) else []
                if name in WRONG:
                    ways = [(f'prove("{name}", "asked of the wrong thing", {WRONG[name]})', "true")]
                elif defined:
                    call = CALLS.get(defined[1])
                    assert call, f"{chapter}: no way to ask the proof in {defined[1]}; add it to CALLS"
                    plain, *mutants = [in_place_of(f"({text}, {call})", statement) for text in (statement, *mutants)]
                    ways = [(mutant, plain) for mutant in mutants]
                else:
                    ways = [(mutant, statement) for mutant in mutants] + upstream(before, statement)
                asked.append((name, [tuple(as_there(text, chapter, before) for text in way) for way in ways]))
            before.append((statement, cover))
    return asked


def as_there(question: str, chapter: str, before: list[tuple[str, str]]) -> str:
    """The question with the names and the assumptions that its place in the chapter has, behind these statements."""
    kept = [re.match(r"\s*(assume|forget)\((.*)\)\s*$", cover, re.DOTALL) for _, cover in before]
    last = next((found for found in reversed(kept) if found), None)
    if last and last[1] == "assume":
        assumed = f"[r_: (assume({last[2]}), errcatch({question}))], forget({last[2]})"
        question = f"block({assumed}, if r_ = [] then error(second(error)))"
    return f"block([{AS_THERE[chapter]}], {question})" if chapter in AS_THERE else question


def cannot_fail(read: list[str], folder: Path, unasked: Sequence[str] = ()) -> tuple[int, list[str]]:
    """How many proofs the chapters have, without those unasked, and those that no change stops."""
    asked = questions([chapter for chapter in read if chapter not in unasked])
    lines = [f'load("{ROOT}/maxima/{chapter}.mac")$' for chapter in read if chapter not in WITHOUT_THEIR_LOOPS]
    lines.append("group(name, steps) := [['group, name, steps]]$")  # a changed group is no other group of its name
    for number, (_, ways) in enumerate(asked):
        for turn, (mutant, plain) in enumerate(ways):  # in files of their own: what is not asked any more is not read
            question, unchanged = (folder / f"{kind}-{number}-{turn}.mac" for kind in ("question", "unchanged"))
            question.write_text(f"{mutant}$")
            unchanged.write_text(f"{plain}$")
            lines.append(
                f'if caught_[{number}] # true and errcatch(load("{question}")) = [] '
                f'and errcatch(load("{unchanged}")) # [] then caught_[{number}]: true$'
            )
    lines.append(
        f'block([s_: openw(output_file)], printf(s_, "[~a]", simplode(makelist(if caught_[k_] = true '
        f'then "1" else "0", k_, 0, {len(asked) - 1}), ",")), close(s_))$'
    )
    script, output = folder / "mutants.mac", folder / "caught.json"
    script.write_text("\n".join(lines))
    Maxima.find(lambda line: None).derive(script, output, lambda line: None)
    caught = json.loads(output.read_text())
    return len(asked), [name for (name, _), hit in zip(asked, caught, strict=True) if not hit]


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        count, missed = cannot_fail(chapters_of_any_wheel(), Path(folder))
        more, also_missed = cannot_fail(chapters(), Path(folder), unasked=chapters_of_any_wheel())
    missed += also_missed
    print(f"{count + more} proofs, {len(missed)} that no changed sign stops", *missed, sep="\n")
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
