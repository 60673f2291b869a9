"""What drives a model from a log: currents and torques as motor drivers have them; and fits that somebody ends."""

import signal

import numpy as np
import pytest

import omniroll
from omniroll import cli

TIMES = 0.01 * np.arange(1, 101)
ROWS = np.array([[3.0, -1.0, 2.0], [2.0, 2.0, 1.0], [3.0, -2.0, -1.0]])
MOTOR = omniroll.Motor(
    ROWS, torque_constant=0.02, resistance=1.5, gear_ratio=4.0, rotor_inertia=2e-6, times=[0.0, 0.5, 1.0]
)
BEARINGS = omniroll.Bearings(wheel_viscous=0.003)
TRUE, GUESS = omniroll.Vehicle.paper().replace(mass=2.5), omniroll.Vehicle.paper()
EFFECTS = [MOTOR, omniroll.Bearings(wheel_viscous=0.002)]
START = {"nu": (0, 0, 0), "roller_model": "massless"}


@pytest.fixture(scope="module")
def data():
    run = omniroll.simulate(TRUE, duration=1.0, effects=[MOTOR, BEARINGS], **START)
    names = ("wheel_rate", "motor_current", "motor_voltage", "gyro")
    times = np.insert(TIMES, 0, 0.0)
    read = run.measure(times, names=names)
    torque = MOTOR.torque_constant * MOTOR.gear_ratio * read["motor_current"]
    return {"t": times, **{name: read[name] for name in names}, "torque": torque}


def found(data, drive, *columns, **options):
    log = omniroll.Log({name: data[name] for name in ("t", "wheel_rate", "gyro", drive, *columns)}, drive=drive)
    return log, omniroll.fit(GUESS, log, ["mass", "wheel_viscous"], effects=EFFECTS, **START, **options)


@pytest.mark.parametrize("drive", ["motor_current", "torque"])
def test_currents_and_torques_drive(data, drive):
    """Between the rows they are linear, where those of the log are nearly so."""
    others = ["motor_voltage"] if drive == "motor_current" else []
    log, fit = found(data, drive, *others)
    assert fit["wheel_viscous"] == pytest.approx(0.003, rel=1e-3)
    assert fit["mass"] == pytest.approx(2.5, rel=1e-3)
    assert log.fitted == ("wheel_rate", "gyro") and fit.differenced == ()
    assert any("motor_voltage is left alone" in words for words in log.said) == bool(others)


def test_a_fit_that_is_ended_gives_the_best_so_far(data):
    said, asked = [], []
    _, fit = found(data, "torque", report=said.append, interrupted=lambda: asked.append(1) or len(asked) > 12)
    assert fit.is_ended and len(asked) == 13 and "best numbers so far" in str(fit)
    assert said[0] == "2 numbers from log of 101 rows"
    assert 1.0 < fit["mass"] < 3.0


ORDER, SIGNS = [1, 2, 0], [1, -1, 1]


def swapped(data, *names):
    """A log whose column i is wheel ORDER[i], with other signs."""
    return data | {name: data[name][:, ORDER] * SIGNS for name in names}


def test_swapped_columns_are_no_tight_mass(data):
    _, plain = found(data, "motor_voltage")
    assert plain.misses == ()
    _, fit = found(swapped(data, "wheel_rate"), "motor_voltage")
    assert any("not this model" in words for words in fit.misses) and fit.misses[-1] in str(fit)
    assert "with the wheels' columns 3, 1, -2 of readings the model as it was leaves" in fit.misses[-1]


def written(data, folder):
    columns = [data["t"], *data["wheel_rate"].T, *data["torque"].T]
    names = "t,wheel_rate_1,wheel_rate_2,wheel_rate_3,torque_1,torque_2,torque_3"
    np.savetxt(folder / "log.csv", np.stack(columns, 1), "%.17g", ",", header=names, comments="")
    (folder / "robot.toml").write_text(
        "[vehicle]\npreset = 'paper'\n[start]\nnu = [0, 0, 0]\n[run]\nduration = 1\n[rollers]\nmodel = 'massless'\n"
        "[bearings]\nwheel_viscous = 0.002\n"
    )
    call = ["fit", str(folder / "robot.toml"), str(folder / "log.csv"), "--free", "mass", "--drive", "torque"]
    return [*call, "--output", str(folder / "out")]


def test_another_model_has_an_exit_code(data, tmp_path, capsys):
    assert cli.main(written(swapped(data, "wheel_rate"), tmp_path)) == 4
    assert "are columns swapped?" in capsys.readouterr().out


def test_ctrl_c_ends_the_command_with_the_best_so_far(data, tmp_path, capsys, monkeypatch):
    from omniroll.identification.watching import Watch

    note = Watch.note

    def pressed(watch, *arguments):
        if watch.seen == 11:
            signal.raise_signal(signal.SIGINT)
        note(watch, *arguments)

    monkeypatch.setattr(Watch, "note", pressed)
    assert cli.main(written(data, tmp_path)) == 130
    out, err = capsys.readouterr()
    assert "best numbers so far" in out and "1 numbers from log.csv" in err
    assert (tmp_path / "out/fitted.toml").exists()
