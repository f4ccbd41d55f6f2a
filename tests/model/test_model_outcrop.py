"""The switches of the band in the limit of small increments (docs/theory-model-outcrop.md).

No code is shared with the march: surfaces are terraces with one front each, one height obeys an ordinary
differential equation, and a band is relieved where its force meets the price of a fresh one. Lengths in
depths, forces over unit weight d^2 / 2; the mobilization length is zero.
"""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ploughval.model import simulate
from ploughval.scene import Scene


@dataclass
class Sand:
    """Tangents of peak and residual friction, wall friction and slope of repose."""

    peak: float
    residual: float
    wall: float
    repose: float
    fresh: tuple[float, float, float] = field(init=False)

    def __post_init__(self):
        keep = 1.0 - self.peak * self.wall
        lean = (self.peak + self.wall) / keep
        self.fresh = (np.hypot(1.0, self.wall) / keep, lean, 1.0 + lean * self.peak)

    def price(self, m):
        """Eq. (3)."""
        scale, lean, rest = self.fresh
        return scale * (np.sqrt(self.peak * (lean + 2.0 * m)) + np.sqrt(rest)) ** 2

    def outcrop(self, m):
        """Eq. (4)."""
        _, lean, rest = self.fresh
        return m + lean + np.sqrt((lean + 2.0 * m) * rest / self.peak)

    def steepness(self, u, rise, base, outcrop):
        """tan beta by Eq. (7)."""
        return (1.0 + 0.5 * rise + self.repose * (u - base) / rise) / (outcrop - u) - self.repose

    def softened(self, u, slope, outcrop):
        """Eq. (9): force of the band in force."""
        above = slope * (outcrop - u) - 1.0
        area = outcrop - above**2 / (2.0 * self.repose) - 0.5 * (outcrop - u) * (1.0 + above)
        free = 1.0 - self.residual * self.wall - slope * (self.residual + self.wall)
        if free <= 0.0:
            return 1e9
        return 2.0 * area * (slope + self.residual) * np.hypot(1.0, self.wall) / free

    def crest(self, u, rise, base):
        """Distance of the front's crest from the blade, Eq. (6)."""
        return (u - base - rise**2 / (2.0 * self.repose)) / rise


def sand(peak, residual, *, repose=32.0, wall=0.0):
    return Sand(*np.tan(np.radians([peak, residual, wall, repose])))


def next_switch(soil, start, terraces):
    """Travel to the switch that ends a band; terraces: (rise, base, foot ahead of the blade)."""
    outcrop, base = soil.outcrop(start), start
    reach = outcrop - start
    flat, w = 1.0 / reach, 1e-6
    gain = flat * (flat + soil.repose) / (2.0 * flat + soil.repose)
    u, rise = start + w, flat * w + (gain + flat) / (2.0 * reach) * w**2  # Eq. (8)
    while True:
        foot = terraces[-1][2] if terraces else -1.0
        events = [
            lambda u, y, base=base: (
                soil.price(u) - soil.softened(u, soil.steepness(u, y[0], base, outcrop), outcrop)
            ),
            lambda u, y, base=base, foot=foot: soil.crest(u, y[0], base) - foot,
        ]
        for event in events:
            event.terminal, event.direction = True, -1
        found = solve_ivp(
            lambda u, y, base=base: [soil.steepness(u, y[0], base, outcrop)],
            (u, outcrop - 1e-3),
            [rise],
            events=events,
            rtol=1e-9,
            atol=1e-12,
        )
        u, rise = found.t[-1], found.y[0, -1]
        if found.t_events[0].size:
            return u, (rise, base, soil.crest(u, rise, base) + rise / soil.repose)
        before, base, _ = terraces.pop()  # the older front is reached: both are one slope from here on
        rise += before


def switches(soil, count):
    """u, P / P0 and the new outcrop at the first switches."""
    u, terraces, found = 0.0, [], []
    for _ in range(count):
        u, terrace = next_switch(soil, u, terraces)
        terraces.append(terrace)
        assert soil.outcrop(u) > u + terrace[2]  # beyond the foot of the heap, as Eq. (1) asks
        found.append((u, soil.price(u) / soil.price(0.0), soil.outcrop(u)))
    return np.array(found)


REFERENCE = [
    ((50.0, 32.0), {}, [(1.290, 1.790, 5.249), (3.270, 2.792, 8.424)]),
    ((50.0, 32.0), {"repose": 50.0}, [(1.240, 1.763, 5.163), (3.159, 2.739, 8.256)]),
    ((50.0, 32.0), {"wall": 10.0}, [(1.882, 1.828, 7.373)]),
]


@pytest.mark.parametrize(("angles", "more", "expected"), REFERENCE)
def test_equation_of_the_front_gives_the_reference_switches(angles, more, expected):
    found = switches(sand(*angles, **more), len(expected))
    np.testing.assert_allclose(found, expected, atol=0.001)


def test_equation_of_the_front_gives_the_reference_switches_of_loose_sand():
    found = switches(sand(36.0, 32.0), 4)
    np.testing.assert_allclose(found[:, 0], (0.391, 0.953, 1.702, 2.647), atol=0.002)
    np.testing.assert_allclose(found[:, 1], (1.353, 1.781, 2.288, 2.875), atol=0.002)


def test_outcrop_beside_the_best_moves_the_first_switch_by_three_quarters_of_its_distance(monkeypatch):
    # docs/theory-model-nodes.md, Eq. (4)
    soil, best = sand(50.0, 32.0), Sand.outcrop

    def first_switch(beside):
        monkeypatch.setattr(Sand, "outcrop", lambda own, m: best(own, m) + beside)
        return next_switch(soil, 0.0, [])[0]

    assert (first_switch(0.01) - first_switch(-0.01)) / 0.02 == pytest.approx(0.74, abs=0.005)


def test_trough_after_a_softening_over_a_thirtieth_of_the_depth_is_the_reference():
    soil = sand(50.0, 32.0)
    outcrop = soil.outcrop(0.0)

    def rates(u, state):
        slope = soil.steepness(u, state[0], 0.0, outcrop)
        return [slope, np.hypot(1.0, slope)]

    def softens(_, state):
        return state[1] - 1.0 / 30.0

    softens.terminal = True
    u = 1e-6
    found = solve_ivp(rates, (u, 1.0), [u / outcrop, u], events=softens, rtol=1e-9, atol=1e-12)
    u, rise = found.t[-1], found.y[0, -1]
    trough = soil.softened(u, soil.steepness(u, rise, 0.0, outcrop), outcrop) / soil.price(0.0)
    assert trough == pytest.approx(0.4735, abs=5e-5)


def scene(peak, residual, *, repose=32.0, wall=0.0, outcrop="stationary"):
    soil = {
        "unit_weight_kN_m3": 16.0,
        "peak_friction_deg": peak,
        "residual_friction_deg": residual,
        "mobilization_length_mm": 0.003,
        "repose_deg": repose,
        "wall_friction_deg": wall,
    }
    blade = {"depth_mm": 30.0, "width_mm": 1000.0}
    return Scene.model_validate(
        {"test": {"name": "front"}, "blade": blade, "soil": soil, "model": {"outcrop": outcrop}}
    )


@pytest.mark.parametrize(
    ("angles", "more"),
    [
        ((50.0, 32.0), {}),
        ((50.0, 32.0), {"wall": 10.0}),
        ((36.0, 32.0), {}),
        ((42.0, 30.0), {"repose": 38.0}),
    ],
)
def test_march_converges_to_the_equation_of_the_front(angles, more):
    expected = switches(sand(*angles, **more), 3)
    run = simulate(scene(*angles, **more), displacement_mm=30.0 * (expected[-1, 0] + 0.1), tolerance=5e-5)
    bands = run.bands.iloc[1:4]
    force = np.interp(bands["u_start_mm"] - 1e-9, run.force["u_mm"], run.force["force_N"]) / run.P0_N
    places = np.column_stack([bands["u_start_mm"], bands["outcrop_x_mm"]]) / 30.0
    np.testing.assert_allclose(places, expected[:, [0, 2]], atol=5e-4)
    np.testing.assert_allclose(force, expected[:, 1], atol=5e-4)


def test_all_peaks_lie_on_the_price_of_a_fresh_band_whatever_ends_the_teeth():
    # Eqs (3) and (4) hold neither residual friction nor repose: two sands that switch at other places
    for residual, repose in ((28.0, 28.0), (40.0, 45.0)):
        run = simulate(scene(50.0, residual, repose=repose), displacement_mm=120.0, tolerance=2e-4)
        starts = run.bands["u_start_mm"].to_numpy()[1:]
        assert len(starts) >= 2
        soil = sand(50.0, residual, repose=repose)
        rows = np.searchsorted(run.force["u_mm"], starts)
        force = run.force["force_N"].to_numpy()[rows] / run.P0_N
        np.testing.assert_allclose(force, soil.price(starts / 30.0) / soil.price(0.0), rtol=1e-3)
        np.testing.assert_allclose(
            run.bands["outcrop_x_mm"][1:] / 30.0, soil.outcrop(starts / 30.0), rtol=1e-3
        )


def test_heap_that_lies_flatter_than_it_reaches_brings_its_peaks_below_the_price_on_level_ground():
    soil = sand(50.0, 32.0, repose=10.0)
    assert soil.repose < soil.peak / (1.0 + soil.peak**2)
    run = simulate(scene(50.0, 32.0, repose=10.0), displacement_mm=120.0, tolerance=5e-4)
    starts = run.bands["u_start_mm"].to_numpy()[1:3]
    rows = np.searchsorted(run.force["u_mm"], starts)
    force = run.force["force_N"].to_numpy()[rows] / run.P0_N
    travel = starts / 30.0
    np.testing.assert_allclose(force * soil.price(0.0) / soil.price(travel), [1.0, 0.975], atol=1e-3)
    beyond = soil.outcrop(travel) - travel > np.sqrt(2.0 * travel / soil.repose)  # of the shortest heap
    np.testing.assert_array_equal(beyond, [True, False])
    assert run.bands["outcrop_x_mm"].to_numpy()[2] / 30.0 < 0.98 * soil.outcrop(travel[1])


def riding(soil):
    """Where the outcrop rides: travel to the first switch, or to where the crest comes to the blade."""
    reach = soil.outcrop(0.0)

    def slope(u, rise):
        return soil.steepness(0.0, rise, -u, reach)

    events = [
        lambda u, y: soil.price(u) - soil.softened(u, slope(u, y[0]), u + reach),
        lambda u, y: soil.crest(u, y[0], 0.0),
    ]
    for event in events:
        event.terminal, event.direction = True, -1
    found = solve_ivp(lambda u, y: [slope(u, y[0])], (1e-6, 20.0), [1e-6 / reach], events=events, rtol=1e-9)
    switch, crest = (times[0] if times.size else None for times in found.t_events)
    return switch, crest


def riding_later(soil, crest):
    """First switch where the heap is one slope from the blade on, Eq. (12)."""
    reach = soil.outcrop(0.0)

    def gap(u):
        height = np.sqrt(2.0 * soil.repose * u)
        return soil.price(u) - soil.softened(u, (1.0 + height - soil.repose * reach) / reach, u + reach)

    return brentq(gap, crest, 2.0 * crest)


def test_outcrop_that_rides_puts_the_first_switch_of_loose_sand_off():
    assert riding(sand(36.0, 32.0))[0] == pytest.approx(1.00, abs=0.005)


def test_outcrop_that_rides_puts_the_first_switch_of_dense_sand_off_by_depths():
    soil = sand(50.0, 32.0)
    switch, crest = riding(soil)
    assert switch is None
    assert crest == pytest.approx(5.17, abs=0.005)
    expected = riding_later(soil, crest)
    assert expected == pytest.approx(7.5, abs=0.05)
    run = simulate(scene(50.0, 32.0, outcrop="riding"), displacement_mm=240.0, tolerance=1e-3)
    assert run.bands["u_start_mm"].iloc[1] / 30.0 == pytest.approx(expected, rel=0.002)
