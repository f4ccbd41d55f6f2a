"""Lines of a draft on camera, lens and exposure: comments that ask nothing, less what EXIF tells."""

import tomllib

import numpy as np
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from ploughval.photos.reading.exif import Shot
from ploughval.run.setup.draft import draft_settings
from ploughval.run.setup.draft_equipment import equipment_text
from ploughval.scene_camera import EQUIPMENT, Camera

SHOT = Shot(make="Canon", model='EOS "100D"', exposure_s=0.004)


def test_without_exif_every_key_is_offered_and_none_is_asked():
    text = equipment_text(Shot())
    assert all(f"\n# {key} = " in text for key in EQUIPMENT)
    assert "?" not in text


def test_what_exif_tells_is_said_and_not_offered():
    text = equipment_text(SHOT)
    assert 'EXIF tells make "Canon", model "EOS \\"100D\\"", exposure_s 0.004' in text
    assert "\n# make = " not in text
    assert "\n# lens = " in text


def test_every_line_taken_as_it_stands_with_a_value_is_a_setting():
    lines = [line[2:] for line in equipment_text(Shot()).splitlines() if " = " in line]
    values = ['"words"' if line.endswith("in quotes") else "2.5" for line in lines]
    filled = [line.replace("...", value, 1) for line, value in zip(lines, values, strict=True)]
    given = tomllib.loads("\n".join(filled))
    assert tuple(given) == EQUIPMENT
    camera = Camera.model_validate({"photos": "*.png", "mm_per_px": 1.0, "tip_px": [0.0, 0.0], **given})
    assert camera.aperture == 2.5
    assert camera.note == "words"


def test_the_draft_of_a_folder_holds_what_its_photographs_tell(tmp_path):
    (tmp_path / "photos").mkdir()
    exif = Image.Exif()
    exif[0x010F], exif[0x8769] = "Nikon", {0x829D: IFDRational(8, 1)}
    grey = np.random.default_rng(0).integers(0, 255, (40, 60), dtype=np.uint8)
    for k in range(2):
        Image.fromarray(np.roll(grey, k)).save(tmp_path / "photos" / f"{k}.jpg", exif=exif)
    text = draft_settings(tmp_path)
    assert 'EXIF tells make "Nikon", aperture 8; a key here counts before it' in text
    tomllib.loads(text)
