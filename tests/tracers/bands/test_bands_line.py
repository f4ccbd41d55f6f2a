"""fit_line, outcrop and divide on their own, against closed forms."""

import numpy as np
import pandas as pd
import pytest

from ploughval.tracers.episodes import divide
from ploughval.tracers.increment import Motion, cells_of
from ploughval.tracers.line import fit_line
from ploughval.tracers.mechanism import Mechanism, judge
from ploughval.tracers.outcrop import outcrop

NONE = np.empty((0, 2))


def motion_of(place, beta_deg, *, lost=NONE, std=0.005, travel=0.2, reach=4.0, noise=0.0, seed=0):
    """Points of two rigid blocks divided at an angle."""
    moving = place[:, 1] > place[:, 0] * np.tan(np.radians(beta_deg))
    rate = np.outer(moving, [1.0, np.tan(np.radians(beta_deg))])
    rate = rate + np.random.default_rng(seed).normal(0, noise, rate.shape)
    return Motion(place, rate, np.full(len(place), std), lost, travel, reach)


def grid(spacing=2.0, far=100.0, top=30.0):
    return np.stack(
        np.meshgrid(np.arange(1.0, far, spacing), np.arange(-6.0, top, spacing)), axis=-1
    ).reshape(-1, 2)


@pytest.mark.parametrize("beta", [14.0, 20.0, 31.3, 48.0])
def test_block_and_line_are_found(beta):
    """Points leave the line free between two rays; beyond those it may be by a fifteenth of a degree."""
    place = grid()
    line = fit_line(motion_of(place, beta, noise=0.005))
    rays = np.degrees(np.arctan2(place[:, 1], place[:, 0]))
    below, above = rays[rays < beta].max(), rays[rays > beta].min()
    assert above - below < 0.6
    assert below - 0.06 < line.beta_deg < above + 0.06
    assert line.velocity == pytest.approx([1.0, np.tan(np.radians(beta))], abs=0.003)
    assert abs(line.velocity[1] - np.tan(np.radians(beta))) < 4 * line.velocity_std[1]


def test_between_two_clean_rays_the_posterior_is_flat():
    """Points on rays at 18 and 22 degrees, and beyond: the line is anywhere between, an even distribution."""
    along = np.arange(30.0, 80.0, 1.0)
    rays = [np.outer(along, [np.cos(a), np.sin(a)]) for a in np.radians([10.0, 18.0, 22.0, 35.0, 60.0])]
    line = fit_line(motion_of(np.concatenate(rays), 20.0, reach=0.05, travel=0.01))
    assert line.beta_deg == pytest.approx(20.0, abs=0.15)
    posterior = np.sqrt(line.std_deg**2 - line.shared_std_deg**2)
    # 4 degrees over sqrt(12), less the width of the change on either side, which is next to nothing here
    assert posterior == pytest.approx(4.0 / np.sqrt(12.0), rel=0.08)


def test_lost_points_place_the_line_in_a_gap_without_vectors():
    place = grid()
    angle = np.degrees(np.arctan2(place[:, 1], place[:, 0]))
    seen = (angle < 19.0) | (angle > 36.0)
    along = np.arange(5.0, 75.0, 3.0)
    torn = np.outer(along, [np.cos(np.radians(21.0)), np.sin(np.radians(21.0))])
    blind = fit_line(motion_of(place[seen], 21.0))
    told = fit_line(motion_of(place[seen], 21.0, lost=torn))
    assert blind.std_deg > 3.0  # 17 degrees over sqrt(12), less what the points at its edges are worth
    assert told.beta_deg == pytest.approx(21.0, abs=0.5)
    assert told.std_deg < 1.0


def test_scale_does_not_matter():
    one = fit_line(motion_of(grid(), 25.0, noise=0.01))
    place = 7.0 * grid()
    other = fit_line(
        Motion(place, motion_of(grid(), 25.0, noise=0.01).rate, np.full(len(place), 0.005), NONE, 1.4, 28.0)
    )
    assert other.beta_deg == pytest.approx(one.beta_deg, abs=1e-6)
    assert other.std_deg == pytest.approx(one.std_deg, rel=1e-6)


def test_nothing_that_moves_is_no_line_and_still():
    motion = motion_of(grid(), 89.9, noise=0.01)
    assert fit_line(motion) is None
    assert judge(motion, None, resolved=True).mechanism is Mechanism.STILL
    assert judge(motion, None, resolved=False).mechanism is None


def test_strays_do_not_move_the_line():
    rng = np.random.default_rng(3)
    clean = motion_of(grid(), 25.0)
    rate = clean.rate.copy()
    stray = rng.random(len(rate)) < 0.15
    rate[stray] = rng.uniform(-2, 2, (stray.sum(), 2))
    wild = Motion(clean.place, rate, clean.std, NONE, clean.travel_mm, clean.reach_mm)
    assert fit_line(wild).beta_deg == pytest.approx(fit_line(clean).beta_deg, abs=0.3)


def test_two_bands_active_together_are_told_with_evidence():
    place = grid()
    both = motion_of(place, 18.0).rate * 0.5 + motion_of(place, 35.0).rate * 0.5
    motion = Motion(place, both, np.full(len(place), 0.01), NONE, 1.0, 4.0)
    verdict = judge(motion, fit_line(motion), resolved=True)
    assert verdict.mechanism is Mechanism.TWO_BANDS
    assert verdict.evidence > 20.0
    assert verdict.spread_deg == pytest.approx((35.0 - 18.0) / 2, abs=2.0)


def test_outcrop_on_a_slope_and_its_derivative():
    """Surface y = 30 + 0.1 x, line of 30 degrees from a tip at 5: x (tan b - 0.1) = 30 + 5 tan b."""
    x = np.arange(6.0, 200.0, 3.0)
    line = np.column_stack([x, 30.0 + 0.1 * x, np.full(len(x), 0.2)])

    def exact(beta_deg):
        slope = np.tan(np.radians(beta_deg))
        return (30.0 + 5.0 * slope) / (slope - 0.1)

    at, per_degree, std = outcrop(line, 5.0, 30.0)
    assert at == pytest.approx(exact(30.0), abs=1e-9)
    assert per_degree == pytest.approx(-(exact(30.01) - exact(29.99)) / 0.02, rel=1e-3)
    assert std == pytest.approx(0.2 / (np.tan(np.radians(30.0)) - 0.1), rel=1e-9)
    assert np.isnan(outcrop(line[:5], 5.0, 10.0)).all()
    assert np.isnan(outcrop(np.empty((0, 3)), 5.0, 10.0)).all()


def table_of(outcrops, std=0.3, du=1.0):
    x = np.asarray(outcrops, float)
    u = np.arange(len(x)) * du
    return pd.DataFrame(
        {
            "u_mm": u,
            "du_mm": du,
            "outcrop_x_mm": x,
            "outcrop_std_mm": std,
            "outcrop_own_mm": std,
            "outcrop_shared_mm": 0.1,
            "outcrop_y_mm": 30.0,
            "slip_mm": du,
        }
    )


@pytest.mark.parametrize(
    ("outcrops", "starts"),
    [
        ([80.0] * 12, [0]),
        ([80.0] * 6 + [120.0] * 6, [0, 6]),
        ([80.0] * 6 + [97.0] + [120.0] * 6, [0, 6]),  # a switch within an increment
        ([80.0] * 6 + [140.0] + [80.0] * 6, [0]),  # one bad increment
        ([80.0] * 6 + [np.nan] * 3 + [80.0] * 6, [0]),
        ([60.0 + 3.0 * k for k in range(15)], [0]),  # creeps on
        ([60.0 + 6.0 * np.sqrt(k) for k in range(15)], [0]),  # creeps on, ever slower
        ([80.0] * 4 + [80.0 - 8.0] * 6, [0]),  # back: no new band
        ([np.nan] * 5, []),
    ],
)
def test_only_a_lasting_jump_ahead_starts_a_band(outcrops, starts):
    rows = divide(table_of(outcrops), least_slip_mm=None, depth_mm=30.0)
    assert [int(episode.rows[0]) for episode in rows] == starts


def test_what_increments_share_does_not_average_out():
    many = divide(table_of([80.0] * 40), least_slip_mm=None, depth_mm=30.0)[0]
    assert many.outcrop_std_mm == pytest.approx(np.hypot(0.3 / np.sqrt(40), 0.1), rel=1e-6)


def test_cells_are_counted_as_by_unique_pairs():
    place = np.random.default_rng(0).uniform(-20, 30, (500, 2))
    count, own = cells_of(place, 4.0)
    pairs, twin = np.unique(np.floor(place / 4.0), axis=0, return_inverse=True)
    assert count == len(pairs)
    np.testing.assert_array_equal(own, twin.ravel())
