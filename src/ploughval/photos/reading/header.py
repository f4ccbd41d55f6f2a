"""What a picture file says about itself without being decoded."""

from dataclasses import dataclass, field

from ploughval.limits import PICTURE_PIXELS, PICTURE_SIDE_PX, SAMPLE_BYTES, size_in_words
from ploughval.photos.reading.exif import Tags


@dataclass(frozen=True, slots=True)
class Header:
    """Size, depth, pictures and tags of a file.

    shape (H, W) as stored, bits a sample (8 or 16), indices of its full pictures, EXIF tags, the time of each
    picture of a video or an animation since the first, s (empty where there is none), and notes on the file.
    """

    shape: tuple[int, int]
    bits: int = 8
    pages: tuple[int, ...] = (0,)
    tags: Tags = field(default_factory=Tags)
    page_time_s: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


def refuse_large_shape(width: int, height: int) -> None:
    """Raise ValueError for a picture of more pixels than are decoded, by what its header says."""
    if width * height > PICTURE_PIXELS or max(width, height) > PICTURE_SIDE_PX:
        raise ValueError(
            f"it says that it is {width} x {height} px; expected at most {PICTURE_PIXELS // 1_000_000} "
            f"million px and {PICTURE_SIDE_PX} px a side. Crop it, or take it out"
        )


def refuse_samples(width: int, height: int, samples: int, held: int) -> None:
    """Raise ValueError for a picture that would be unpacked to too many bytes.

    ``samples`` a pixel, alpha among them, for each of which the decoder holds ``held`` bytes.
    """
    whole = width * height * samples * held
    if whole > SAMPLE_BYTES:
        raise ValueError(
            f"it unpacks to {size_in_words(whole)} with {samples} samples a pixel; expected at most "
            f"{size_in_words(SAMPLE_BYTES)}. Save it as grey, with 8 bits a sample, or crop it"
        )
