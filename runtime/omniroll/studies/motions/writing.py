"""Pictures, data and the page of the paper's motions, written into a folder."""

import csv
import time
from pathlib import Path

from omniroll.progress import Pace, duration
from omniroll.results import pictures
from omniroll.results.pictures import SHORT
from omniroll.studies.motions import figures
from omniroll.studies.motions.cases import LONG, MASSLESS, MOTIONS, PAPER, SETTINGS, Runs, run_all
from omniroll.studies.motions.claims import Finding, judge
from omniroll.studies.motions.page import count, data_name, page, parted
from omniroll.vehicles.vehicle import Vehicle


def progress(total: int):
    """A reporter for run_all that prints one line a run: what it was, and about how long the others will take."""
    pace, done = Pace(time.monotonic), 0
    pace.note(0)

    def report(motion, setting, trajectory) -> None:
        nonlocal done
        done += 1
        pace.note(done)
        print(
            f"  [{done:2d}/{total}] motion {motion.number}, {setting.label}: {len(trajectory.switches)} switches, "
            f"{pace.took:.1f} s so far, about {duration(pace.left(done, total))} left",
            flush=True,
        )

    return report


def write_figures(folder: Path, runs: Runs) -> list[Path]:
    """Every picture of the page; returns their paths."""
    import matplotlib

    smooth = [setting for setting in SETTINGS if setting.switching == "smooth"]
    impact = [MASSLESS, *(setting for setting in SETTINGS if setting.switching == "impact")]
    massive = [setting for setting in SETTINGS if setting != MASSLESS]
    twist = MOTIONS[2]
    written = []

    def put(figure, name: str) -> None:
        written.append(pictures.save(figure, folder / name))

    with matplotlib.rc_context(pictures.STYLE):
        for name, setting, end, title in (
            ("figure-5", MASSLESS, LONG, "Figure 5: motion 3 without rollers"),
            ("figure-6", PAPER, LONG, "Figure 6: motion 3 with rollers"),
            ("figure-7", PAPER, SHORT, "Figure 7: motion 3 with rollers, short interval"),
        ):
            put(figures.sheet(twist, [setting], runs, end, title), f"{name}.png")
        for motion in MOTIONS:
            title = f"Motion {motion.number}: {motion.title}"
            stem = f"motion-{motion.number}"
            print(f"  pictures of motion {motion.number}", flush=True)
            put(figures.sheet(motion, smooth, runs, LONG, title), f"{stem}-long.png")
            put(figures.sheet(motion, smooth, runs, SHORT, f"{title}, short interval"), f"{stem}-short.png")
            put(figures.sheet(motion, impact, runs, LONG, f"{title}, impact at each switch"), f"{stem}-impact.png")
            put(figures.laws_sheet(motion, massive, runs), f"{stem}-laws.png")
    return written


def write_data(folder: Path, runs: Runs) -> list[Path]:
    """One CSV file a run; returns their paths."""
    written = []
    for motion in MOTIONS:
        for setting in SETTINGS:
            path = folder / data_name(motion, setting)
            runs[motion.number, setting.key].save(path, dense=False)
            written.append(path)
    return written


def write_findings(path: Path, findings: list[Finding]) -> Path:
    """The numbers of the page's tables, one claim and setting a row."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["claim", "motion", "setting", "statement", "quantity", "value", "kind", "holds"])
        for finding in findings:
            claim = finding.claim
            rows.writerow([claim.id, claim.motion, finding.setting.key, claim.text, claim.quantity,
                           repr(finding.value), claim.kind, finding.holds])  # fmt: skip
    return path


def write_all(folder: Path) -> Path:
    """Run every motion under every setting and write all of it; the page's path. Prints its progress."""
    folder.mkdir(parents=True, exist_ok=True)
    runs = run_all(progress(len(MOTIONS) * len(SETTINGS)))
    findings = judge(runs)
    pictures = write_figures(folder, runs)
    data = [*write_data(folder, runs), write_findings(folder / "findings.csv", findings)]
    index = folder / "index.html"
    index.write_text(page(Vehicle.paper(), runs, findings), encoding="utf-8")
    own, other = parted(findings)
    print(f"  {count(own)} statements of the paper hold in its setting, {count(other)} under other models and laws")
    print(f"wrote {len(pictures)} pictures (PNG), {len(data)} tables (CSV) and the page with both:\n{index}")
    return index
