"""Times come from the right tags and rows, and false ones are named."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos.reading.decode import read_header
from ploughval.photos.reading.exif import ExifTime
from ploughval.photos.series.exif_times import exif_times
from ploughval.photos.series.times import gaps, interval_times, refuse_doubled
from ploughval.photos.series.times_table import table_times
from ploughval.photos.series.whole_seconds import JITTER

PATHS = [Path(f"photos/{k}.jpg") for k in range(6)]


def exif(*seconds, date="2024:05:01 10:00:"):
    return [ExifTime(f"{date}{s:02d}") for s in seconds]


def write_jpeg(path, original=None, subsecond=None, offset=None, digitised="2002:12:08 12:00:00"):
    tags = Image.Exif()
    tags[0x0132] = "2030:01:01 00:00:00"  # DateTime: changed by every editor
    stated = {0x9003: original, 0x9291: subsecond, 0x9011: offset, 0x9004: digitised}
    tags[0x8769] = {tag: value for tag, value in stated.items() if value is not None}
    Image.new("L", (16, 8)).save(path, exif=tags)


def test_date_subsecond_and_zone_come_from_the_exif_ifd_of_a_file(tmp_path):
    write_jpeg(tmp_path / "a.jpg", "2024:05:01 10:00:00", "25", "+02:00")
    write_jpeg(tmp_path / "b.jpg", "2024:05:01 10:00:01", "5 ", "+02:00")
    write_jpeg(tmp_path / "c.jpg", "2024:05:01 09:00:03", "075", "+01:00")
    headers = [read_header(tmp_path / f"{n}.jpg") for n in "abc"]
    result = exif_times([h.tags.time for h in headers], PATHS[:3])
    # rounding of seconds since 1970 in a double: 2.4e-7 s
    np.testing.assert_allclose(result.time_s, [0, 1.25, 2.825], atol=1e-6)
    assert result.faults == {}


def test_a_zone_on_some_photographs_only_is_not_used():
    tags = [ExifTime("2024:05:01 10:00:00", "", "+02:00"), ExifTime("2024:05:01 10:00:07")]
    np.testing.assert_array_equal(exif_times(tags, PATHS[:2]).time_s, [0, 7])


def test_date_digitised_alone_is_no_time(tmp_path):
    write_jpeg(tmp_path / "a.jpg")
    with pytest.raises(DataError, match="none of 1 photographs holds DateTimeOriginal"):
        exif_times([read_header(tmp_path / "a.jpg").tags.time], PATHS[:1])


def test_a_clock_that_stands_still_is_refused():
    with pytest.raises(DataError, match="stood still"):
        exif_times(exif(5, 5, 5), PATHS[:3])


@pytest.mark.parametrize("text", ["", "0000:00:00 00:00:00", "    :  :     :  :  ", "2024-05-01T10:00:00"])
def test_a_photograph_without_usable_tag_is_named_and_the_others_keep_their_times(text):
    result = exif_times([*exif(1, 3), ExifTime(text), *exif(7)], PATHS[:4])
    np.testing.assert_array_equal(result.time_s, [0, 2, np.nan, 6])
    assert list(result.faults) == [2]
    assert "DateTimeOriginal" in result.faults[2]


def test_a_factory_date_within_a_series_is_named_false():
    result = exif_times([*exif(1, 3), ExifTime("2002:12:08 12:00:00"), *exif(7)], PATHS[:4])
    np.testing.assert_array_equal(result.time_s, [0, 2, np.nan, 6])
    assert "false" in result.faults[2]


def test_unreadable_files_have_no_time_and_no_second_fault():
    result = exif_times([None, *exif(3, 4)], PATHS[:3])
    np.testing.assert_array_equal(result.time_s, [np.nan, 0, 1])
    assert result.faults == {}


def test_interval_counts_from_its_start():
    np.testing.assert_allclose(interval_times(3, 10.0, 2.5).time_s, [10, 12.5, 15])


@pytest.mark.parametrize(
    "text",
    [
        "file,time_s\na.png,1.5\nb.png,2\n",
        "\ufefffile,time_s\r\nphotos/a.png,1.5\r\nphotos\\b.png,2\r\n\r\n",
        "time_s;note;file\n1,5;x;a.png\n2;;b.png\n",
        'file, time_s\n"a.png", 1.5\nb.png, 2.0\n',
    ],
)
def test_tables_of_every_kind_give_the_same_times(tmp_path, text):
    (tmp_path / "photos.csv").write_bytes(text.encode())
    result = table_times(tmp_path / "photos.csv", ["photos/b.png", "photos/a.png"])
    np.testing.assert_array_equal(result.time_s, [2.0, 1.5])
    assert result.faults == {}
    assert result.notes == ()


def test_photographs_without_row_are_faults_and_rows_without_photograph_are_missing(tmp_path):
    (tmp_path / "t.csv").write_text("file,time_s\na.png,1\nlost.png,2\n")
    result = table_times(tmp_path / "t.csv", ["a.png", "b.png"])
    assert result.faults == {1: "has no row in t.csv"}
    assert np.isnan(result.time_s[1])
    assert result.missing == ("lost.png",)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("file,time_s\na.png,1\na.png,2\n", r"a\.png \(lines 2, 3\)"),
        ("file,time_s\na.png,soon\nb.png,2\n", "line 2.*soon"),
        ("file,time_s\na.png,nan\nb.png\n", "line 2.*line 3"),
        ("name,seconds\na.png,1\n", "expected file and time_s"),
        ("file,time_s\nx.png,1\n", "names none of the 2"),
        ("", "expected file and time_s"),
    ],
)
def test_a_table_that_cannot_be_used_names_what_is_wrong(tmp_path, text, named):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(DataError, match=named) as caught:
        table_times(tmp_path / "t.csv", ["a.png", "b.png"])
    assert caught.value.path == str(tmp_path / "t.csv")


def test_a_table_that_is_not_text_is_refused(tmp_path):
    (tmp_path / "t.csv").write_bytes(b"file,time_s\n\xff\xfe,1\n")
    with pytest.raises(DataError, match="UTF-8"):
        table_times(tmp_path / "t.csv", ["a.png"])


def test_a_file_of_several_frames_takes_as_many_rows(tmp_path):
    (tmp_path / "t.csv").write_text("file,time_s\nstack.tif,1\nstack.tif,4\n")
    result = table_times(tmp_path / "t.csv", ["stack.tif", "stack.tif"])
    np.testing.assert_array_equal(result.time_s, [1, 4])


def test_two_frames_at_one_time_are_refused_by_name():
    with pytest.raises(DataError, match=r"a\.png and c\.png at 2 s"):
        refuse_doubled(
            np.array([2, 1, 2, np.nan, np.nan]), ["a.png", "b.png", "c.png", "d.png", "e.png"], PATHS[0]
        )


def test_two_photographs_a_second_are_told_apart_by_their_interval():
    paths = [Path(f"{k}.jpg") for k in range(12)]
    result = exif_times(exif(*np.repeat(range(6), 2)), paths)
    np.testing.assert_allclose(np.diff(result.time_s), 0.5, atol=0.05)
    assert result.faults == {}
    # the start is open over half a second, and the interval a little
    np.testing.assert_allclose(result.std_s, 0.25 / np.sqrt(3), rtol=0.35)
    assert "6 photographs share theirs" in result.notes[0]
    # closest: photographs 1 and 10 are more than 4 s apart; widest: 0 and 11 less than 6 s
    assert f"({4 / (9 + 2 * JITTER):.4g} to {6 / (11 - 2 * JITTER):.4g} s)" in result.notes[0]


def test_a_clock_that_stands_still_for_a_while_costs_those_photographs_alone():
    paths = [Path(f"{k}.jpg") for k in range(10)]
    result = exif_times(exif(0, 2, 4, 6, 6, 6, 12, 14, 16, 18), paths)
    np.testing.assert_array_equal(result.time_s, [0, 2, 4, np.nan, np.nan, np.nan, 12, 14, 16, 18])
    assert list(result.faults) == [3, 4, 5]
    assert "the clock stood still from 3.jpg to 5.jpg: 3 photographs" in result.faults[4]


def test_the_second_of_a_pair_with_one_time_is_named():
    paths = [Path(f"{k}.jpg") for k in range(8)]
    result = exif_times(exif(0, 2, 4, 4, 9, 11, 13, 30), paths)
    np.testing.assert_array_equal(result.time_s, [0, 2, 4, np.nan, 9, 11, 13, 30])
    assert result.faults == {
        3: "holds the same time as 2.jpg: a copy of it, or taken within the clock's resolution"
    }


def test_one_copy_among_photographs_a_second_apart_is_no_shorter_interval():
    paths = [Path(f"{k}.jpg") for k in range(13)]
    result = exif_times(exif(0, 1, 2, 3, 4, 4, 5, 6, 7, 8, 9, 10, 11), paths)
    assert list(result.faults) == [5]
    np.testing.assert_array_equal(np.delete(result.time_s, 5), np.arange(12.0))


def test_a_second_that_is_shared_and_one_that_is_passed_over_are_a_steady_series():
    paths = [Path(f"{k}.jpg") for k in range(12)]
    result = exif_times(exif(0, 1, 2, 3, 4, 4, 6, 7, 8, 9, 10, 11), paths)  # 4.0, 4.98, 6.02
    assert result.faults == {}
    np.testing.assert_allclose(np.diff(result.time_s), 1.0, atol=0.02)


def test_a_series_of_shared_times_that_nothing_explains_is_refused():
    with pytest.raises(DataError, match=r"6 of 9 photographs.*no constant interval"):
        exif_times(exif(0, 0, 0, 5, 5, 5, 20, 30, 31), [Path(f"{k}.jpg") for k in range(9)])


def test_standard_uncertainties_are_those_of_the_last_digit():
    tags = [
        ExifTime("2024:05:01 10:00:00"),
        ExifTime("2024:05:01 10:00:02", "5"),
        ExifTime("2024:05:01 10:00:04", "250"),
        ExifTime("soon"),
    ]
    result = exif_times(tags, PATHS[:4])
    np.testing.assert_allclose(result.std_s, np.array([1, 0.1, 0.001, np.nan]) / np.sqrt(12))
    np.testing.assert_array_equal(interval_times(3, 0, 1).std_s, [0, 0, 0])


def test_fractions_without_leading_zeros_are_known_by_the_order_of_names():
    tags = [ExifTime("2024:05:01 10:00:00", text) for text in ("5", "75", "340", "980")]
    result = exif_times(tags, PATHS[:4])
    np.testing.assert_allclose(result.time_s, [0, 0.07, 0.335, 0.975], atol=1e-6)
    assert "without leading zeros" in result.notes[0]


def test_the_end_of_summer_time_within_a_series_is_no_step_where_zones_are_written():
    tags = [
        ExifTime("2024:10:27 02:59:58", "", "+02:00"),
        ExifTime("2024:10:27 02:00:00", "", "+01:00"),
        ExifTime("2024:10:27 02:00:02", "", "+01:00"),
    ]
    np.testing.assert_array_equal(exif_times(tags, PATHS[:3]).time_s, [0, 2, 4])


def test_a_zone_on_some_photographs_is_told():
    tags = [ExifTime("2024:05:01 10:00:00", "", "+02:00"), ExifTime("2024:05:01 10:00:07")]
    assert exif_times(tags, PATHS[:2]).notes == ("1 of 2 photographs hold a time zone: none is used",)


def test_a_clock_that_was_set_within_the_series_is_refused():
    tags = [*exif(1, 3, 5), *exif(1, 3, 5, date="2000:01:01 00:00:")]
    with pytest.raises(DataError, match="3 from 2000:01:01 00:00:01 on, 3 from 2024:05:01 10:00:01 on"):
        exif_times(tags, PATHS)


def test_a_minority_of_photographs_after_a_change_of_battery_is_false():
    tags = [*exif(1, 3, 5, 7), *exif(1, 3, date="2000:01:01 00:00:")]
    result = exif_times(tags, PATHS)
    np.testing.assert_array_equal(result.time_s, [0, 2, 4, 6, np.nan, np.nan])
    assert set(result.faults) == {4, 5}


def series_with(times_s, std_s=0.0):
    return gaps(np.array(times_s), np.full(len(times_s), std_s), [f"{k}.png" for k in range(len(times_s))])


def test_photographs_missing_from_a_regular_series_are_counted():
    (text,) = series_with([0, 2, 4, 6, 12, 14, 16, 18, 20])
    assert text == "6 s pass from 3.png to 4.png, 2 s are usual: 2 photographs may be missing"


def test_a_regular_or_an_irregular_series_has_no_gaps():
    assert series_with(np.arange(20.0)) == []
    assert series_with([0, 1, 5, 6, 14, 20, 21, 40]) == []
    assert series_with([0, 2, 4, 10]) == []  # too few to call regular


def test_whole_seconds_are_no_gaps():
    # every 1.4 s: the stamps step by 1 and 2 s
    assert series_with(np.floor(1.4 * np.arange(30)), 1 / np.sqrt(12)) == []


def test_a_frame_without_time_is_none_that_is_missing():
    assert series_with([0, 2, 4, np.nan, 8, 10, 12, 14, 16, 18]) == []


def test_a_step_of_an_hour_is_one_of_the_clock():
    (text,) = series_with([0, 2, 4, 6, 3608, 3610, 3612, 3614])
    assert "the clock may have been set" in text
