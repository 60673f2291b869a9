"""A small picture of a vehicle from above, as an array of pixels: what `render` gives.

x points to the right and y up, and the picture moves with the vehicle over a lattice on the ground.
"""

from collections.abc import Sequence

import numpy as np

from omniroll.vehicles.vehicle import Vehicle

SIZE = 256  # pixels
SHOWN = 3.0  # platform radii from the middle to the edge
GROUND, LINES, BODY, WHEEL, ROLLER, MOVES, WANTED = np.array(
    [(246, 246, 242), (222, 222, 216), (176, 190, 205), (60, 66, 74), (209, 105, 26), (31, 95, 168), (63, 143, 79)],
    dtype=np.uint8,
)
CORNERS = 24  # of the body's outline


class Raster:
    """Pixels, and convex shapes filled into them.

    middle  (2,) in m, what the middle of the picture shows
    reach   in m, from the middle to the edges
    """

    def __init__(self, middle: np.ndarray, reach: float):
        steps = (np.arange(SIZE) + 0.5) * (2 * reach / SIZE) - reach
        self.x, self.y = np.meshgrid(middle[0] + steps, middle[1] - steps)
        self.pixels = np.tile(GROUND, (SIZE, SIZE, 1))
        self.width = 2 * reach / SIZE  # of a pixel

    def lattice(self, pitch: float) -> None:
        """Lines on the ground, `pitch` in m apart."""
        for along in (self.x, self.y):
            self.pixels[np.abs((along / pitch + 0.5) % 1 - 0.5) * pitch < self.width / 2] = LINES

    def fill(self, corners: np.ndarray, colour: np.ndarray) -> None:
        """Fill a convex shape whose corners (K, 2) in m go counterclockwise."""
        inside = np.ones(self.x.shape, bool)
        for (x, y), (ahead, up) in zip(corners, np.roll(corners, -1, axis=0) - corners, strict=True):
            inside &= ahead * (self.y - y) - up * (self.x - x) >= 0
        self.pixels[inside] = colour

    def line(self, ends: Sequence[np.ndarray], width: float, colour: np.ndarray) -> None:
        """A bar between two points (2,), `width` in m."""
        start, end = (np.asarray(point, float) for point in ends)
        length = np.hypot(*(end - start))
        if length > 0:
            side = width / 2 * np.array([-(end - start)[1], (end - start)[0]]) / length
            self.fill(np.array([start - side, end - side, end + side, start + side]), colour)


def picture(
    vehicle: Vehicle, pose: np.ndarray, chi: np.ndarray, contact: np.ndarray, moves: np.ndarray, wanted: np.ndarray
) -> np.ndarray:
    """(SIZE, SIZE, 3) uint8: the vehicle from above, its speed (blue) and that which is wanted (green).

    vehicle          Vehicle with N wheels of n rollers
    pose             (3,) x, y in m, heading in rad
    chi, contact     (N,) angles in rad and numbers of the rollers in contact: a mark on each wheel turns with it
    moves, wanted    (2,) nu_1 and nu_2, forward and to the left, each over the largest: 1 is two radii long
    """
    radius, tall = vehicle.platform_radius, vehicle.wheel_radius
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[cos, -sin], [sin, cos]])
    raster = Raster(pose[:2], SHOWN * radius)
    raster.lattice(radius)
    around = 2 * np.pi * np.arange(CORNERS) / CORNERS
    raster.fill(pose[:2] + 0.9 * radius * np.stack([np.cos(around), np.sin(around)], axis=-1), BODY)
    angles = chi - 2 * np.pi / vehicle.rollers_per_wheel * contact  # continuous over a joint
    for place, axle, angle in zip(vehicle.places(), vehicle.wheel_angles, angles, strict=True):
        along = turn @ np.array([np.sin(axle), -np.cos(axle)])  # where a positive rate carries the wheel to
        middle = pose[:2] + turn @ place
        raster.line((middle - tall * along, middle + tall * along), 0.35 * tall, WHEEL)
        if np.cos(angle) > 0:  # on the upper half
            mark = middle + tall * np.sin(angle) * along
            raster.line((mark - 0.12 * tall * along, mark + 0.12 * tall * along), 0.35 * tall, ROLLER)
    for speeds, colour in ((wanted, WANTED), (moves, MOVES)):
        raster.line((pose[:2], pose[:2] + 2 * radius * turn @ speeds), 0.08 * radius, colour)
    return raster.pixels
