"""Processors and memory of a machine, within the limits of its control groups."""

import os

import pytest

from ploughval.run.many.machine import free_bytes, processors


@pytest.fixture
def bound(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)


def system(root, **files):
    """Files of proc and sys: their names with __ for the strokes, - for dots."""
    for name, text in files.items():
        path = root / name.replace("__", "/").replace("_dot_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


MEMORY = "MemTotal:       16000000 kB\nMemFree:  100 kB\nMemAvailable:    8000000 kB\n"


def test_without_limits_all_processors_that_the_process_is_bound_to_count(bound, tmp_path):
    assert processors(tmp_path) == 8
    assert free_bytes(tmp_path) is None


def test_a_quota_of_a_group_around_ours_counts_rounded_up(bound, tmp_path):
    root = system(
        tmp_path,
        proc__self__cgroup="0::/a/b\n",
        sys__fs__cgroup__a__b__cpu_dot_max="max 100000\n",
        sys__fs__cgroup__a__cpu_dot_max="250000 100000\n",
    )
    assert processors(root) == 3


def test_a_quota_of_the_older_form_counts_too(bound, tmp_path):
    root = system(
        tmp_path,
        proc__self__cgroup="3:cpu,cpuacct:/a\n1:name=systemd:/\n",
        sys__fs__cgroup__cpu__a__cpu_dot_cfs_quota_us="50000\n",
        sys__fs__cgroup__cpu__a__cpu_dot_cfs_period_us="100000\n",
        sys__fs__cgroup__cpu__cpu_dot_cfs_quota_us="-1\n",
        sys__fs__cgroup__cpu__cpu_dot_cfs_period_us="100000\n",
    )
    assert processors(root) == 1


def test_free_memory_is_what_the_system_says_is_available(tmp_path):
    assert free_bytes(system(tmp_path, proc__meminfo=MEMORY)) == 8_000_000 * 1024


@pytest.mark.parametrize("used", [1_500_000_000, 2_600_000_000])
def test_free_memory_is_what_a_group_has_left_and_copies_of_files_count_as_free(tmp_path, used):
    root = system(
        tmp_path,
        proc__meminfo=MEMORY,
        proc__self__cgroup="0::/\n",
        sys__fs__cgroup__memory_dot_max="2000000000\n",
        sys__fs__cgroup__memory_dot_current=f"{used}\n",
        sys__fs__cgroup__memory_dot_stat="anon 1\ninactive_file 500000000\n",
    )
    assert free_bytes(root) == max(2_500_000_000 - used, 0)


def test_a_group_without_a_limit_takes_nothing_away(tmp_path):
    root = system(
        tmp_path,
        proc__meminfo=MEMORY,
        proc__self__cgroup="4:memory:/a\n",
        sys__fs__cgroup__memory__a__memory_dot_limit_in_bytes="9223372036854771712\n",
        sys__fs__cgroup__memory__a__memory_dot_usage_in_bytes="1000\n",
    )
    assert free_bytes(root) == 8_000_000 * 1024


def test_this_machine_has_at_least_one_processor():
    assert 1 <= processors() <= (os.cpu_count() or 1)
