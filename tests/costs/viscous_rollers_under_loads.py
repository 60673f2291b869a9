"""Random tall scenes of massless rollers with viscous friction under loads that follow the motion, for counting."""

from contact.test_massless_rollers_with_viscous_bearings import rubbing_under_loads


def task(name: str) -> dict:
    """The arguments of a run, from the scene's number."""
    vehicle, options = rubbing_under_loads(int(name), "regularised", low=False)
    options.pop("control")
    return {"vehicle": vehicle, "duration": 0.05} | options
