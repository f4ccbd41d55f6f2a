"""The command line: the verbs of ploughval, their exit codes and their progress."""

import logging
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from ploughval.cli_export import export
from ploughval.cli_options import Debug, Folder, Json, Version, Workers
from ploughval.outcomes import Outcomes, outcome_row
from ploughval.run.many.machine import processors
from ploughval.stopping import listen
from ploughval.talk import (
    DONE,
    INCOMPLETE,
    REFUSED,
    Verbs,
    command,
    printed_aside,
    said_once,
    shown_progress,
)
from ploughval.watch import one_step

app = typer.Typer(
    name="ploughval",
    cls=Verbs,
    help="Measure blade-in-sand (ploughing) tests and validate the incremental-collapse model against them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback()
def _options(debug: Debug = False, version: Version = False) -> None:
    logging.basicConfig(
        level=logging.DEBUG if debug else logging.WARNING,
        format="%(levelname)s %(name)s: %(message)s",
        force=True,
    )
    for noisy in ("numba", "matplotlib", "PIL", "h5py", "fontTools"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


@app.command()
def init(
    folder: Annotated[Path, typer.Argument(help="Folder with photographs and logs.")], as_json: Json = False
) -> None:
    """Write a commented test.toml from what is in the folder."""
    with command(as_json) as talk:
        from ploughval.run.setup.draft import write_draft

        with shown_progress(talk) as progress, one_step(progress, "init"):
            path = write_draft(folder)
        talk.summary = {"file": str(path)}
        talk.say(
            f"wrote {path}: answer the lines that end in a question mark, then: ploughval check {folder}"
        )


@app.command()
def check(
    folder: Folder,
    picture: Annotated[Path | None, typer.Option(help="Where the preview goes (PNG or SVG).")] = None,
    as_json: Json = False,
) -> None:
    """Name every fault before anything is processed. Previews calibration and tracks; changes nothing."""
    with command(as_json) as talk:
        from ploughval.report import write_preview
        from ploughval.run.setup.check_findings import Level
        from ploughval.run.setup.preview import preview

        with shown_progress(talk) as progress, one_step(progress, "check"):
            found = preview(folder)
        for line in found.lines:
            talk.say(line)
        talk.summary = {
            "test": found.name,
            "lines": list(found.lines),
            "findings": [finding.to_json() for finding in found.findings],
            "picture": None,
        }
        if found.seen.image is not None:
            path = write_preview(found, picture)
            talk.summary["picture"] = str(path)
            talk.say(f"preview: {path}")
        for finding in found.findings:
            (talk.say if finding.level is Level.REMARK else talk.warn)(f"{finding.level.value}: {finding}")
        code = {Level.REFUSED: REFUSED, Level.LOST: INCOMPLETE}.get(found.worst or Level.REMARK, DONE)
        if code != DONE:
            raise typer.Exit(code)


def _process_one(folder: str, *, out: str | None, **options: Any) -> Any:
    """One test up to the report page; at module level so that another process can be told of it."""
    from ploughval import process

    return process(folder, out=out, **options)


@app.command()
def process(
    folders: Annotated[
        list[str], typer.Argument(help="Test folders, each with a test.toml; or URLs of such.")
    ],
    out: Annotated[
        str | None, typer.Option(metavar="DIR", help="Result folder (several tests: one folder each in it).")
    ] = None,
    workers: Workers = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a dask scheduler (extra: cluster), which shares the work.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over instead of reusing finished stages.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Process test folders up to their reports. Photographs and logs to measurements, model, comparison.

    Several are worked on side by side, each in a process of its own; one that fails does not stop the others.
    """
    with command(as_json) as talk, said_once():
        from ploughval.run.many.pool import Hearers
        from ploughval.run.workers import Share, run_all, share_of

        with shown_progress(talk) as progress:
            share = Share(1, 1) if scheduler else share_of(folders, workers or processors())
            if share.remark:
                talk.warn(share.remark)
            outcomes = Outcomes(talk, folders, progress)
            hearers = Hearers(outcomes.finished, outcomes.watched)
            run_all(_process_one, folders, hearers, out=out, share=share, scheduler=scheduler, fresh=fresh)
        code = outcomes.close()
        if code != DONE:
            raise typer.Exit(code)


@app.command()
def simulate(
    test: Annotated[Path, typer.Argument(help="A test.toml, or a test folder.")],
    out: Annotated[
        Path | None, typer.Option(help="Result folder; default: results/simulate beside test.toml.")
    ] = None,
    displacement: Annotated[float | None, typer.Option(help="Blade travel, mm.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Relative numerical error aimed at.")] = None,
    as_json: Json = False,
) -> None:
    """Run the incremental-collapse model alone. Needs neither photographs nor load cells."""
    with command(as_json) as talk:
        from ploughval.model import simulate as run_model
        from ploughval.run.results import write_model
        from ploughval.scene import load_scene

        scene = load_scene(test, files=False)
        with shown_progress(talk) as progress, one_step(progress, "model"):
            history = run_model(scene, displacement_mm=displacement, tolerance=tolerance)
        folder = out if out is not None else scene.folder / "results" / "simulate"
        write_model(scene, history, folder)
        end = history.force.iloc[-1]
        talk.summary = {
            "results": str(folder),
            "P0_N": history.P0_N,
            "u_mm": float(end["u_mm"]),
            "bands": len(history.bands),
            "force_std_N": float(history.force_std_N),
        }
        talk.say(f"P0 {history.P0_N:.3f} N; {len(history.bands)} shear bands to u = {end['u_mm']:.2f} mm")
        talk.say(f"wrote force.csv, bands.csv, layers.csv, surface.csv in {folder}")


@app.command()
def fit(
    folder: Folder,
    parameters: Annotated[
        list[str] | None,
        typer.Option("--parameter", "-p", help="Field of [soil] to fit; repeat it for several."),
    ] = None,
    wall_friction: Annotated[
        bool, typer.Option("--wall-friction", help="Fit the blade-sand friction angle too.")
    ] = False,
    travel_std: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Relative std of a tooth's length, sand against model.")
    ] = 0.03,
    force_std: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Relative std of the force, sand against model.")
    ] = 0.01,
    bayes: Annotated[
        bool, typer.Option("--bayes", help="Sample the posterior beside the profiles (extra: bayes).")
    ] = False,
    as_json: Json = False,
) -> None:
    """Fit the soil to the measured force. Friction angles and mobilization length, with intervals."""
    # hundreds of small decompositions: threads of BLAS wait for each other, on a busy machine for minutes
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with command(as_json) as talk:
        from ploughval.model.fit import PARAMETERS, Discrepancy
        from ploughval.model.fit.sampler import STEPS
        from ploughval.run.soil import fit_folder

        names = tuple(parameters or PARAMETERS)
        if wall_friction and "wall_friction_deg" not in names:
            names = (*names, "wall_friction_deg")
        with shown_progress(talk) as progress:
            fitted, path = fit_folder(
                folder,
                parameters=names,
                discrepancy=Discrepancy(travel_std, force_std),
                samples=STEPS if bayes else 0,
                progress=progress,
            )
        talk.summary = {"file": str(path), **fitted.to_json()}
        talk.say(str(fitted))
        talk.say(f"wrote {path}")


@app.command()
def report(
    folders: Annotated[list[Path], typer.Argument(help="Processed test folders, or their result folders.")],
    out: Annotated[
        Path | None, typer.Option(help="The page, or a folder for it; default: in the first results.")
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write every figure there too, as SVG and PNG, with captions."),
    ] = None,
    width: Annotated[
        float,
        typer.Option(
            min=60, max=400, help="Width of those figures, mm: 84 or 90 of a column, 174 or 180 of a page."
        ),
    ] = 84.0,
    as_json: Json = False,
) -> None:
    """Write the report page again. Of one test, or of several together.

    Several: which repeat each other, their repeatability, the effect of depth, the mean error of the model;
    every number of the page stands beside it as .json and .csv.
    """
    with command(as_json) as talk, said_once():
        from ploughval.report import write_figures, write_report
        from ploughval.run.results import results_of

        results = [results_of(folder) for folder in folders]
        with shown_progress(talk) as progress:
            path = write_report(results, out=out, progress=progress)
            talk.summary = {"report": str(path)}
            talk.say(f"report: {path}")
            if figures is not None:
                with one_step(progress, "figures"):
                    files = write_figures(results, figures, width_mm=width)
                talk.summary["figures"] = [str(file) for file in files]
                talk.say(f"figures: {len(files)} files in {figures}")


app.command()(export)


@app.command()
def synth(
    out: Annotated[Path, typer.Argument(help="Folder to make.")],
    like: Annotated[Path | None, typer.Option(help="A test.toml whose prediction is made.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything random.")] = 0,
    frames: Annotated[int | None, typer.Option(help="Number of photographs.")] = None,
    mm_per_px: Annotated[float | None, typer.Option(help="Scale, mm per px.")] = None,
    direction: Annotated[str | None, typer.Option(help="Travel in the photograph: right or left.")] = None,
    noise: Annotated[float | None, typer.Option(help="Noise of a photograph, grey levels of 8 bit.")] = None,
    depth: Annotated[float | None, typer.Option(help="Depth of the blade, mm.")] = None,
    displacement: Annotated[float | None, typer.Option(help="Travel of the blade, mm.")] = None,
    peak: Annotated[float | None, typer.Option(help="Peak friction angle, degrees.")] = None,
    residual: Annotated[float | None, typer.Option(help="Residual friction angle, degrees.")] = None,
    mobilization: Annotated[float | None, typer.Option(help="Mobilization length, mm.")] = None,
    wall_friction: Annotated[float | None, typer.Option(help="Blade-sand friction angle, degrees.")] = None,
    repose: Annotated[float | None, typer.Option(help="Slope of repose, degrees.")] = None,
    unit_weight: Annotated[float | None, typer.Option(help="Unit weight, kN/m3.")] = None,
    bit_depth: Annotated[int | None, typer.Option(help="8 or 16.")] = None,
    image_format: Annotated[str | None, typer.Option(help="png, jpg or tif.")] = None,
    markers: Annotated[int | None, typer.Option(help="Markers painted on the window.")] = None,
    no_force: Annotated[bool, typer.Option("--no-force", help="Leave the load cells out.")] = False,
    no_photos: Annotated[bool, typer.Option("--no-photos", help="Leave the photographs out.")] = False,
    as_recorded: Annotated[
        bool, typer.Option("--as-recorded", help="As camera and logger leave it: no test.toml, but notes.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is in OUT.")] = False,
    as_json: Json = False,
) -> None:
    """Make a whole test folder from a seed. The exact truth stands beside it."""
    with command(as_json) as talk:
        from ploughval.scene import load_scene
        from ploughval.synth import EXAMPLE, RECORDED, adapt, make_folder, make_recorded, options_like

        recipe, make = (RECORDED, make_recorded) if as_recorded else (EXAMPLE, make_folder)
        options = adapt(
            recipe if like is None else options_like(load_scene(like, files=False), recipe),
            soil={
                "peak_friction_deg": peak,
                "residual_friction_deg": residual,
                "mobilization_length_mm": mobilization,
                "wall_friction_deg": wall_friction,
                "repose_deg": repose,
                "unit_weight_kN_m3": unit_weight,
            },
            name=out.resolve().name,
            seed=seed,
            frames=frames,
            mm_per_px=mm_per_px,
            direction=direction,
            noise_grey=noise,
            depth_mm=depth,
            displacement_mm=displacement,
            bit_depth=bit_depth,
            image_format=image_format,
            markers=markers,
            loadcells=not no_force,
            photographs=not no_photos,
        )
        with shown_progress(talk) as progress:
            make(out, options, overwrite=overwrite, progress=progress)
        talk.summary = {"folder": str(out), "truth": str(out / "truth"), "frames": options.frames}
        made = _parts("notes.md" if as_recorded else "test.toml", options.photographs, options.loadcells)
        talk.say(f"made {out}: {made}, and the truth in {out / 'truth'}")


def _parts(settings: str, photographs: bool, logs: bool) -> str:
    """What a made test consists of, in words."""
    return ", ".join([settings, *["photographs"] * photographs, *["logs"] * logs])


@app.command()
def bench(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            help="Which ones (piv, sequences, force, model, fit, compare, whole, ...); default all."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Where tables and page go; default reports/speed-error, elsewhere with --quick."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few cases, one round: a smoke run.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Only the page, from tables that are there.")] = False,
    as_json: Json = False,
) -> None:
    """Measure speed against error, write the tables and their page."""
    with command(as_json) as talk:
        from ploughval.run.benches import Benches, run_benches, write_bench_page

        benches = Benches(tuple(names or ()), out, quick)
        with shown_progress(talk) as progress, printed_aside(talk):
            written = write_bench_page(benches.folder) if page else run_benches(benches, progress=progress)
        talk.summary = {"files": [str(path) for path in written]}
        for path in written:
            talk.say(f"wrote {path}")


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the example and its results.")] = Path(
        "ploughval-demo"
    ),
    workers: Workers = None,
    as_json: Json = False,
) -> None:
    """Make the example, process it, print where its report is."""
    with command(as_json) as talk:
        from ploughval.synth import EXAMPLE, make_folder

        with shown_progress(talk) as progress:
            make_folder(out, EXAMPLE, overwrite=True, progress=progress)
            result = _process_one(str(out), out=None, workers=workers or processors(), progress=progress)
        code, row = outcome_row(talk, str(out), result)
        talk.summary = {"tests": [row]}
        if code != DONE:
            raise typer.Exit(code)


def main() -> None:
    """Entry point of the console script."""
    listen()
    app()


if __name__ == "__main__":
    from ploughval import cli

    cli.main()  # not of __main__: other processes are told of a job by its module's name
