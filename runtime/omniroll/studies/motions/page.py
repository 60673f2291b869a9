"""The page that puts the pictures beside what the paper says of them. Every number on it is of this run."""

from collections.abc import Iterable
from html import escape

from omniroll.results.pictures import SHORT
from omniroll.studies.motions import measures
from omniroll.studies.motions.cases import ACCURACY, LONG, MASSLESS, MOTIONS, PAPER, SETTINGS, Motion, Runs
from omniroll.studies.motions.claims import CLOSE, CONSTANT, Claim, Finding

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1280px;
  margin: 2em auto; padding: 0 1.5em }
h1, h2, h3 { font-weight: 600; line-height: 1.2 } h2 { margin-top: 2.2em; border-bottom: 1px solid #ddd }
img { width: 100%; height: auto; border: 1px solid #e4e4e4 }
.pair { display: grid; grid-template-columns: 2fr 1fr; gap: 1.5em; align-items: start; margin: 1.5em 0 }
@media (max-width: 900px) { .pair { grid-template-columns: 1fr } }
table { border-collapse: collapse; margin: 1em 0; font-size: 14px }
th, td { padding: .3em .7em; border-bottom: 1px solid #e4e4e4; text-align: left; vertical-align: top }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums }
.agrees { color: #1b6e3c } .differs { color: #b3261e; font-weight: 600 } .unit, .source { color: #777 }
code { font-size: 13px }
"""
FIGURES = (  # number, what the paper's caption says, claims that the picture bears on
    (5, "A vehicle without rollers, with a twist. It moves on a circle and turns evenly.",
     ("3f", "3g"), MASSLESS),
    (6, "The same start with rollers. Energy and pseudo-velocities are not constant.",
     ("3a", "3b", "3c", "3d"), PAPER),
    (7, "The same on a short interval. The pseudo-velocities are not constant; the energy has steps.",
     ("3c", "3d", "3e"), PAPER),
)  # fmt: skip
FILES = (
    "<p>Each CSV file holds one run: a row per step, two at a switch (before and after). "
    "<a href='findings.csv'>findings.csv</a> holds the numbers of the tables above.</p>"
)


def number(value: float) -> str:
    """Two digits, plain where that reads better."""
    return f"{value:.2g}"


def verdict(finding: Finding) -> str:
    """The finding's number, coloured and worded."""
    word = "agrees" if finding.holds else "differs"
    return f'<span class="{word}">{number(finding.value)} {word}</span>'


def picture(name: str, about: str) -> str:
    return f'<a href="{name}"><img src="{name}" alt="{escape(about)}"></a>'


def bullets(lines: Iterable[str]) -> str:
    return "<ul>" + "".join(f"<li>{line}</li>" for line in lines) + "</ul>"


def differences(findings: list[Finding]) -> str:
    """The claims that runs do not bear out: first in the paper's own setting, then in the others."""
    own, other = parted(findings)
    return (
        f"<p>In the paper's own setting ({PAPER.label}; and massless) {count(own)} statements hold."
        f"</p>{difference_list(own)}<p>The paper leaves other roller models and laws to later work. "
        f"Under those its words hold in {count(other)} cases. They differ here:</p>{difference_list(other)}"
    )


def parted(findings: list[Finding]) -> tuple[list[Finding], list[Finding]]:
    """Those in the paper's own setting, and the others."""
    own = [finding for finding in findings if finding.setting in (PAPER, MASSLESS)]
    return own, [finding for finding in findings if finding not in own]


def count(findings: list[Finding]) -> str:
    return f"{sum(finding.holds for finding in findings)} of {len(findings)}"


def difference_list(findings: list[Finding]) -> str:
    """One bullet a claim that fails: its words, the number of each setting where it fails, the limit."""
    failing: dict[Claim, list[Finding]] = {}
    for finding in findings:
        if not finding.holds:
            failing.setdefault(finding.claim, []).append(finding)
    return bullets(
        f"Motion {claim.motion}: “{escape(claim.text)}” {escape(claim.quantity)}: "
        + ", ".join(f"<b>{number(finding.value)}</b> ({finding.setting.label})" for finding in failures)
        + f"; {limit(claim.kind)}. {escape(claim.remark)}"
        for claim, failures in failing.items()
    )


def limit(kind: str) -> str:
    """What `kind` would have asked for, in words."""
    return {
        "constant": f"at most {CONSTANT:g} counts as constant",
        "varies": f"more than {CONSTANT:g} counts as varying",
        "close": f"at most {CLOSE:g} counts as close",
        "close, not equal": f"{CONSTANT:g} to {CLOSE:g} counts as close, not equal",
    }[kind]


def figure_section(entry: tuple, findings: list[Finding]) -> str:
    """One figure of the paper: our picture beside its caption and the numbers of the run."""
    figure, caption, ids, setting = entry
    lines = [
        f"{escape(finding.claim.text)}<br>{quantity(finding)} {verdict(finding)}"
        for finding in findings
        if finding.claim.id in ids and finding.setting == setting
    ]
    return (
        f"<h3>Figure {figure}</h3><div class=pair><div>{picture(f'figure-{figure}.png', caption)}</div>"
        f"<div><p><b>The paper:</b> {escape(caption)}</p>"
        f"<p><b>This run</b> ({setting.label}; over {LONG:g} s):</p>{bullets(lines)}</div></div>"
    )


def quantity(finding: Finding) -> str:
    return f"<span class=unit>{escape(finding.claim.quantity)}:</span>"


def claims_table(motion: Motion, findings: list[Finding]) -> str:
    """The motion's claims as rows, the settings as columns."""
    claims = {f.claim.id: f.claim for f in findings if f.claim.motion == motion.number}
    cells = {(f.claim.id, f.setting.key): verdict(f) for f in findings}
    head = "".join(f"<th>{escape(setting.label)}</th>" for setting in SETTINGS)
    rows = [
        f"<tr><td>{escape(claim.text)}<br>"
        f"<span class=source>{escape(claim.source)}; {escape(claim.quantity)}</span></td>"
        + "".join(f"<td class=number>{cells.get((claim.id, setting.key), '')}</td>" for setting in SETTINGS)
        + "</tr>"
        for claim in claims.values()
    ]
    return f"<table><tr><th>the paper says</th>{head}</tr>{''.join(rows)}</table>"


def runs_table(motion: Motion, runs: Runs) -> str:
    """What else each run gave, with its data file."""
    rows = []
    for setting in SETTINGS:
        run = runs[motion.number, setting.key]
        x, y, theta = run.pose[-1]
        name = data_name(motion, setting)
        rows.append(
            f"<tr><td>{setting.label}</td><td class=number>{len(run.switches)}</td>"
            f"<td class=number>{100 * measures.energy_change(run):z.3f} %</td>"
            f"<td class=number>{number(100 * measures.largest_energy_step(run))} %</td>"
            f"<td class=number>{number(run.stats['error_estimate'])}</td>"
            f"<td class=number>{x:z.4f} m, {y:z.4f} m, {theta:z.4f} rad</td>"
            f"<td><a href='{name}'>{name}</a></td></tr>"
        )
    columns = ("setting", "switches", "energy, start to end", "largest energy step", "error estimate",
               "x, y, theta", "data")  # fmt: skip
    head = "".join(f"<th>{column}</th>" for column in columns)
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def data_name(motion: Motion, setting) -> str:
    """File name of a run's data."""
    return f"motion-{motion.number}-{setting.key}.csv"


def motion_section(motion: Motion, runs: Runs, findings: list[Finding]) -> str:
    """One motion: what the paper says, pictures, and the runs."""
    start = ", ".join(f"{value:g}" for value in motion.nu)
    stem = f"motion-{motion.number}"
    return (
        f"<h2>Motion {motion.number}: {motion.title}</h2>"
        f"<p>nu(0) = ({start}) 1/s, chi(0) = 0, rollers at rest.</p>"
        + claims_table(motion, findings)
        + picture(f"{stem}-long.png", f"motion {motion.number}, long interval")
        + picture(f"{stem}-short.png", f"motion {motion.number}, short interval")
        + picture(f"{stem}-impact.png", f"motion {motion.number}, long interval, impact at each switch")
        + picture(f"{stem}-laws.png", f"motion {motion.number}, switching laws")
        + runs_table(motion, runs)
    )


def vehicle_line(vehicle) -> str:
    """The vehicle's numbers in one paragraph."""
    names = (
        "mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "platform_radius", "wheel_radius",
        "roller_axis_radius", "yaw_scale",
    )  # fmt: skip
    numbers = ", ".join(f"{name} {getattr(vehicle, name):.6g}" for name in names)
    return f"{vehicle.wheels} wheels with {vehicle.rollers_per_wheel} rollers each; in SI units: {numbers}"


def introduction(vehicle) -> str:
    """What was run, and by which limits it is judged."""
    return (
        f"<p>Section 5 of the paper, run for {LONG:g} s and shown also for the first {SHORT:g} s. "
        f"The vehicle: {vehicle_line(vehicle)}. Accuracy asked of the runs: {ACCURACY:g}. "
        f"The paper's numerics keep the free rollers at rest and use the smooth law: <b>{PAPER.label}</b>. "
        "The statements are the paper's, in our words; it gives no limits, so these are ours: "
        f"up to {CONSTANT:g} is constant, up to {CLOSE:g} of the way or the angle is close.</p>"
    )


def page(vehicle, runs: Runs, findings: list[Finding]) -> str:
    """The whole page as HTML."""
    body = [
        "<h1>The paper's motions</h1>",
        introduction(vehicle),
        "<h2>Where the runs differ from the paper</h2>",
        differences(findings),
        "<h2>The paper's figures</h2>",
        *(figure_section(entry, findings) for entry in FIGURES),
        *(motion_section(motion, runs, findings) for motion in MOTIONS),
        "<h2>Files</h2>",
        FILES,
    ]
    return (
        "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>"
        f"<title>omniroll: the paper's motions</title><style>{STYLE}</style><body>"
        f"{''.join(body)}</body></html>\n"
    )
