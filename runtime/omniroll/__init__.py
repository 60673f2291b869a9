"""omniroll: vehicles on omni-wheels whose rollers have mass.

vehicle = omniroll.Vehicle.paper()
run = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=20)
run.pose[-1]

`import omniroll` imports nothing else of the package. A name is imported when it is first used, from the module that
the stub __init__.pyi gives for it; the stub is also what type checkers and editors read.
"""

import sys

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

if "IPython" in sys.modules:  # a notebook shows a trajectory as the page on which it moves
    from omniroll.viewer.notebook import show_trajectories

    show_trajectories()
