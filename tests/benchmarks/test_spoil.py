"""Faults do to a folder what their names say, and to nothing else."""

import os
import shutil

import cv2
import numpy as np
import pandas as pd
import pytest

from ploughval.scene import load_scene
from ploughval.synth import load_truth
from sequences import spoil

FRAME = 6


@pytest.fixture
def copy(made_once, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(made_once[0], folder, copy_function=os.link)
    return folder


def pictures(folder):
    return {p.stem: cv2.imread(str(p), cv2.IMREAD_GRAYSCALE) for p in spoil.photos_of(folder)}


def contents(folder):
    return {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def changed(before, after):
    names = sorted(set(before) | set(after))
    return [n for n in names if n not in before or n not in after or not np.array_equal(before[n], after[n])]


@pytest.mark.parametrize(
    ("work", "touched"),
    [
        (spoil.untouched, []),
        (spoil.missing, ["0006"]),
        (spoil.gap, ["0006"]),
        (spoil.truncated, ["0006"]),
        (spoil.doubled, ["0006b"]),
        (spoil.swapped, ["0006", "0007"]),
        (spoil.shuffled, []),
        (spoil.blurred, ["0006"]),
        (spoil.over_exposed, ["0006"]),
        (spoil.hand, ["0006"]),
        (spoil.knocked, [f"{k:04d}" for k in range(6, 12)]),
        (spoil.flickering, [f"{k:04d}" for k in range(12)]),
        (spoil.streaked, [f"{k:04d}" for k in range(12)]),
        (spoil.dirty, [f"{k:04d}" for k in range(12)]),
        (spoil.compressed, [f"{k:04d}" for k in range(12)]),
        (spoil.one_sided, [f"{k:04d}" for k in range(12)]),
    ],
)
def test_a_fault_touches_its_photographs_and_never_the_first_test(made_once, copy, work, touched):
    before, files = pictures(made_once[0]), contents(made_once[0])
    work(copy, FRAME, np.random.default_rng(1))
    assert changed(before, pictures(copy)) == touched
    assert contents(made_once[0]) == files


def test_every_fault_is_in_the_list_once():
    names = [fault.name for fault in spoil.SPOILS]
    assert len(set(names)) == len(names) == 16


def test_lists_of_times_follow_the_files(copy):
    spoil.doubled(copy, FRAME, np.random.default_rng(1))
    table = pd.read_csv(copy / "photos.csv")
    assert len(table) == 13
    assert table["time_s"].is_monotonic_increasing
    spoil.compressed(copy, FRAME, np.random.default_rng(1))
    scene = load_scene(copy)
    listed = set(pd.read_csv(copy / "photos.csv")["file"])
    assert {p.name for p in scene.matches(scene.camera.photos)} == listed


def test_a_knock_moves_the_picture_by_the_knock(made_once, copy):
    spoil.knocked(copy, FRAME, np.random.default_rng(1))
    before, after = pictures(made_once[0])["0009"], pictures(copy)["0009"]
    top, left = round(load_truth(copy).tip_px[1]) - 40, before.shape[1] - 60  # sand that is still at rest
    patch = before[top : top + 36, left : left + 44]
    match = cv2.matchTemplate(after, patch, cv2.TM_CCOEFF_NORMED)
    _, _, _, (x, y) = cv2.minMaxLoc(match)

    def vertex(low, middle, high):
        return (low - high) / (2 * (low - 2 * middle + high))

    found = (
        x + vertex(*match[y, x - 1 : x + 2]) - left,
        y + vertex(*match[y - 1 : y + 2, x]) - top,
    )
    # a parabola through a peak of correlation is good to a tenth of a pixel
    np.testing.assert_allclose(found, spoil.KNOCK_PX, atol=0.1)
