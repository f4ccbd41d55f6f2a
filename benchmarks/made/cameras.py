"""Cameras known exactly: a pinhole, Brown's lens and Snell's law written as rays, apart from ploughval's own.

A place in the photograph without distortion is a ray; the ray is refracted at both faces of the window as a
vector and met with the plane of the sand. The photograph shows it where the lens puts it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import gaussian_filter

SHAPE = (2000, 3000)
WINDOW_MM = (200.0, 130.0)


@dataclass(frozen=True)
class MadeCamera:
    """A camera over the window: x along it, y up, z towards the camera, mm; the sand at z = 0.

    place_mm : (3,) of the pupil; turn (3, 3): rows are the picture's right, down and the optical axis in the
    world; focal_px; centre_px (2,) principal point; lens (k1, k2, p1, p2) in units of half the diagonal;
    pane (thickness, index): its inner face touches the sand; None for no window.
    """

    place_mm: np.ndarray
    turn: np.ndarray
    focal_px: float
    centre_px: np.ndarray
    lens: tuple = (0.0, 0.0, 0.0, 0.0)
    pane: tuple | None = None
    shape: tuple = SHAPE

    def rays(self, ideal_px):
        """Unit directions (N, 3) in the world of places without distortion."""
        inside = np.column_stack([(ideal_px - self.centre_px) / self.focal_px, np.ones(len(ideal_px))])
        world = inside @ self.turn
        return world / np.linalg.norm(world, axis=1, keepdims=True)

    def seen_px(self, ideal_px):
        """Where the lens puts a place without distortion, (N, 2) px; about the principal point."""
        radius = np.hypot(*self.shape) / 2
        x, y = ((ideal_px - self.centre_px) / radius).T
        k1, k2, p1, p2 = self.lens
        r2 = x * x + y * y
        radial = 1 + k1 * r2 + k2 * r2 * r2
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return self.centre_px + radius * np.column_stack([u, v])

    def outside_mm(self, ideal_px):
        """Places (N, 2) on the outer face of the window."""
        ray, thickness = self.rays(ideal_px), self.pane[0] if self.pane else 0.0
        far = (self.place_mm[2] - thickness) / -ray[:, 2]
        return (self.place_mm + far[:, None] * ray)[:, :2]

    def sand_mm(self, ideal_px):
        """Places (N, 2) of the sand."""
        if self.pane is None:
            return self.outside_mm(ideal_px)
        thickness, index = self.pane
        ray = self.rays(ideal_px)
        normal = np.array([0.0, 0.0, 1.0])
        cosine = -ray @ normal
        ratio = 1 / index
        bent = ratio * ray + (ratio * cosine - np.sqrt(1 - ratio**2 * (1 - cosine**2)))[:, None] * normal
        return self.outside_mm(ideal_px) + (thickness / -bent[:, 2])[:, None] * bent[:, :2]

    def ideal_of(self, mm, places=None):
        """Places without distortion that show given places (N, 2) of a plane: inverted by Newton's method."""
        places = places or self.sand_mm
        px = np.tile(self.centre_px, (len(mm), 1)).astype(float)
        for _ in range(50):
            here, h = places(px), 0.5
            columns = [(places(px + h * e) - places(px - h * e)) / (2 * h) for e in np.eye(2)]
            slope = np.stack(columns, axis=-1)
            step = np.linalg.solve(slope, (mm - here)[..., None])[..., 0]
            px = px + step
            if np.abs(step).max() < 1e-11:
                break
        return px

    def photograph(self, mm, places=None):
        """Where the photograph shows places (N, 2) of the sand, or of another plane, px."""
        return self.seen_px(self.ideal_of(np.asarray(mm, float), places))


def made_camera(
    *,
    tilt_deg=(0.0, 0.0),
    roll_deg=0.0,
    distance_mm=800.0,
    share=0.85,
    off_px=(0.0, 0.0),
    lens=(0.0, 0.0, 0.0, 0.0),
    pane=None,
    shape=SHAPE,
):
    """A camera that shows the middle of the window in the middle of its picture, tilted and rolled.

    The blade's tip, the origin, is at the lower left of the window; ``share`` is how much of the picture's
    width the window takes, ``off_px`` how far the principal point lies from the picture's middle.
    """
    a, b, c = np.radians([*tilt_deg, roll_deg])
    about_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    straight = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])  # right, down, into the window
    turn = about_z @ straight @ (about_y @ about_x).T
    middle = np.array([WINDOW_MM[0] / 2 - 10, WINDOW_MM[1] / 2 - 10, 0.0])
    height, width = shape
    return MadeCamera(
        place_mm=middle - distance_mm * turn[2],
        turn=turn,
        focal_px=share * width * distance_mm / WINDOW_MM[0],
        centre_px=np.array([(width - 1) / 2, (height - 1) / 2]) + off_px,
        lens=tuple(lens),
        pane=pane,
        shape=shape,
    )


def window_points(count, rng=None):
    """So many places (N, 2) mm over the window: its corners, then a grid; moved a little where asked."""
    w, h = WINDOW_MM
    if count <= 6:
        unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.4], [0.3, 0.7]])[:count]
    else:
        rows = max(2, round(np.sqrt(count * h / w)))
        columns = -(-count // rows)
        grid = np.stack(np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows)), -1).reshape(-1, 2)
        unit = grid[np.linspace(0, len(grid) - 1, count).round().astype(int)]
    mm = unit * [w, h] - 10.0
    return mm if rng is None else mm + rng.uniform(-3, 3, mm.shape)


def over_window(columns=21, rows=13):
    """A grid (N, 2) mm over the whole window, at which errors are taken."""
    w, h = WINDOW_MM
    grid = np.stack(np.meshgrid(np.linspace(0, w, columns), np.linspace(0, h, rows)), axis=-1)
    return grid.reshape(-1, 2) - 10.0


def photographed(camera, paint, *, blur_px=0.7, noise=2.0, rng=None, places=None, fine=3):
    """A photograph (H, W) uint8 of a painted plane: means over fine x fine exactly mapped samples a pixel.

    ``paint`` gives the brightness (0 to 1) at places (N, 2) mm; ``places`` maps the ideal px to the plane.
    """
    places = places or camera.outside_mm
    height, width = camera.shape
    nodes = [np.arange(-10.0, side + 20.0, 10.0) for side in (height, width)]
    coarse = np.stack(np.meshgrid(nodes[1], nodes[0]), axis=-1).reshape(-1, 2)
    ideal = coarse.copy()
    for _ in range(30):  # the place that the lens moves here
        ideal += coarse - camera.seen_px(ideal)
    mm = places(ideal).reshape(len(nodes[0]), len(nodes[1]), 2)
    rows, columns = ((np.arange(side * fine) + 0.5) / fine - 0.5 for side in (height, width))
    fields = [RectBivariateSpline(*nodes, mm[..., k])(rows, columns) for k in range(2)]
    bright = (
        paint(np.stack(fields, axis=-1).reshape(-1, 2)).reshape(height, fine, width, fine).mean(axis=(1, 3))
    )
    grey = 40 + 170 * gaussian_filter(bright, blur_px)
    if noise:
        grey = grey + (rng or np.random.default_rng(0)).normal(0, noise, grey.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)
