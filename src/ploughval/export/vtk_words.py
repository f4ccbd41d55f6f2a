"""What stands beside the VTK files: what each series shows, its arrays and their units, the codes."""

from collections.abc import Sequence

from ploughval.axes import Status

README = "README.md"
_ABOUT = {
    "points": "Tracked points where they were measured. displacement_mm (vector, since the first "
    "photograph), std_mm (standard deviation of the place), zncc (correlation), status (code, below), point "
    "(number), initial_mm (vector), layer_mm (tracer layer, NaN: none).",
    "lost": "Points without a place in a photograph, where they were measured last. status says why, "
    "last_frame when that was.",
    "layers": "Tracer layers, a polyline for each unbroken piece. layer_mm (initial height), source (0 "
    "tracked points, 1 dyed sand, -1 another), std_mm (of the place).",
    "model_layers": "The model's tracer layers. source: 2.",
    "surface": "The free surface.",
    "model_surface": "The model's free surface.",
    "bands": "The shear band of the increment that begins with a photograph, half-way through it: straight "
    "from the tip to the outcrop. beta_deg, beta_std_deg, outcrop_x_mm, outcrop_std_mm, slip_mm, du_mm "
    "(travel), band (number, -1: none in bands.csv).",
    "all_bands": "All measured bands, each as it starts; columns of bands.csv.",
    "all_model_bands": "All bands of the model, each as it starts.",
}
_HEAD = (
    "Open the .pvd files in ParaView. Lengths are in mm, angles in degrees; x along the travel of the "
    "blade from its initial face, y up from the level of the tip, z is 0. The time of a series is the number "
    "of the photograph; u_mm (displacement of the blade) and time_s stand in the field data. Missing numbers "
    "are NaN."
)


def readme(name: str, shown: Sequence[str]) -> str:
    """The text.

    Parameters
    ----------
    name : str
        Of the test.
    shown : sequence of str
        Series and single files that are there.
    """
    lines = [f"- `{series}`: {_ABOUT[series]}" for series in shown]
    codes = ", ".join(f"{int(status)} {status.meaning}" for status in Status)
    return "\n".join([f"# {name}", "", _HEAD, "", *lines, "", f"Codes of status: {codes}.", ""])
