"""What `ploughval init` knows of a folder: its files, the guesses from the photographs, the scale."""

from dataclasses import dataclass

from ploughval.run.setup.guess_scale import ScaleGuess
from ploughval.run.setup.guesses import Guesses
from ploughval.run.setup.survey import Survey


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Files, guesses and scale of one folder; scale None where it does not follow."""

    there: Survey
    guesses: Guesses
    scale: ScaleGuess | None

    @property
    def mm_per_px(self) -> float | None:
        """The scale, if photographs and log show one motion."""
        return self.scale.mm_per_px if self.scale is not None and self.scale.sure else None

    @property
    def scale_text(self) -> str:
        """That scale as text."""
        return f"{self.mm_per_px:.5g} mm/px" if self.mm_per_px else ""

    @property
    def blade_sure(self) -> bool:
        """Whether the photographs show the blade beyond doubt: else nothing that rests on it is offered."""
        return self.guesses.blade is not None and self.guesses.blade.sure

    @property
    def depth_px(self) -> float | None:
        """Depth of the tip in the photograph."""
        return self.guesses.depth_px if self.blade_sure else None

    @property
    def depth_mm(self) -> float | None:
        """Depth of the tip, if both its px and the scale are known."""
        return self.depth_px * self.mm_per_px if self.depth_px and self.mm_per_px else None

    @property
    def thickness_px(self) -> float | None:
        """Thickness of the blade in the photograph."""
        blade = self.guesses.blade
        return blade.thickness_px if blade is not None and blade.sure else None
