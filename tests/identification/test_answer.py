"""What a fit gives: the scene that it writes, pictures, what to do next, and messages. Logs are the simulator's own."""

import csv
import re

import numpy as np
import pytest

import omniroll
from omniroll import cli

SCENE = """[vehicle]
preset = "paper"
[start]
nu = [0.0, 0.0, 0.0]
[run]
duration = 1.5
[rollers]
model = "massless"
[drive]
times = [0.0, 0.5, 1.0]
voltage = [[3.0, -1.0, 2.0], [2.0, 2.0, 1.0], [3.0, -2.0, -1.0]]
torque_constant = 0.02
resistance = 1.5
gear_ratio = 4.0
[bearings]
wheel_viscous = 0.002
[measurements]
wheel_rate_noise = 0.05
gyro_noise = 0.02
"""
TIMES = 0.01 * np.arange(1, 151)
TRUE = {"mass": 2.5, "wheel_viscous": 0.003, "gyro_bias": 0.1, "gyro_delay": 0.02, "wheel_rate_scale": 1.02}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenes") / "robot.toml"
    path.write_text(SCENE.replace("duration", "step = 0.1\nduration"))
    return path


@pytest.fixture(scope="module")
def columns(scene):
    """A log of a robot with other numbers than the scene's."""
    given = omniroll.load_scene(scene)
    motor, _ = given.options["effects"]
    options = given.options | {"effects": [motor, omniroll.Bearings(wheel_viscous=TRUE["wheel_viscous"])]}
    run = omniroll.simulate(given.vehicle.replace(mass=TRUE["mass"]), **options)
    rng = np.random.default_rng(5)
    rates = TRUE["wheel_rate_scale"] * run.measure(TIMES, names=("wheel_rate",))["wheel_rate"]
    late = run.sample(np.maximum(TIMES - TRUE["gyro_delay"], 0)).nu[:, 2] / given.vehicle.yaw_scale
    return {
        "t": TIMES,
        "wheel_rate": rates + rng.normal(scale=0.05, size=rates.shape),
        "gyro": late + TRUE["gyro_bias"] + rng.normal(scale=0.02, size=late.shape),
    }


@pytest.fixture(scope="module")
def fit(scene, columns):
    return omniroll.fit(omniroll.load_scene(scene), omniroll.Log(columns, name="drive"), list(TRUE))


@pytest.mark.long
def test_instruments_are_fitted_with_the_vehicle(fit):
    for name, value in TRUE.items():
        low, high = fit.interval(name, 0.999)
        assert low < value < high, name
        assert high - low < 0.5 * value
    assert fit.doubts == () and fit.undetermined == ()
    assert fit.vehicle.mass == fit["mass"] and fit.effects[1].wheel_viscous == fit["wheel_viscous"]
    assert np.allclose(np.diag(fit.correlations), 1) and str(fit).startswith("mass")


def test_a_prior_is_what_else_is_known(scene, columns, fit):
    log, given = omniroll.Log(columns), omniroll.load_scene(scene)
    known = omniroll.Number("wheel_rate_scale", prior=(1.0, 1e-5))
    held = omniroll.fit(given, log, ["mass", known])
    assert abs(held["wheel_rate_scale"] - 1) < 1e-3 < abs(fit["wheel_rate_scale"] - 1)
    bounded = omniroll.fit(given, log, ["mass", omniroll.Number("wheel_viscous", most=0.0025)])
    assert bounded["wheel_viscous"] == pytest.approx(0.0025)


@pytest.mark.parametrize("loss", ["linear", "soft_l1"])
@pytest.mark.parametrize("bounds", [{"most": 0.0025}, {"start": 0.004, "least": 0.0035}])
def test_a_number_that_ends_on_a_bound_says_so(scene, columns, loss, bounds):
    """The logs ask for 0.003, whose interval leaves it inside wide bounds."""
    given, log = omniroll.load_scene(scene), omniroll.Log({name: columns[name] for name in ("t", "wheel_rate")})
    free = [omniroll.Number("mass", start=2.5), omniroll.Number("wheel_viscous", **bounds), "wheel_rate_scale"]
    fit = omniroll.fit(given, log, free, loss=loss)
    bound = bounds.get("most") or bounds["least"]
    assert len(fit.on_bounds) == 1 and fit.on_bounds[0].startswith(f"wheel_viscous ends on its bound {bound:g}: ")
    assert fit.on_bounds[0] in str(fit).splitlines()
    low, high = fit.interval("wheel_viscous")
    assert low < bound < high  # so it reaches beyond
    wide = omniroll.fit(given, log, [omniroll.Number("wheel_viscous", least=0.001, most=0.01), *free[::2]], loss=loss)
    assert wide.on_bounds == () and "bound" not in str(wide)


def test_residuals_that_are_no_noise_are_said(scene, columns):
    """Without the numbers of the instruments the model misses something."""
    fit = omniroll.fit(omniroll.load_scene(scene), omniroll.Log(columns, name="drive"), ["mass"])
    assert any(re.fullmatch(r"drive, gyro: residuals are \d+\.?\d* times the noise", doubt) for doubt in fit.doubts)
    assert any("each residual goes with the one before it" in doubt for doubt in fit.doubts)


def test_noise_that_nobody_knows_is_what_is_left_over(scene, columns):
    plain = omniroll.load_scene(scene)
    fit = omniroll.fit(plain, omniroll.Log(columns), list(TRUE), instruments=omniroll.Instruments())
    assert fit.noise[0]["gyro"] == pytest.approx(0.02, rel=0.2) and fit.estimated == ("wheel_rate", "gyro")


@pytest.mark.long
def test_outliers_do_little_to_a_robust_loss(scene, columns):
    spoilt = columns | {"wheel_rate": columns["wheel_rate"].copy()}
    spoilt["wheel_rate"][::20] += 5.0
    given = omniroll.load_scene(scene)
    plain, robust = (
        omniroll.fit(given, omniroll.Log(spoilt), list(TRUE), loss=loss)["mass"] for loss in ("linear", "cauchy")
    )
    assert abs(robust - TRUE["mass"]) < 0.1 < abs(plain - TRUE["mass"])


def test_the_scene_that_is_written_has_the_numbers(fit, tmp_path):
    written = omniroll.load_scene(fit.save(tmp_path / "fitted.toml"))
    assert written.vehicle == fit.vehicle and written.options["effects"] == fit.effects
    assert written.instruments().bias == {"gyro": fit["gyro_bias"]}
    assert "# wheel_rate_scale  1.0" in (tmp_path / "fitted.toml").read_text()


def test_the_drive_that_tells_most(fit):
    """Of what a straight drive tells, turning while driving tells more; what is reached is below what is."""
    found = fit.experiments(duration=2.0, step=0.02)
    assert {experiment.name for experiment in found} >= {"straight", "turning while driving"}
    assert all(a.gain >= b.gain > 0 for a, b in zip(found, found[1:], strict=False))
    for experiment in found:
        reached = [experiment.deviations[name] for name in fit.names]
        assert (np.array(reached) < fit.deviations).all()


def test_parquet_files_and_data_frames_are_logs(scene, tmp_path, capsys):
    """Two logs at once, of which one has columns that are no readings, with a gyro in another unit."""
    given = omniroll.load_scene(scene)
    run = omniroll.simulate(given.vehicle.replace(mass=2.5), **given.options)
    frame, path = run.to_pandas(TIMES, given.instruments()), tmp_path / "drive.parquet"
    frame.to_parquet(path)
    plain = omniroll.Log({"t": TIMES, "gyro": frame["gyro"]}).data["gyro"]
    log = omniroll.Log.read(path, readings=["gyro", "wheel_rate"])
    assert set(log.channels) == {"gyro", "wheel_rate"} and (log.t == TIMES).all() and (log.data["gyro"] == plain).all()
    with pytest.raises(omniroll.LogError, match="drive.parquet: x: no such reading.*`readings` leaves"):
        omniroll.Log.read(path)
    frame.attrs["units"] |= {"gyro": "deg/s"}
    turned = omniroll.Log(frame, readings=["gyro"])
    assert turned.data["gyro"] == pytest.approx(np.radians(plain), rel=1e-14) and "deg/s" in turned.said[0]
    frame[["wheel_rate_1", "wheel_rate_2", "wheel_rate_3"]].to_csv(tmp_path / "drive.csv")
    call = ["fit", str(scene), str(path), str(tmp_path / "drive.csv"), "--output", str(tmp_path / "out")]
    assert cli.main([*call, "--free", "mass", "--readings", "wheel_rate", "--experiments"]) == 0
    printed = capsys.readouterr().out
    assert float(re.search(r"mass +(\S+)", printed)[1]) == pytest.approx(2.5, rel=0.02)
    assert printed.count(" would tell mass to ") == 4
    (tmp_path / "wrong.parquet").write_text("t,gyro")
    assert cli.main(["fit", str(scene), str(tmp_path / "wrong.parquet"), "--free", "mass"]) == 2
    assert "wrong.parquet: must be a Parquet file" in capsys.readouterr().err


@pytest.mark.long
def test_the_command(scene, columns, tmp_path, capsys):
    path = tmp_path / "drive.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t", "wheel_rate_1", "wheel_rate_2", "wheel_rate_3", "gyro"])
        writer.writerows(np.column_stack(list(columns.values())).tolist())
    call = ["fit", str(scene), str(path), "--output", str(tmp_path / "out"), "--free"]
    assert cli.main([*call, ",".join(TRUE), "--plot"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"mass +2\.[45]\d+  95 %: 2\.\d+ \.\.\. 2\.\d+", printed)
    assert (tmp_path / "out/residuals.png").read_bytes()[:4] == b"\x89PNG"
    assert omniroll.load_scene(tmp_path / "out/fitted.toml").vehicle.mass == pytest.approx(TRUE["mass"], rel=0.05)
    assert cli.main([*call, ",".join(TRUE), "--bounds", "mass=:2.3"]) == 0
    assert 2.299 < float(re.search(r"mass +(\S+)", capsys.readouterr().out)[1]) <= 2.3
    assert cli.main([*call, "mass", "--priors", "mass=2.4:1e-6", "--bounds", "mass=2:"]) == 4  # another model
    assert float(re.search(r"mass +(\S+)", capsys.readouterr().out)[1]) == pytest.approx(2.4, abs=1e-4)
    for given, words in (
        ("--bounds", "mass=2"), ("--bounds", "mass=a:b"), ("--priors", "mass=2.4:"), ("--priors", "gyro_bias=0:1"),
    ):  # fmt: skip
        assert cli.main([*call, "mass", given, words]) == 2
        assert given in capsys.readouterr().err
    path.write_text(path.read_text().replace("gyro", "compass"))
    assert cli.main([*call, "mass"]) == 2
    assert "drive.csv:1: compass: no such reading" in capsys.readouterr().err


@pytest.mark.parametrize("free, words", [
    (["weight"], "no such number"),
    (["mass", "mass"], "once"),
    ("mass", "sequence"),
    (["chi[3]"], "3 numbers"),
    ([omniroll.Number("mass", start=3, most=2)], "must lie between"),
])  # fmt: skip
def test_numbers_that_cannot_be(scene, columns, free, words):
    with pytest.raises(omniroll.InvalidValueError, match=words):
        omniroll.fit(omniroll.load_scene(scene), omniroll.Log(columns), free)


@pytest.mark.parametrize("factor, unit", [(180 / np.pi, "deg/s"), (30 / np.pi, "rpm")])
def test_a_wrong_unit_is_suspected(scene, columns, factor, unit):
    wrong = columns | {"gyro": columns["gyro"] * factor}
    with pytest.raises(omniroll.LogError, match=f"gyro: reads .* times what the model does: {unit} in the place"):
        omniroll.fit(omniroll.load_scene(scene), omniroll.Log(wrong), ["mass"])


def test_columns_and_times_that_do_not_fit_the_scene(scene, columns):
    given = omniroll.load_scene(scene)
    two = columns | {"wheel_rate": columns["wheel_rate"][:, :2]}
    with pytest.raises(omniroll.LogError, match="wheel_rate"):
        omniroll.fit(given, omniroll.Log(two), ["mass"])
    with pytest.raises(omniroll.LogError, match="before the start"):
        omniroll.fit(given, omniroll.Log(columns | {"t": columns["t"] - 1}), ["mass"])
