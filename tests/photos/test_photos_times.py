"""Times come from the right tags and rows, and false ones are named."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos.decode import read_header
from ploughval.photos.exif import ExifTime
from ploughval.photos.exif_times import exif_times
from ploughval.photos.times import interval_times, refuse_doubled
from ploughval.photos.times_table import table_times

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
