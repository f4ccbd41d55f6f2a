"""VTK's XML files: points with vertices or polylines and the arrays on them, and series of such files.

The format is that of the VTK File Formats guide: PolyData, arrays inline, each one block packed by zlib.
"""

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64] | NDArray[np.int64]
_TYPES = {"f": ("Float64", "<f8"), "i": ("Int64", "<i8")}
_FILE: dict[str, str] = {"version": "1.0", "byte_order": "LittleEndian", "header_type": "UInt64"}


@dataclass(frozen=True, slots=True)
class Lines:
    """Polylines in the plane, and arrays on them.

    Attributes
    ----------
    points : (N, 2) float, mm
    counts : (K,) int
        Points of each line; they follow each other. A line of one point becomes a vertex.
    on_points : mapping of str to (N,) or (N, C) array
    on_lines : mapping of str to (K,) array
    about : mapping of str to float
        What holds for the whole file.
    """

    points: NDArray[np.float64]
    counts: NDArray[np.int64]
    on_points: Mapping[str, Array] = field(default_factory=dict)
    on_lines: Mapping[str, Array] = field(default_factory=dict)
    about: Mapping[str, float] = field(default_factory=dict)


def poly_data(lines: Lines) -> bytes:
    """A .vtp file.

    Parameters
    ----------
    lines : Lines
        Of finite points.
    """
    single = lines.counts == 1
    starts = np.cumsum(lines.counts) - lines.counts
    long = np.flatnonzero(~single)
    ordered = np.concatenate([np.flatnonzero(single), long])  # as VTK numbers cells: vertices come first
    piece = {"NumberOfPoints": len(lines.points), "NumberOfVerts": single.sum(), "NumberOfLines": len(long)}
    told = {"type": "PolyData", **_FILE, "compressor": "vtkZLibDataCompressor"}
    root = ElementTree.Element("VTKFile", told)
    data = ElementTree.SubElement(root, "PolyData")
    about = ElementTree.SubElement(data, "FieldData")
    for name, value in lines.about.items():
        _array(about, name, np.array([value]), NumberOfTuples="1")
    body = ElementTree.SubElement(data, "Piece", {name: str(int(count)) for name, count in piece.items()})
    place = np.column_stack([lines.points, np.zeros(len(lines.points))])
    _array(ElementTree.SubElement(body, "Points"), "Points", place)
    _cells(ElementTree.SubElement(body, "Verts"), starts[single], np.ones(int(single.sum()), np.int64))
    _cells(ElementTree.SubElement(body, "Lines"), starts[long], lines.counts[long])
    for element, arrays in (("PointData", lines.on_points), ("CellData", lines.on_lines)):
        parent = ElementTree.SubElement(body, element)
        for name, values in arrays.items():
            _array(parent, name, values if element == "PointData" else values[ordered])
    return _file(root)


def collection(files: Mapping[int, str]) -> bytes:
    """A .pvd file: the file of each time step, paths as seen from it."""
    root = ElementTree.Element("VTKFile", {"type": "Collection", **_FILE})
    series = ElementTree.SubElement(root, "Collection")
    for step, path in sorted(files.items()):
        ElementTree.SubElement(series, "DataSet", timestep=str(step), group="", part="0", file=path)
    return _file(root)


def _cells(parent: ElementTree.Element, starts: NDArray[np.int64], counts: NDArray[np.int64]) -> None:
    """Cells of consecutive points."""
    ends = np.cumsum(counts)
    _array(parent, "connectivity", np.arange(counts.sum()) + np.repeat(starts - ends + counts, counts))
    _array(parent, "offsets", ends)


def _array(parent: ElementTree.Element, name: str, values: Array, **told: str) -> None:
    kind, stored = _TYPES["f" if values.dtype.kind == "f" else "i"]
    told = {"type": kind, "Name": name, "format": "binary", **told}
    if values.ndim == 2:
        told["NumberOfComponents"] = str(values.shape[1])
    ElementTree.SubElement(parent, "DataArray", told).text = _encoded(values.astype(stored).tobytes())


def _encoded(raw: bytes) -> str:
    """One packed block after its head: number of blocks, size of a block, of a partial last, size packed."""
    if not raw:
        return base64.b64encode(np.zeros(3, "<u8").tobytes()).decode("ascii")
    packed = zlib.compress(raw, 6)
    head = np.array([1, len(raw), 0, len(packed)], "<u8").tobytes()
    return (base64.b64encode(head) + base64.b64encode(packed)).decode("ascii")


def _file(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root, " ")
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
