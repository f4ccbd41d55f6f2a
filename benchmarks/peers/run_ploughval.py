"""Measures with ploughval."""

from adaptor import SUBSET, Found, Picture, grid, serve

from ploughval.piv import correlate


def measure(reference: Picture, current: Picture) -> Found:
    """Affine subsets, quintic spline."""
    tracks = correlate(reference, current, grid(reference.shape), subset=SUBSET, order=1, spline=5)
    return Found(tracks.points, tracks.displacement, tracks.valid, tracks.std)


if __name__ == "__main__":
    raise SystemExit(serve("ploughval", measure))
