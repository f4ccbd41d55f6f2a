"""What a picture file says about itself without being decoded."""

from dataclasses import dataclass, field

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
