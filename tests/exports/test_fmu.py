"""Exported FMUs, as a master runs them: against simulate, side by side, saved and restored."""

import xml.etree.ElementTree as ElementTree
import zipfile

import numpy as np
import pytest

import omniroll
from omniroll.errors import InvalidValueError
from omniroll.exchange.fmu import to_fmu

fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed: make test-exports installs it")
for module in ("validation", "fmi2", "fmi3"):
    pytest.importorskip(f"fmpy.{module}")

VEHICLE = omniroll.Vehicle.paper().replace(rollers_per_wheel=20, roller_axis_radius=None)
MOTOR = {"torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 4, "current_limit": 1.0}
DURATION, EVERY = 8.0, 0.5  # s; other voltages come every half second
OPTIONS = {"nu": (1, 0.2, 3), "chi": (0.1, -0.12, 0.03), "spins": 2.0, "pose": (0.1, 0.2, 0.3)}
VOLTAGES = 5 * np.random.default_rng(4).uniform(-1, 1, (16, 3)) + 1
READ = [f"{name}[{k}]" for name in ("nu", "pose", "chi") for k in range(3)]
CLOSE = 1e-9  # the accuracy of simulate by default


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmu")
    motor = omniroll.Motor(voltage=0, **MOTOR)
    return {v: to_fmu(VEHICLE, folder / f"robot{v}.fmu", version=v, effects=[motor], **OPTIONS) for v in (2, 3)}


@pytest.fixture(scope="module")
def run():
    """The same motion by the compiled engine, through more than a thousand switches."""
    times = EVERY * np.arange(len(VOLTAGES))
    motor = omniroll.Motor(voltage=VOLTAGES, times=times, interpolation="hold", **MOTOR)
    found = omniroll.simulate(VEHICLE, effects=[motor], duration=DURATION, **OPTIONS)
    assert len(found.switches) > 1000
    return found


class Instance:
    """One instance of an FMU, from its file to its end."""

    def __init__(self, path):
        self.description = fmpy.read_model_description(path)
        self.folder = fmpy.extract(path)
        kind = {"2.0": fmpy.fmi2.FMU2Slave, "3.0": fmpy.fmi3.FMU3Slave}[self.description.fmiVersion]
        self.third = self.description.fmiVersion == "3.0"
        self.fmu = kind(
            guid=self.description.guid, unzipDirectory=self.folder, instanceName="one",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate()
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.time = 0.0

    def begin(self):
        if not self.third:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def set(self, **values):
        for name, value in values.items():
            many = np.atleast_1d(value)
            names = [name] if np.ndim(value) == 0 else [f"{name}[{k}]" for k in range(len(many))]
            put = self.fmu.setFloat64 if self.third else self.fmu.setReal
            put([self.references[n] for n in names], list(map(float, many)))

    def get(self, names=READ):
        read = self.fmu.getFloat64 if self.third else self.fmu.getReal
        return np.array(read([self.references[name] for name in names]))

    def contacts(self):
        read = self.fmu.getInt32 if self.third else self.fmu.getInteger
        return list(read([self.references[f"contact[{i}]"] for i in range(3)]))

    def drive(self, until, h):
        """Steps of h under the voltages, which change between steps."""
        for k in range(round(self.time / h), round(until / h)):
            if not k % round(EVERY / h):
                self.set(voltage=VOLTAGES[k // round(EVERY / h)])
            self.fmu.doStep(currentCommunicationPoint=k * h, communicationStepSize=h)
        self.time = until
        return self.get()

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


@pytest.mark.parametrize("version", [2, 3])
def test_it_is_valid(version, files):
    assert fmpy.validation.validate_fmu(str(files[version])) == []


@pytest.mark.parametrize("version, h", [(2, 0.001), (3, 0.01)])
def test_it_moves_as_simulate_does_through_a_thousand_switches(version, h, files, run):
    instance = Instance(files[version]).begin()
    ends = {t: instance.drive(t, h) for t in (1.0, 4.0, DURATION)}
    for t, found in ends.items():
        wanted = run.sample([t])
        numbers = np.concatenate([wanted.nu[0], wanted.pose[0]])
        size = np.array([*3 * [np.abs(run.nu).max()], *2 * [VEHICLE.platform_radius], 1])  # as `accuracy` is measured
        assert np.all(np.abs(found[:6] - numbers) < CLOSE * size), t
    assert instance.contacts() == run.contact[-1].tolist()
    instance.end()


@pytest.mark.parametrize("version", [2, 3])
def test_two_instances_know_nothing_of_each_other(version, files):
    alone = Instance(files[version]).begin()
    wanted = alone.drive(1.0, 0.01)
    one, other = Instance(files[version]), Instance(files[version])
    other.set(mass=9.0, nu_start=(0, 1, -2))
    one.begin(), other.begin()
    for t in np.arange(1, 11) / 10:
        found, different = one.drive(t, 0.01), other.drive(t, 0.01)
    assert np.array_equal(found, wanted) and not np.allclose(different, wanted)
    for instance in (alone, one, other):
        instance.end()


@pytest.mark.parametrize("version", [2, 3])
def test_a_state_is_saved_and_restored_to_the_bit(version, files):
    instance = Instance(files[version]).begin()
    instance.drive(0.5, 0.01)
    state = instance.fmu.getFMUState() if instance.third else instance.fmu.getFMUstate()
    data = instance.fmu.serializeFMUState(state) if instance.third else instance.fmu.serializeFMUstate(state)
    wanted = instance.drive(1.0, 0.01)
    (instance.fmu.setFMUState if instance.third else instance.fmu.setFMUstate)(state)
    instance.time = 0.5
    assert np.array_equal(instance.drive(1.0, 0.01), wanted)
    (instance.fmu.freeFMUState if instance.third else instance.fmu.freeFMUstate)(state)
    other = Instance(files[version]).begin()  # the bytes go into another instance
    if instance.third:
        other.fmu.setFMUState(other.fmu.deserializeFMUState(data))
    else:
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(data))
    other.time = 0.5
    assert np.array_equal(other.drive(1.0, 0.01), wanted)
    instance.end(), other.end()


def test_parameters_are_those_of_the_scene_and_make_another_vehicle(files):
    heavy = VEHICLE.replace(mass=7.5)
    instance = Instance(files[3])
    assert instance.get(["mass", "wheel_radius", "torque_constant", "nu_start[2]"]) == pytest.approx(
        [VEHICLE.mass, VEHICLE.wheel_radius, 0.02, 3.0], rel=0
    )
    instance.set(mass=7.5)
    instance.begin()
    motor = omniroll.Motor(voltage=VOLTAGES[0], **MOTOR)
    run = omniroll.simulate(heavy, effects=[motor], duration=0.5, **OPTIONS)
    assert instance.drive(0.5, 0.01)[:3] == pytest.approx(run.nu[-1], abs=1e-8)
    with pytest.raises(Exception, match="(?i)error|3"):
        instance.set(mass=1.0)  # while it moves
    instance.end()


@pytest.mark.parametrize("version", [2, 3])
def test_wrong_parameters_are_refused_at_the_start(version, files):
    instance = Instance(files[version])
    instance.set(yaw_inertia=1e-12)
    with pytest.raises(Exception, match="(?i)error|3"):
        instance.begin()


def test_torques_locked_rollers_and_friction(tmp_path):
    """Another set of effects, without a motor: its inputs are torques."""
    friction = omniroll.Bearings(wheel_viscous=1e-3, wheel_coulomb=1e-3, wheel_speed=0.3)
    options = {"nu": (0.5, 0, 1), "roller_model": "locked"}
    instance = Instance(to_fmu(omniroll.Vehicle.paper(4), tmp_path / "four.fmu", effects=[friction], **options)).begin()
    instance.set(torque=(0.02, -0.01, 0, 0.01))
    for k in range(200):
        instance.fmu.doStep(currentCommunicationPoint=k * 0.01, communicationStepSize=0.01)
    torque = omniroll.Torque((0.02, -0.01, 0, 0.01))
    run = omniroll.simulate(omniroll.Vehicle.paper(4), effects=[friction, torque], duration=2, **options)
    assert instance.get()[:6] == pytest.approx([*run.nu[-1], *run.pose[-1]], abs=1e-8)
    assert instance.get([f"drive_torque[{i}]" for i in range(4)]) == pytest.approx([0.02, -0.01, 0, 0.01], rel=0)
    instance.end()


def test_the_same_scene_gives_the_same_bytes_with_sources_and_units(files, tmp_path):
    again = to_fmu(VEHICLE, tmp_path / "robot2.fmu", effects=[omniroll.Motor(voltage=0, **MOTOR)], **OPTIONS)
    with zipfile.ZipFile(files[2]) as one, zipfile.ZipFile(again) as other:
        assert {n: one.read(n) for n in one.namelist()} == {n: other.read(n) for n in other.namelist()}
        root = ElementTree.fromstring(one.read("modelDescription.xml"))
    units = {v.get("name"): v[0].get("unit") for v in root.iter("ScalarVariable")}
    assert (units["mass"], units["wheel_inertia"], units["yaw_scale"]) == ("kg", "kg m^2", None)
    assert (units["voltage[0]"], units["nu[0]"], units["pose[0]"], units["pose[2]"]) == ("V", "1/s", "m", "rad")


@pytest.mark.parametrize("effects, options, said", [
    ([omniroll.Contact(100.0)], {}, "wheels that roll"),
    ([omniroll.Bearings(wheel_coulomb=1e-3)], {}, "wheel_speed"),
    ([], {"version": 1}, "version"),
    ([], {"nu": np.zeros((2, 3))}, "one state"),
])  # fmt: skip
def test_what_is_not_exported(effects, options, said, tmp_path):
    with pytest.raises(InvalidValueError, match=said):
        to_fmu(VEHICLE, tmp_path / "no.fmu", effects=effects, **options)
    assert not (tmp_path / "no.fmu").exists()
