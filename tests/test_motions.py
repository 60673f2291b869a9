"""`omniroll motions`: what it writes, and that its numbers are those of the runs."""

import csv
import re
from types import SimpleNamespace

import numpy as np
import pytest

from omniroll.studies.motions import cases, figures, measures, page, writing

DURATION = 12.0  # s, in place of the long interval


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the command writes, with a shorter long interval."""
    folder = tmp_path_factory.mktemp("motions")
    with pytest.MonkeyPatch.context() as patch:
        for module in (cases, figures, page, writing):
            patch.setattr(module, "LONG", DURATION)
        writing.write_all(folder)
    return folder


@pytest.fixture(scope="module")
def rows(folder):
    with (folder / "findings.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.long
def test_the_page_shows_every_picture_and_table(folder):
    text = (folder / "index.html").read_text(encoding="utf-8")
    shown = set(re.findall(r"(?:src|href)=['\"]([^'\"]+)['\"]", text))
    assert shown == {path.name for path in folder.iterdir()} - {"index.html"}
    assert sum(name.endswith(".png") for name in shown) == 3 + 4 * len(cases.MOTIONS)
    assert sum(name.endswith(".csv") for name in shown) == 1 + len(cases.MOTIONS) * len(cases.SETTINGS)


@pytest.mark.long
def test_every_number_of_the_findings_stands_on_the_page(folder, rows):
    text = (folder / "index.html").read_text(encoding="utf-8")
    assert len(rows) > 50
    assert [row for row in rows if f">{page.number(float(row['value']))} " not in text] == []


def test_every_difference_is_told_first(folder, rows):
    text = (folder / "index.html").read_text(encoding="utf-8")
    first = text[text.index("Where the runs differ") : text.index("The paper's figures")]
    differing = [row for row in rows if row["holds"] == "False"]
    assert differing
    assert [row for row in differing if f"<b>{page.number(float(row['value']))}</b>" not in first] == []


def test_the_locked_vehicle_goes_straight_without_steps_of_energy(rows):
    """The one statement of section 5 that its own setting does not bear out."""
    own = [row for row in rows if row["setting"] in ("massless", "locked-smooth")]
    assert [row["claim"] for row in own if row["holds"] == "False"] == ["2d"]


def test_measures_of_a_run_made_by_hand():
    switches = np.array([(1.0, 0.5)], [("t", float), ("energy_jump", float)])
    angle = np.array([0.0, 0.3, 0.3, 2.0])
    run = SimpleNamespace(
        t=np.array([0.0, 1.0, 1.0, 2.0]),
        energy=np.array([2.0, 2.25, 2.75, 2.5]),
        pose=np.column_stack([3 * np.cos(angle), 1 + 3 * np.sin(angle), angle]),
        switches=switches,
    )
    assert measures.largest_energy_step(run) == 0.25
    assert measures.energy_drift(run) == 0.125
    assert measures.energy_change(run) == 0.25
    assert measures.circle(run) == pytest.approx((3.0, 0.0), abs=1e-12)
