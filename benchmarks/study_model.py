"""The numerical study of the incremental-collapse model: tables, figures and page of reports/model.

    python benchmarks/study_model.py [--out reports/model] [--parts blade ...]

Parts that are not asked for stay in the folder as they are; so does the comparison with a material-point run
where that run is not at hand. Figures and page are made anew from the tables.
"""

import argparse
import time
from pathlib import Path

import pandas as pd

from drawing.style import BLUE, GREEN, ORANGE, SKY, VERMILION, save, style
from model_study import blades, figures, page, runs, virtual
from model_study import blades_figures as blade_figures
from virtual.folder import virtual_folder

TEMPLATE = Path(__file__).with_name("model_study") / "page.md"
LENGTHS = {
    "length_1_d": ("start to first switch", BLUE, "o"),
    "length_2_d": ("first to second switch", ORANGE, "s"),
    "length_3_d": ("second to third switch", GREEN, "^"),
}
FORCES = {
    "trough_0_P0": ("trough of the first band", BLUE, "o"),
    "peak_1_P0": ("first switch", VERMILION, "s"),
    "trough_1_P0": ("trough of the second band", SKY, "^"),
    "peak_2_P0": ("second switch", ORANGE, "D"),
}


def write(table: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV with six digits."""
    table.to_csv(path, index=False, float_format="%.6g", lineterminator="\n")


def rules() -> dict[str, pd.DataFrame]:
    """What the rules of outcrop and direction do."""
    histories, told = runs.rule_histories()
    return {"rules": told, "rules-histories": histories}


def numerics() -> dict[str, pd.DataFrame]:
    """Errors and times."""
    return {"increments": runs.increments(), "nodes": runs.nodes()}


def influences() -> dict[str, pd.DataFrame]:
    """What soil and ground do."""
    return {"influences": runs.influences(), "friction-map": runs.friction_map()}


def blade() -> dict[str, pd.DataFrame]:
    """What an inclined blade, and a second block beside a rough one, do."""
    return {
        "inclinations": blades.inclinations(),
        "two-blocks": blades.mechanisms(),
        "two-block-joints": blades.joints(),
        "two-block-smooth": blades.smooth(),
    }


def material_points() -> dict[str, pd.DataFrame]:
    """The comparison with a material-point run; nothing where that is not at hand."""
    folder = virtual_folder()
    if folder is None:
        return {}
    histories, readings = virtual.histories(folder)
    return {
        "virtual-histories": histories,
        "virtual": readings,
        "virtual-friction": virtual.mobilised(folder),
        "virtual-speed": pd.DataFrame([virtual.transient(folder)]),
    }


PARTS = {
    "numerics": numerics,
    "influences": influences,
    "rules": rules,
    "blade": blade,
    "material_points": material_points,
}


def make_tables(out: Path, parts: list[str]) -> dict[str, pd.DataFrame]:
    """Run some parts; all tables of the folder, as they stand in its files."""
    for part in parts:
        for name, table in PARTS[part]().items():
            write(table, out / f"{name}.csv")
    read = {path.stem: pd.read_csv(path) for path in sorted(out.glob("*.csv"))}
    if "virtual-friction" in read:
        read["virtual-friction"]["event"] = read["virtual-friction"]["event"].fillna("")
    return read


def make_figures(tables: dict[str, pd.DataFrame], out: Path) -> None:
    """Draw every figure whose tables are there."""
    with style():
        save(figures.numerics(tables["increments"], tables["nodes"]), out / "numerics")
        save(figures.rules(tables["rules-histories"]), out / "rules")
        save(figures.influences(tables["influences"], LENGTHS, "displacement, d", 5.2), out / "periods")
        save(figures.influences(tables["influences"], FORCES, "force, P0", 5.0), out / "forces")
        save(figures.friction_map(tables["friction-map"]), out / "friction-map")
        save(blade_figures.inclinations(tables["inclinations"]), out / "inclinations")
        rough = blades.rough_histories()
        save(blade_figures.block_forces(rough, tables["two-blocks"]), out / "two-blocks")
        save(blade_figures.block_layers(rough), out / "two-block-layers")
        if names := runs.directions():
            save(figures.direction_rules(tables["rules-histories"], names), out / "directions")
        if "virtual" in tables:
            davis = tuple(tables["virtual-speed"][[f"davis_{k}_deg" for k in ("peak", "residual")]].iloc[0])
            drawn = figures.virtual(tables["virtual-histories"], tables["virtual-friction"], davis)
            save(drawn, out / "virtual")


def main(arguments: list[str] | None = None) -> Path:
    """Make the study; returns its folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("reports/model"), help="folder of the study")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="parts to run anew")
    given = parser.parse_args(arguments)
    out = given.out
    out.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    tables = make_tables(out, given.parts)
    make_figures(tables, out)
    text = page.fill(TEMPLATE.read_text(encoding="utf-8"), tables)
    (out / "README.md").write_text(text, encoding="utf-8")
    print(f"wrote {out} in {time.perf_counter() - start:.0f} s")
    return out


if __name__ == "__main__":
    main()
