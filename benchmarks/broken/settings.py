"""Broken folders: every key of test.toml missing, misspelt, of another type, or of an impossible value."""

from pydantic import BaseModel

from broken.base import Case, changed, setting, together, written
from ploughval.scene import Scene
from ploughval.scene_faults import known_keys, table_of

_VALUES = {
    "a text": '"much"',
    "a list": "[[[]]]",
    "negative": "-1.5",
    "not a number": "nan",
    "infinite": "-inf",
    "1e300": "1e300",
    "a thousand digits": f"{'9' * 1000}",
    "a date": "2024-02-29",
    "a table": "{ a = 1 }",
    "true": "true",
}
"""Values, not one of which is right for a number that cannot be negative."""
_FREE = {"camera.photos", "camera.times", "camera.calibration", "loadcells.log", "camera.board.picture"}
_REQUIRED = (
    "test.name",
    "blade.depth_mm",
    "blade.width_mm",
    "soil.unit_weight_kN_m3",
    "soil.peak_friction_deg",
    "soil.residual_friction_deg",
    "camera.photos",
    "camera.mm_per_px",
    "camera.tip_px",
    "loadcells.log",
    "loadcells.spacing_mm",
    "loadcells.lower_to_tip_mm",
    "tracers.layers_mm",
)


def all_keys(model: type[BaseModel] = Scene, place: str = "") -> list[str]:
    """Every key that may stand in test.toml, as table.key."""
    keys: list[str] = []
    for name in known_keys(model):
        inner = table_of(model.model_fields[name].annotation)
        where = f"{place}.{name}".strip(".")
        if inner is not None and name not in ("times", "staircases"):
            keys += all_keys(inner, where)
        elif "." in where:
            keys.append(where)
    return keys


def _values() -> list[Case]:
    """Of each key one value that is wrong, in turn through the kinds, and zero where it cannot be."""
    found = []
    kinds = list(_VALUES.items())
    for k, key in enumerate(k for k in all_keys() if k not in _FREE):
        for what, value in (kinds[1], kinds[8], kinds[(3, 4, 5, 6, 7)[k % 5]]):
            table = key.rsplit(".", 1)[0]
            needs = () if table in _THERE else (table,)
            told = ("test.toml", key.split(".")[0], "expected", *needs)
            found.append(Case(f"setting: {key} is {what}", setting(key, value), told))
    return found


_THERE = {"test", "blade", "box", "soil", "camera", "loadcells", "tracers", "model"}


def _misspelt() -> list[Case]:
    found = []
    for key in (k for k in all_keys() if k.count(".") == 1):
        table, name = key.split(".")
        wrong = name[:-2] + name[-1:] if len(name) > 4 else f"{name}x"
        told = ("test.toml", f"{table}.{wrong}", "for a key that does not exist")
        found.append(Case(f"setting: {key} misspelt", setting(f"{table}.{wrong}", "1"), told))
    return found


def _missing() -> list[Case]:
    return [
        Case(f"setting: {key} missing", setting(key, ""), ("test.toml", key.split(".")[0], "expected"))
        for key in _REQUIRED
    ]


def _zeros() -> list[Case]:
    keys = (
        "blade.depth_mm",
        "blade.width_mm",
        "blade.thickness_mm",
        "blade.speed_mm_s",
        "box.length_mm",
        "soil.unit_weight_kN_m3",
        "soil.peak_friction_deg",
        "soil.residual_friction_deg",
        "camera.mm_per_px",
        "loadcells.spacing_mm",
        "loadcells.lower_to_tip_mm",
        "loadcells.rate_hz",
        "piv.spacing_px",
        "model.tolerance",
    )
    zeros = [
        Case(
            f"setting: {key} is {value}",
            setting(key, value),
            ("test.toml", key, value.split(".")[0], "more than 0"),
        )
        for key in keys
        for value in ("0.0", "-1.5")
        if key not in ("piv.spacing_px", "model.tolerance") or value == "0.0"
    ]
    return [
        Case(case.name, case.spoil, case.told[:-1])
        if "piv" in case.name or "tolerance" in case.name
        else case
        for case in zeros
    ]


def _texts() -> list[Case]:
    """test.toml as a text that is none, or in another encoding."""
    toml = "test.toml"
    deep = "[" * 100_000
    return [
        Case("toml: empty", written(toml, ""), (toml, "test", "nothing")),
        Case("toml: binary", written(toml, bytes(range(256))), (toml, "UTF-8")),
        Case("toml: a JPEG", written(toml, b"\xff\xd8\xff\xe0" + bytes(100)), (toml, "UTF-8")),
        Case("toml: NUL bytes at the end", changed(toml, lambda d: d + bytes(50)), (toml, "line")),
        Case("toml: UTF-16", changed(toml, lambda d: d.decode().encode("utf-16")), (toml, "UTF-8")),
        Case(
            "toml: UTF-16 without mark",
            changed(toml, lambda d: d.decode().encode("utf-16-le")),
            (toml, "TOML"),
        ),
        Case("toml: Latin-1", changed(toml, lambda d: d + b"# \xe9\xe8\n"), (toml, "UTF-8")),
        Case(
            "toml: a mark of byte order is passed over",
            changed(toml, lambda d: b"\xef\xbb\xbf" + d),
            (),
            (0,),
        ),
        Case("toml: line ends of Windows", changed(toml, lambda d: d.replace(b"\n", b"\r\n")), (), (0,)),
        Case("toml: line ends of old Macs", changed(toml, lambda d: d.replace(b"\n", b"\r")), (toml, "TOML")),
        Case("toml: cut off in a string", changed(toml, lambda d: d[: d.index(b"photos/*") + 4]), (toml,)),
        Case("toml: a key twice", changed(toml, lambda d: d + b"run = true\n"), (toml, "line", "TOML")),
        Case(
            "toml: a table twice", changed(toml, lambda d: d + b"[blade]\ndepth_mm = 1.0\n"), (toml, "line")
        ),
        Case("toml: a table as a value", changed(toml, lambda d: b"blade = 5\n" + d), (toml, "TOML")),
        Case("toml: an unknown table", changed(toml, lambda d: d + b"[sand]\na = 1\n"), (toml, "sand")),
        Case(
            "toml: a table of the wrong type",
            changed(toml, lambda d: b"piv = 5\n" + d),
            (toml, "piv", "a table"),
        ),
        Case("toml: lists in lists without end", written(toml, f"a = {deep}"), (toml, "brackets")),
        Case(
            "toml: tables in tables without end",
            written(toml, "a." * 100_000 + "b = 1"),
            (toml, "line 1", "tables"),
        ),
        Case("toml: 20 MB of comments", written(toml, "# sand\n" * 3_000_000), (toml, "MB")),
        Case("toml: one line of 20 MB", written(toml, 'a = "' + "x" * 20_000_000 + '"'), (toml, "MB")),
        Case(
            "toml: a date of no calendar", setting("test.notes", "2024-02-30"), (toml, "line", "TOML", "date")
        ),
        Case("toml: decimal commas", setting("blade.depth_mm", "30,0"), (toml, "line", "TOML")),
        Case(
            "toml: numbers in quotes",
            setting("blade.depth_mm", '"30.0"'),
            (toml, "blade.depth_mm", "without quotes"),
        ),
        Case(
            "toml: another unit",
            together(setting("blade.depth_mm", ""), setting("blade.depth_cm", "3.0")),
            ("depth_mm = 30",),
        ),
    ]


def _geometry() -> list[Case]:
    """Settings that are possible each, but not together or not with these photographs."""
    return [
        Case(
            "geometry: tip outside the picture",
            setting("camera.tip_px", "[9000.0, 40.0]"),
            ("tip_px", "255 x 73"),
        ),
        Case("geometry: tip at -1e12", setting("camera.tip_px", "[-1e12, 1e12]"), ("tip_px",)),
        *_absurd(),
        Case(
            "geometry: 1e-9 mm a pixel", setting("camera.mm_per_px", "1e-9"), ("blade", "mm_per_px"), (1, 2)
        ),
        Case("geometry: depth of 1e-9 mm", setting("blade.depth_mm", "1e-9"), ("depth_mm",)),
        Case(
            "geometry: layers above the sand",
            setting("tracers.layers_mm", "[40.0]"),
            ("layers_mm", "depth_mm"),
        ),
        Case(
            "geometry: 1e5 layers",
            setting("tracers.layers_mm", str([k / 4000 for k in range(100_000)])),
            ("layers_mm",),
        ),
        Case("geometry: rest after the test", setting("loadcells.rest_s", "[1e6, 1e7]"), ("rest_s",), (1,)),
        Case(
            "geometry: rest backwards",
            setting("loadcells.rest_s", "[5.0, 1.0]"),
            ("rest_s", "start before end"),
        ),
        *_control_points(),
        Case(
            "geometry: view outside", setting("camera.view_px", "[0, 0, 9000, 9000]"), ("view_px", "255 x 73")
        ),
        Case("geometry: view of no width", setting("camera.view_px", "[9, 9, 9, 9]"), ("view_px",)),
        Case("geometry: view of 2 x 2 px", setting("camera.view_px", "[9, 9, 11, 11]"), ("view_px",), (1, 2)),
        Case(
            "geometry: points 1000 px apart",
            setting("piv.spacing_px", "1000.0"),
            ("point",),
            (1,),
            ("force.csv",),
        ),
        Case(
            "geometry: subsets larger than the picture",
            setting("piv.subset_px", "201"),
            ("point",),
            (1,),
            ("force.csv",),
        ),
        Case("geometry: rate beside times", setting("loadcells.rate_hz", "10.0"), ("rate_hz", "time"), (1,)),
    ]


_WINDOW = (
    setting("camera.window.thickness_mm", "12.0"),
    setting("camera.window.distance_mm", "900.0"),
    setting("camera.window.points_on", '"inside"'),
)
_MARKERS = (setting("camera.markers.fixed_px", "[[20, 20], [200, 20], [20, 60]]"),)


def _absurd() -> list[Case]:
    """Numbers that no laboratory has: lengths and scales are refused, with the rest the run ends well."""
    largest = {
        "blade.depth_mm": "10000",
        "blade.width_mm": "10000",
        "blade.thickness_mm": "10000",
        "loadcells.spacing_mm": "10000",
        "loadcells.lower_to_tip_mm": "10000",
        "box.length_mm": "100000",
        "camera.mm_per_px": "1000",
    }
    refused = [
        Case(f"absurd: {key} is 1e9", setting(key, "1e9"), ("test.toml", key, f"at most {most}"))
        for key, most in largest.items()
    ]
    refused += [
        Case(f"absurd: {key} is {value}", together(*beside, setting(key, value)), ("test.toml", key, limit))
        for key, value, limit, beside in (
            ("camera.window.thickness_mm", "1e9", "at most 1000", _WINDOW),
            ("camera.window.distance_mm", "1e-9", "at least 1", _WINDOW),
            ("camera.markers.radius_px", "1e9", "at most 10000", _MARKERS),
            ("camera.markers.radius_px", "1e-9", "at least 2", _MARKERS),
        )
    ]
    borne = [(key, most) for key, most in largest.items() if key != "camera.mm_per_px"]
    borne += [(key, "1e-9") for key in largest if key not in ("blade.depth_mm", "camera.mm_per_px")]
    borne += [(key, value) for key in ("blade.speed_mm_s", "soil.surcharge_kPa") for value in ("1e9", "1e-9")]
    borne += [("loadcells.bandwidth_Hz", value) for value in ("1e9", "1e-9")]
    return refused + [
        Case(f"absurd: {key} is {value}", setting(key, value), (), (0, 1), ("force.csv",), slow=True)
        for key, value in borne
    ]


def _control_points() -> list[Case]:
    """Control points that fix no scale."""
    return [
        Case(
            "geometry: points on a line",
            _points("[[0,0,0,0],[1,1,1,1],[2,2,2,2],[3,3,3,3]]"),
            ("control_points",),
        ),
        Case(
            "geometry: points in one place",
            _points("[[1,1,1,1],[1,1,1,1],[1,1,1,1],[1,1,1,1]]"),
            ("control_points",),
        ),
        Case(
            "geometry: points at 1e12",
            _points("[[0,0,0,0],[1e12,0,9,0],[0,1e12,0,9],[1e12,1e12,9,9]]"),
            ("control_points",),
            (1, 2),
        ),
        Case(
            "geometry: points in nanometres",
            _points("[[0,0,-2e8,4e8],[250,0,2.3e9,4e8],[0,70,-2e8,-3e8],[250,70,2.3e9,-3e8]]"),
            ("control_points", "mm a pixel", "at most 1000"),
        ),
        Case(
            "geometry: three points",
            _points("[[0,0,0,0],[9,0,9,0],[0,9,0,9]]"),
            ("control_points", "at least 4"),
        ),
    ]


def _points(points: str) -> object:
    return together(
        setting("camera.mm_per_px", ""),
        setting("camera.tip_px", ""),
        setting("camera.control_points", points),
    )


def cases() -> list[Case]:
    """All of them."""
    return [*_values(), *_misspelt(), *_missing(), *_zeros(), *_texts(), *_geometry()]
