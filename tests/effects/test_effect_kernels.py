"""The kernels with effects against the multiplier oracle, both in 60 digits: Lagrange's equations in all coordinates,
with the torques, the friction and the gravity of the effects as generalised forces, wheels anywhere, the centre of mass
beside S.

The generated Python kernel runs on balls unchanged, so that what is compared is the derivation itself, not its
rounding.
"""

import numpy as np
import pytest
from effects.cases import MODELS, OPTIONAL, ROLLERS, WHEELS, balls, prepared_kernel, random_case, without_layout
from oracle import lagrange
from oracle.balls import exact, working_precision

from omniroll.kernels.kernel import form

CLOSE = 1e-40


def friction(viscous, coulomb, fade, speed):
    return -viscous * speed - coulomb * speed / (speed * speed + fade * fade).sqrt()


@working_precision
def applied_forces(vehicle, nu, chi, spins, model, effects, numbers):
    """The generalised forces in the full coordinates, written down body by body."""
    present = lambda effect, name: balls(numbers[name]) if effect in effects else balls(np.zeros(WHEELS))  # noqa: E731
    theta = exact(numbers["heading"])
    speeds = lagrange.speeds(vehicle, nu, chi, spins, model="locked" if model == "massless" else model, theta=theta)
    forces = lagrange.Speeds.zero(vehicle)
    torque, damping = present("drive", "torque"), present("motor", "damping")
    bearing, contact_bearing = present("axle_sticking", "bearing_torque"), present("roller_sticking", "contact_bearing")
    free_bearing = present("roller_sticking", "free_bearing") if "roller_sticking" in effects else None
    for i, rate in enumerate(speeds.chi):
        forces.chi[i] = torque[i] + bearing[i] - damping[i] * rate + friction(
            present("axle_viscous", "axle_damping")[i], present("axle_coulomb", "axle_torque")[i],
            exact(numbers["axle_fade_speed"]), rate)  # fmt: skip
        for j, spin in enumerate(speeds.phi[i]):
            forces.phi[i][j] = friction(
                present("roller_viscous", "roller_damping")[i], present("roller_coulomb", "roller_torque")[i],
                exact(numbers["roller_fade_speed"]), spin)  # fmt: skip
            if j == 0:
                forces.phi[i][j] += contact_bearing[i]
            elif free_bearing is not None:
                forces.phi[i][j] += free_bearing[i][j - 1]
    if "slope" in effects:
        weight = vehicle.number("mass") * exact(numbers["gravity"]) * exact(numbers["slope_angle"]).sin()
        direction = exact(numbers["slope_direction"])
        forces.x, forces.y = weight * direction.cos(), weight * direction.sin()
        dx, dy = lagrange.offset_in_fixed_axes(vehicle, theta)
        forces.theta = dx * forces.y - dy * forces.x
    return forces


@working_precision
def found_accelerations(vehicle, nu, chi, spins, model, effects, numbers):
    base = model.removesuffix("_sharp")
    module, constants = prepared_kernel(vehicle, base, effects, numbers)
    asked = {"drive": "torque", "motor": "damping", "axle_sticking": "bearing_torque",
             "roller_sticking": "contact_bearing", "slope": "heading"}  # fmt: skip
    inputs = [balls(numbers[name]) for effect, name in asked.items() if effect in effects]
    if base == "free" and "roller_sticking" in effects:
        inputs.append(balls(numbers["free_bearing"]))
    spins = [balls(spins)] if base == "free" else []
    name = "accelerations" if base == "free" else "forward_dynamics"
    found = getattr(module, form(name, base != model, vars(module)))(constants, balls(nu), balls(chi), *spins, *inputs)
    return (found[0], found[1]) if base == "free" else (found, [])


def flat(values):
    return [v for value in values for v in (flat(value) if isinstance(value, list) else [value])]


def oracle_accelerations(vehicle, state, base, effects, numbers):
    """nu' and the free rollers' spins' by Lagrange's equations with multipliers, one after the other."""
    nu, chi, spins = state
    spins = spins if base == "free" else None
    forces = applied_forces(vehicle, nu, chi, spins, base, effects, numbers)
    model = base
    if base == "massless":  # the oracle drops a massless roller: ask it for one that hardly has inertia
        vehicle, model = vehicle.with_(roller_inertia=exact("1e-60")), "locked"
    wanted = lagrange.accelerations(vehicle, nu, chi, spins, model=model, theta=numbers["heading"], forces=forces)
    return wanted.nu_dot + ([s for wheel in wanted.spins_dot for s in wheel] if base == "free" else [])


def check(vehicle, state, model, effects, numbers):
    base = model.removesuffix("_sharp")
    nu, chi, spins = state
    expected = oracle_accelerations(vehicle, state, base, effects, numbers)
    nu_dot, spins_dot = found_accelerations(
        vehicle, nu, chi, spins if base == "free" else None, model, effects, numbers
    )
    for got, want in zip(flat(nu_dot) + flat(spins_dot), expected, strict=True):
        assert abs(float(got - want)) <= CLOSE * (1 + abs(float(want)))


@pytest.mark.parametrize("model", ["massless", "locked", "free", "locked_sharp", "free_sharp"])
def test_all_effects_together(model):
    rng = np.random.default_rng(5)
    vehicle, state, numbers = random_case(rng)
    check(vehicle, state, model, OPTIONAL, numbers)


@pytest.mark.parametrize("effects, model", [
    *(((effect,), MODELS[k % 3]) for k, effect in enumerate(OPTIONAL) if effect != "motor"),
    (("drive", "motor"), "free"), (("layout",), "free"), (("slope",), "locked"),
])  # fmt: skip
def test_each_effect_alone(effects, model):
    rng = np.random.default_rng([7, OPTIONAL.index(effects[-1])])
    vehicle, state, numbers = random_case(rng)
    if "layout" not in effects:
        vehicle = without_layout(vehicle)
    check(vehicle, state, model, effects, numbers)


@working_precision
def test_powers_are_the_work_of_the_forces():
    """nu . (force of the effects) = drive power - losses, the friction of the contact rollers among them."""
    rng = np.random.default_rng(13)
    vehicle, (nu, chi, _), numbers = random_case(rng)
    effects = tuple(e for e in OPTIONAL if e != "slope")
    module, constants = prepared_kernel(vehicle, "locked", effects, numbers)
    bare, bare_constants = prepared_kernel(vehicle, "locked", ("layout",), numbers)
    nu_, chi_, torque, damping = balls(nu), balls(chi), balls(numbers["torque"]), balls(numbers["damping"])
    bearing, of_rollers = balls(numbers["bearing_torque"]), balls(numbers["contact_bearing"])
    with_effects = module.forces(constants, nu_, chi_, torque, damping, bearing, of_rollers)
    without = bare.forces(bare_constants, nu_, chi_)
    power = sum((a - b) * v for a, b, v in zip(with_effects, without, nu_, strict=True))
    told = module.drive_power(constants, nu_, torque, damping) - module.axle_loss(constants, nu_, bearing)
    told -= module.contact_loss(constants, nu_, chi_, of_rollers)
    assert abs(float(power - told)) <= CLOSE * abs(float(power))


@pytest.mark.parametrize("base", ["massless", "locked"])
@pytest.mark.parametrize("stuck", [1, 2, 3])
@working_precision
def test_what_holds_an_axle_keeps_it_at_rest(stuck, base):
    """held_dynamics: its force as torques of the bearings lets the oracle's wheels stand still."""
    rng = np.random.default_rng([29, stuck])
    vehicle, state, numbers = random_case(rng)
    effects = ("drive", "axle_sticking")
    vehicle = without_layout(vehicle)
    module, constants = prepared_kernel(vehicle, base, effects, numbers)
    nu, chi, _ = state
    columns = [module.wheel_speeds(constants, balls(axis)) for axis in np.eye(3)]
    rows = [[columns[k][i] for k in range(3)] for i in range(stuck)]
    basis = []  # orthonormal, of the rows
    for row in rows:
        for known in basis:
            along = sum(a * b for a, b in zip(row, known, strict=True))
            row = [a - along * b for a, b in zip(row, known, strict=True)]
        size = sum(a * a for a in row).sqrt()
        basis.append([a / size for a in row])
    across = []  # columns that the axles which stick allow: what is left of the axes without the rows
    for axis in np.eye(3):
        left = balls(axis)
        for known in [*basis, *across]:
            along = sum(a * b for a, b in zip(left, known, strict=True))
            left = [a - along * b for a, b in zip(left, known, strict=True)]
        size = sum(a * a for a in left).sqrt()
        if len(across) < 3 - stuck and float(size) > 0.1:
            across.append([a / size for a in left])
    assert len(across) == 3 - stuck
    directions = [across[c][k] if c < 3 - stuck else exact(0) for k in range(3) for c in range(3)]
    absent = [exact(int(c >= 3 - stuck)) for c in range(3)]
    bearing = np.where(np.arange(WHEELS) < stuck, 0.0, numbers["bearing_torque"])
    nu_dot, held = module.held_dynamics(
        constants, balls(nu), balls(chi), balls(numbers["torque"]), balls(bearing), directions, absent
    )
    # the torques whose generalised force it is: in the orthonormal basis the rows are a triangle
    torques, rest = [exact(0)] * stuck, [sum(h * b for h, b in zip(held, known, strict=True)) for known in basis]
    for i in reversed(range(stuck)):
        along = [[sum(a * b for a, b in zip(rows[j], known, strict=True)) for known in basis] for j in range(stuck)]
        torques[i] = (rest[i] - sum((along[j][i] * torques[j] for j in range(i + 1, stuck)), exact(0))) / along[i][i]
    whole = [torques[i] if i < stuck else exact(float(bearing[i])) for i in range(WHEELS)]
    found = module.forward_dynamics(constants, balls(nu), balls(chi), balls(numbers["torque"]), whole)
    for got, want in zip(nu_dot, found, strict=True):
        assert abs(float(got - want)) <= CLOSE * (1 + abs(float(want)))
    for rate in module.wheel_speeds(constants, nu_dot)[:stuck]:
        assert abs(float(rate)) <= CLOSE
    if base == "locked":
        inputs = (balls(nu), balls(chi), balls(numbers["torque"]), balls(bearing), directions, absent)
        sharp = flat(module.held_dynamics_sharp(constants, *inputs))
        for got, want in zip(sharp, [*nu_dot, *held], strict=True):
            assert abs(float(got - want)) <= CLOSE * (1 + abs(float(want)))
    exactly = numbers | {"bearing_torque": [float(torque) for torque in whole]}
    wanted = oracle_accelerations(vehicle, state, base, effects, exactly)[:3]
    for got, want in zip(nu_dot, wanted, strict=True):  # the oracle takes the torques as doubles
        assert abs(float(got - want)) <= 1e-12 * (1 + abs(float(want)))


@working_precision
def test_the_momenta_follow_the_single_rollers():
    """momenta_rates, from two numbers and an energy per wheel, against the sums over the rollers, one by one."""
    rng = np.random.default_rng(17)
    vehicle, (nu, chi, spins), numbers = random_case(rng)
    module, constants = prepared_kernel(vehicle, "free", ("layout", "roller_viscous"), numbers)
    nu_, chi_ = balls(nu), balls(chi)
    axial = module.axial_speeds(constants, nu_, chi_, balls(spins))
    momenta, energy = module.momenta(constants, axial), module.roller_energy(constants, axial)
    momenta_dot, energy_dot, loss = module.momenta_rates(constants, nu_, chi_, momenta, energy)
    roller, damping = vehicle.number("roller_inertia"), balls(numbers["roller_damping"])
    chi_dot, contact_spin = module.wheel_rates(constants, nu_, chi_)
    total = exact(0)
    for i in range(WHEELS):
        moments = [-damping[i] * exact(float(spins[i][j])) for j in range(ROLLERS - 1)]
        for part, turn in enumerate(("cos", "sin")):
            wanted = sum(m * getattr(vehicle.kappa(j + 1), turn)() for j, m in enumerate(moments))
            assert abs(float(momenta_dot[i][part] - wanted)) < CLOSE
        wanted = sum(m * axial[i][j] for j, m in enumerate(moments))
        assert abs(float(energy_dot[i] - wanted)) < CLOSE
        assert abs(float(energy[i] - sum(roller * a * a / 2 for a in axial[i]))) < CLOSE
        total += damping[i] * (contact_spin[i] ** 2 + sum(exact(float(s)) ** 2 for s in spins[i]))
    assert abs(float(loss - total)) < CLOSE


@working_precision
def test_axial_speeds_after_a_while():
    """axial_after from the momenta alone, against each roller's own linear equation at a constant wheel angle: its
    solution is written down with one exponential."""
    rng = np.random.default_rng(19)
    vehicle, (_, chi, _), numbers = random_case(rng)
    module, constants = prepared_kernel(vehicle, "free", ("layout", "roller_viscous"), numbers)
    axial = balls(rng.normal(size=(WHEELS, ROLLERS - 1)))
    yaw, elapsed = exact("0.8"), exact("0.01")
    after = []
    for i in range(WHEELS):
        decay = (-balls(numbers["roller_damping"])[i] / vehicle.number("roller_inertia") * elapsed).exp()
        carried = [yaw * (exact(float(chi[i])) + vehicle.kappa(j + 1)).sin() for j in range(ROLLERS - 1)]
        after.append([c + decay * (a - c) for a, c in zip(axial[i], carried, strict=True)])
    found = module.axial_after(
        constants, axial, module.momenta(constants, axial), module.momenta(constants, after), elapsed
    )
    for got, want in zip(flat(found), flat(after), strict=True):
        assert abs(float(got - want)) < CLOSE
