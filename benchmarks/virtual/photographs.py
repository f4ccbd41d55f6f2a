"""Photographs of a material-point run: sand whose motion no block model made, with an exact truth.

Every particle carries a cluster of grains inside its own cell. The cluster turns and deforms with the
gradient of motion that is fitted to the particle's first neighbours, so that the texture deforms with the
sand and does not tear into particles.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.scene import Soil
from ploughval.synth.options import Purpose, SynthOptions
from ploughval.synth.sand import Canvas, Grains
from ploughval.synth.view import View, expose, light_field

Floats = NDArray[np.float64]

OPTIONS = SynthOptions(seed=7, name="virtual", mm_per_px=0.125, width_mm=1000.0, speed_mm_s=20.0)
SAND = Soil(unit_weight_kN_m3=16.0, peak_friction_deg=50.0, residual_friction_deg=32.0)
PARTS = 3  # photographs for each frame that the run kept: 0.83 mm of travel from one to the next
_NEIGHBOURS = 12
_STRETCH = (0.6, 1.6)  # bounds of a cluster's principal stretches: it stays about its own cell
_TORN = 2.5  # a neighbour this many times as far away as at first no longer counts
_LEFT_MM, _FLOOR_MM, _AIR_MM = 1.0, 0.5, 12.0  # what the frame leaves out of the box, and shows of the air
_DYED_LAYER = 0.4


@dataclass(frozen=True, slots=True)
class VirtualRun:
    """A material-point run in world coordinates: x from the blade's first face, y from its tip, mm.

    Attributes
    ----------
    u_mm : (F,) float64
    places_mm : (F, N, 2) float64
        The same particles in every frame.
    thickness_mm, depth_mm, box_mm : float
        Of the blade; length of the box.
    start_mm : float
        The blade's first face from the corner of the box.
    """

    u_mm: Floats
    places_mm: Floats
    thickness_mm: float
    depth_mm: float
    box_mm: float
    start_mm: float

    def between(self, parts: int) -> "VirtualRun":
        """``parts`` frames for each stored one, particles on straight ways between them."""
        at = np.arange((len(self.u_mm) - 1) * parts + 1) / parts
        low = np.minimum(at.astype(int), len(self.u_mm) - 2)
        share = (at - low)[:, None, None]
        places = (1 - share) * self.places_mm[low] + share * self.places_mm[low + 1]
        return replace(self, u_mm=np.interp(at, np.arange(len(self.u_mm)), self.u_mm), places_mm=places)


def read_run(folder: Path, name: str = "mpm_d30_s2") -> VirtualRun:
    """The run's frames; the last one is left out where it repeats the one before."""
    meta = json.loads((folder / f"{name}_meta.json").read_text(encoding="utf-8"))
    with np.load(folder / f"{name}_frames.npz") as data:
        u_mm = 1e3 * data["u"].astype(np.float64)
        front, thickness, tip = 1e3 * data["blade"][0].astype(np.float64)
        places = 1e3 * data["xy"].astype(np.float64) - np.array([front, tip])
    new = np.concatenate([[True], np.diff(u_mm) > 1e-3])
    depth = 1e3 * meta["depth"]
    return VirtualRun(u_mm[new], places[new], float(thickness), depth, 1e3 * meta["L"], float(front))


def view_of(run: VirtualRun, scale: float) -> View:
    """The frame: the whole box but its rim, from the floor to above the highest sand."""
    left = (run.start_mm - _LEFT_MM) / scale
    top = (float(run.places_mm[..., 1].max()) + _AIR_MM) / scale
    width = int((run.box_mm - 2 * _LEFT_MM) / scale)
    height = int(top + (-float(run.places_mm[0, :, 1].min()) - _FLOOR_MM) / scale)
    return View((height, width), (round(left, 1), round(top, 1)), scale)


@dataclass(frozen=True, slots=True)
class Clusters:
    """Grains fixed to particles.

    Attributes
    ----------
    owner : (G,) int
        Particle of each grain.
    offset_mm : (G, 2) float64
        Place in the particle's first surroundings.
    grains : Grains
        Radii, areas and greys; the positions are not used.
    neighbours : (N, K) int
    """

    owner: NDArray[np.int64]
    offset_mm: Floats
    grains: Grains
    neighbours: NDArray[np.int64]

    def places(self, first_mm: Floats, now_mm: Floats) -> Floats:
        """Grains when the particles have moved from ``first_mm`` to ``now_mm``: (G, 2) mm."""
        every = np.arange(len(first_mm))
        carried = bounded(gradients(first_mm, now_mm, self.neighbours, every))
        return now_mm[self.owner] + np.einsum("gij,gj->gi", carried[self.owner], self.offset_mm)


def put_grains(rng: np.random.Generator, run: VirtualRun, options: SynthOptions) -> Clusters:
    """Grains in the square cell of each particle, as dense and as grey as synthetic sand elsewhere."""
    first = run.places_mm[0]
    near = neighbours_of(first)
    cell = float(np.median(np.linalg.norm(first[near[:, 0]] - first, axis=1)))
    each = max(round((cell / (options.mm_per_px * options.spacing_px)) ** 2), 1)
    owner = np.repeat(np.arange(len(first)), each)
    count = len(owner)
    low, high = options.diameter_px
    diameters = rng.uniform(low, high, count)
    greys = rng.uniform(*options.grain_grey, count)
    greys = np.where(rng.random(count) < 0.15, rng.uniform(20.0, 40.0, count), greys)
    offsets = (rng.random((count, 2)) - 0.5) * cell
    height = first[owner, 1] + offsets[:, 1]
    for layer in options.layers_mm:
        greys[np.abs(height - layer) <= options.layer_thickness_mm / 2] *= _DYED_LAYER
    share = (cell / options.mm_per_px) ** 2 / each
    areas = share * diameters**2 / ((low * low + low * high + high * high) / 3)
    return Clusters(owner, offsets, Grains(offsets, diameters / 2, areas, greys), near)


def neighbours_of(first_mm: Floats) -> NDArray[np.int64]:
    """The first neighbours of each particle, (N, K)."""
    _, near = cKDTree(first_mm).query(first_mm, k=_NEIGHBOURS + 1)
    return np.asarray(near[:, 1:], dtype=np.int64)


def gradients(
    first_mm: Floats, now_mm: Floats, neighbours: NDArray[np.int64], at: NDArray[np.int64]
) -> Floats:
    """Gradient of motion at particles ``at`` by least squares over neighbours still near: (M, 2, 2)."""
    before = first_mm[neighbours[at]] - first_mm[at][:, None]
    after = now_mm[neighbours[at]] - now_mm[at][:, None]
    near = np.linalg.norm(after, axis=-1) < _TORN * np.linalg.norm(before, axis=-1)
    weighed = near[..., None] * before
    moment = np.swapaxes(weighed, 1, 2) @ before
    mixed = np.swapaxes(after, 1, 2) @ weighed
    poor = (near.sum(axis=1) < 4) | (np.linalg.det(moment) < 1e-6)
    moment[poor], mixed[poor] = np.eye(2), np.eye(2)
    return mixed @ np.linalg.inv(moment)


def bounded(gradient: Floats) -> Floats:
    """The same turns with principal stretches kept within bounds."""
    left, stretch, right = np.linalg.svd(gradient)
    return (left * np.clip(stretch, *_STRETCH)[:, None, :]) @ right


def make_virtual_folder(
    folder: Path, run: VirtualRun, options: SynthOptions = OPTIONS, *, told: Soil = SAND, start_s: float = 0.0
) -> View:
    """Write photographs, photos.csv and test.toml of a run that starts at ``start_s``."""
    view = view_of(run, options.mm_per_px)
    clusters = put_grains(options.rng(Purpose.GRAINS), run, options)
    grains = clusters.grains
    canvas = Canvas(grains.radii_px, grains.areas_px * (grains.greys - options.air_grey), view.shape)
    light = light_field(view.shape, vignetting=options.vignetting, gradient=options.gradient)
    (folder / "photos").mkdir(parents=True, exist_ok=True)
    names = [f"{frame:04d}.png" for frame in range(len(run.u_mm))]
    for frame, (name, u) in enumerate(zip(names, run.u_mm, strict=True)):
        places = clusters.places(run.places_mm[0], run.places_mm[frame])
        picture = canvas.draw(view.to_px(places)) + np.float32(options.air_grey)
        cover = view.blade_cover(float(u), run.thickness_mm)
        picture += cover * (np.float32(options.blade_grey) - picture)
        noise = options.rng(Purpose.NOISE, frame)
        levels = expose(picture * light, noise, noise_grey=options.noise_grey, bit_depth=8)
        cv2.imwrite(str(folder / "photos" / name), levels)
    times = pd.DataFrame({"file": names, "time_s": (start_s + run.u_mm / options.speed_mm_s).round(6)})
    times.to_csv(folder / "photos.csv", index=False, lineterminator="\n")
    (folder / "test.toml").write_text(_settings(run, view, options, told), encoding="utf-8")
    return view


def _settings(run: VirtualRun, view: View, options: SynthOptions, told: Soil) -> str:
    soil = "\n".join(f"{key} = {value!r}" for key, value in told.model_dump(exclude_defaults=True).items())
    return f"""\
[test]
name = "material points"

[blade]
depth_mm = {run.depth_mm}
width_mm = {options.width_mm}
thickness_mm = {run.thickness_mm:.6g}
speed_mm_s = {options.speed_mm_s}

[box]
length_mm = {run.box_mm - run.start_mm:.6g}

[soil]
{soil}

[camera]
photos = "photos/*.png"
times = "photos.csv"
mm_per_px = {view.mm_per_px}
tip_px = [{view.tip_px[0]}, {view.tip_px[1]}]
direction = "right"

[tracers]
layers_mm = {list(options.layers_mm)}
dyed = true
thickness_mm = {options.layer_thickness_mm}
"""
