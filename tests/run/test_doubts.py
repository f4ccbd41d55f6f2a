"""Photographs and log that contradict each other are told apart: scale, clocks, single frames."""

import numpy as np
import pandas as pd
import pytest

from ploughval.run.clock import Displacement
from ploughval.run.doubts import doubts, heap_doubts, lean_doubt, outside_log

U = np.linspace(0, 50, 26)
NOISE = np.random.default_rng(4).normal(0, 0.01, len(U))


def displacement(blade, *, scale=1.0, scale_std=0.0005, source="log"):
    apart = float(np.sqrt(np.mean((blade - U) ** 2)))
    return Displacement(U, source, 0.0, 0.0, apart, scale, scale_std)


def test_photographs_that_agree_with_the_log_raise_no_doubt():
    assert doubts(displacement(U + NOISE), U + NOISE, 0.1, 50.0) == []


def test_a_scale_that_is_off_by_one_per_cent_is_said():
    said = doubts(displacement(1.01 * U, scale=1.01), 1.01 * U + NOISE, 0.1, 50.0)
    assert len(said) == 1
    assert "+1.00 %" in said[0]


def test_photographs_outside_the_log_are_counted_with_both_spans():
    u = np.where(U > 40, np.nan, U)
    log = np.array([0.0, 20.0, 40.0])
    said = outside_log(Displacement(u, "log", 100.0, 0.0, 0.0), U + 100.0, log)
    assert len(said) == 1
    assert "5 of 26 photographs lie outside the log" in said[0]
    assert "run from 0 to 50 s, the log from 0 to 40 s: check clock_offset_s" in said[0]


def test_photographs_within_the_log_or_without_time_are_not_counted():
    log = np.array([0.0, 50.0])
    assert outside_log(Displacement(U, "log", 0.0, 0.0, 0.0), U, log) == []
    timeless = np.where(U > 40, np.nan, U)
    assert outside_log(Displacement(timeless, "log", 0.0, 0.0, 0.0), timeless, log) == []


def test_two_photographs_with_each_others_time_are_named():
    blade = U + NOISE
    blade[[12, 13]] = blade[[13, 12]]
    said = doubts(displacement(blade), blade, 0.1, 50.0)
    assert [text.split(":")[0] for text in said] == ["frame 12", "frame 13"]
    assert all("is its time right?" in text for text in said)


def test_clocks_that_are_far_apart_are_said():
    said = doubts(displacement(U + 3.0), U + 3.0 + NOISE, 0.1, 50.0)
    assert len(said) == 1
    assert "clock_offset_s" in said[0]


def test_without_a_log_nothing_contradicts():
    assert doubts(displacement(2 * U, source="photographs"), 2 * U, 0.1, 50.0) == []


def volume(ratio, std_share=0.01):
    swept = 30.0 * U[1:]
    heap = ratio * swept
    columns = {"area_mm2": heap, "swept_mm2": swept, "difference_mm2": heap - swept, "ratio": heap / swept}
    return pd.DataFrame({"frame": range(1, 26), "u_mm": U[1:], **columns, "std_mm2": std_share * swept})


@pytest.mark.parametrize(("ratio", "std_share", "said"), [(1.02, 0.01, 0), (1.2, 0.01, 1), (1.2, 0.1, 0)])
def test_a_heap_is_doubted_when_it_differs_clearly_from_what_was_swept(ratio, std_share, said):
    found = heap_doubts(volume(ratio, std_share))
    assert len(found) == said
    assert all("120 %" in text for text in found)


def test_a_surface_that_is_never_complete_raises_no_doubt():
    assert heap_doubts(volume(1.2).assign(ratio=np.nan)) == []


def test_a_blade_that_leans_is_doubted_and_an_upright_one_is_not():
    assert lean_doubt(0.0) == ""
    assert "leans 7.5 degrees ahead" in lean_doubt(7.5)
    assert "leans 20 degrees back" in lean_doubt(-20.0)
