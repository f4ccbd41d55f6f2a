"""The stage of the photographs: the walk through them, or what an earlier run kept of it."""

from collections.abc import Mapping
from dataclasses import dataclass

from ploughval.photos import Calibration, FrameSeries
from ploughval.run import provenance, store
from ploughval.run.window import WindowRecord, watch
from ploughval.scene import Scene
from ploughval.scene_camera import EQUIPMENT
from ploughval.watch import Progress, unheard


@dataclass(frozen=True, slots=True)
class Photographs:
    """The photographs of one test, opened and calibrated.

    Attributes
    ----------
    scene : Scene
    frames : FrameSeries
    calibration : Calibration
    input_digests : mapping of str to str
        SHA-256 of every input file, by its path relative to the test folder.
    """

    scene: Scene
    frames: FrameSeries
    calibration: Calibration
    input_digests: Mapping[str, str]

    def window(
        self, kept: store.Store, first: int, *, workers: int = 1, progress: Progress = unheard
    ) -> WindowRecord:
        """The walk from frame ``first``, which shows the sand at rest; kept under the key of what it needs.

        Raises
        ------
        DataError
            Frame ``first`` cannot be read.
        """
        key = self.key(first)
        arrays = kept.load("window", key)
        if arrays is not None:
            return WindowRecord.from_arrays(arrays)
        record = watch(
            self.scene, self.frames, self.calibration, first=first, workers=workers, progress=progress
        )
        kept.save("window", key, record.to_arrays())
        return record

    def key(self, first: int) -> str:
        """Key of all that the walk through the photographs depends on."""
        tables = {"blade", "camera", "tracers", "piv", "soil", "box"}
        settings = self.scene.model_dump_json(include=tables, exclude={"camera": set(EQUIPMENT)})
        files = [f"{name}={self.input_digests[name]}" for name in provenance.window_files(self.scene)]
        return store.key_of(provenance.code_digest(), settings, str(first), *files)
