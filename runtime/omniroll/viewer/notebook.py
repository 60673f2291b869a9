"""A notebook shows a trajectory as the page on which it moves."""

import sys
from typing import Any

MOST_ROWS = 10_000  # of a run that is shown unasked: its page has 1.5 MB


def show_trajectories() -> None:
    """Tell IPython, where it runs this program, how it shows trajectories. The page is imported when one is shown."""
    shell = sys.modules["IPython"].get_ipython()
    if shell is not None:
        formatter = shell.display_formatter.formatters["text/html"]
        formatter.for_type_by_name("omniroll.results.trajectory", "Trajectory", shown)


def shown(trajectory: Any) -> str | None:
    """HTML of the page in a cell; None for a long run, of which a notebook shows the one line of text."""
    from omniroll.viewer.page import view

    return view(trajectory)._repr_html_() if len(trajectory) <= MOST_ROWS else None
