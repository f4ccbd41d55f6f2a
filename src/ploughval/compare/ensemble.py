"""Model runs with drawn inputs: what the inputs' uncertainty does to every prediction (JCGM 101:2008)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.inputs import Input, changed_scene, draw_values, uncertain_inputs
from ploughval.errors import PloughvalError
from ploughval.scene import Scene

if TYPE_CHECKING:
    from ploughval.model import History

Floats = NDArray[np.float64]
SEED = 20_09  # one for all tests: the same inputs give the same numbers
_COARSEST = 1e-3  # draws need no finer model, and finer ones take time and memory
_LEAST_HAVING = 0.5  # a value that fewer of the draws have has no spread
_FEW = 0.1  # refused draws that go without saying, for one that is kept
_MOST_REFUSED = 20  # for one that is kept
_EXPLAINED = 0.5  # share of the variance from which on an input dominates


class Spread(NamedTuple):
    """What the inputs leave open of one value.

    ``std`` is the root mean square deviation of the draws from the value at the stated inputs; ``lacking``
    of ``draws`` draws do not have the value; ``shares`` are the inputs' parts of the variance; ``refused``
    draws were impossible and drawn anew.
    """

    std: float
    lacking: int
    draws: int
    shares: Mapping[str, float]
    refused: int = 0

    @property
    def dominant(self) -> str:
        """The input that most of the variance follows; empty where there is none."""
        if not self.shares:
            return ""
        name = max(self.shares, key=lambda one: self.shares[one])
        return name if self.shares[name] >= _EXPLAINED else ""

    @property
    def remark(self) -> str:
        """What a reader must know of the draws, as the end of a note."""
        if self.draws == 0:
            nothing = "no uncertainty of an input is stated"
            return f"; {'the model runs with none of the drawn inputs' if self.refused else nothing}"
        anew = f"; {self.refused} draws that no sand can have were drawn anew"
        if self.refused >= _MOST_REFUSED * self.draws:  # then drawing was given up before there were enough
            anew = f"; only {self.draws} of {self.draws + self.refused} draws of the inputs can be run"
        lack = f"; {self.lacking} of {self.draws} draws of the inputs have no such value"
        return anew * (self.refused > _FEW * self.draws) + lack * (self.lacking > 0)


NO_SPREAD = Spread(0.0, 0, 0, {})


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble(Sequence["History"]):
    """Runs of the model with drawn inputs; empty where no input has an uncertainty.

    Attributes
    ----------
    inputs : tuple of Input
        What was drawn.
    values : (N, K) float
        The drawn values, in the inputs' units.
    histories : tuple of History
        One a draw, in the same order.
    centre : History
        The run with the stated inputs, at the tolerance of the draws.
    refused : int
        Draws that no sand can have, or that the model cannot run; each was drawn anew.
    """

    inputs: tuple[Input, ...]
    values: Floats
    histories: "tuple[History, ...]"
    centre: "History"
    refused: int = 0

    def __len__(self) -> int:
        return len(self.histories)

    @overload
    def __getitem__(self, index: int) -> "History": ...
    @overload
    def __getitem__(self, index: slice) -> "tuple[History, ...]": ...
    def __getitem__(self, index: int | slice) -> "History | tuple[History, ...]":
        return self.histories[index]

    def spread(self, values: Callable[["History"], Mapping[str, float]]) -> dict[str, Spread]:
        """Spread of every scalar that a function reads from a run, by name."""
        centre = values(self.centre)
        drawn = [values(one) for one in self.histories]
        names = dict.fromkeys([*centre, *(name for one in drawn for name in one)])
        nan = float("nan")
        return {
            name: self.spread_of(centre.get(name, nan), np.array([one.get(name, nan) for one in drawn]))
            for name in names
        }

    def spread_of(self, centre: float, drawn: Floats) -> Spread:
        """Spread of one value: its draws, one a history, about what the stated inputs give."""
        if drawn.size == 0:
            return Spread(float("nan"), 0, 0, {}, self.refused) if self.inputs else NO_SPREAD
        having = np.isfinite(drawn)
        lacking = int((~having).sum())
        std = float(std_about(np.array([centre]), drawn[:, None])[0])
        shares = {} if not np.isfinite(std) else self._shares(drawn[having], self.values[having])
        return Spread(std, lacking, drawn.size, shares, self.refused)

    def _shares(self, drawn: Floats, values: Floats) -> dict[str, float]:
        """Squared standardised regression coefficients (Saltelli et al. 2008, section 1.2.5).

        docs/theory-comparison.md, Eq. (3).
        """
        total = float(drawn.var())
        if total <= 1e-24 * float(np.mean(drawn**2)) or len(drawn) < 2 * len(self.inputs):
            return {}
        centred = (values - values.mean(axis=0)) / values.std(axis=0)
        slopes = np.linalg.lstsq(centred, drawn - drawn.mean(), rcond=None)[0]
        return {one.name: float(slope**2 / total) for one, slope in zip(self.inputs, slopes, strict=True)}


def std_about(centre: Floats, drawn: Floats) -> Floats:
    """Root mean square deviation of draws from what the stated inputs give, at every place.

    docs/theory-comparison.md, Eq. (2).

    The prediction that is compared is the one at the stated inputs. What the draws' mean differs from it
    by (inputs cut at a bound, a response that bends) counts as uncertainty, too.

    Parameters
    ----------
    centre : (M,) float
        At the stated inputs; where NaN the draws' own mean stands for it.
    drawn : (N, M) float
        One row a draw; NaN where a draw does not have the value.

    Returns
    -------
    (M,) float
        0 without draws; NaN where fewer than half of them have the value.
    """
    if len(drawn) == 0:
        return np.zeros(centre.shape)
    having = np.isfinite(drawn)
    count = having.sum(axis=0)
    known = np.where(having, drawn, 0.0)
    about = np.where(np.isfinite(centre), centre, known.sum(axis=0) / np.maximum(count, 1))
    squares = np.where(having, (known - about) ** 2, 0.0).sum(axis=0)
    std = np.sqrt(squares / np.maximum(count, 1))
    return np.asarray(np.where(count >= max(_LEAST_HAVING * len(drawn), 1), std, np.nan))


def draw_ensemble(
    scene: Scene, history: "History", displacement_mm: float, *, count: int | None = None, seed: int = SEED
) -> Ensemble:
    """Run the model with inputs drawn from their standard uncertainties.

    Parameters
    ----------
    scene : Scene
        States the inputs and their standard uncertainties.
    history : History
        The run with the stated inputs.
    displacement_mm : float
        Travel of every run.
    count : int or None
        Number of runs; None: the scene's.
    seed : int
        Of the draws.

    Returns
    -------
    Ensemble
        Without runs where no input has an uncertainty. Fewer than asked for where 20 times as many draws had
        to be refused.
    """
    inputs = uncertain_inputs(scene)
    if not inputs:
        return Ensemble((), np.empty((0, 0)), (), history)
    from ploughval.model import simulate

    count = scene.compare.draws if count is None else count
    centre = history
    if scene.model.tolerance < _COARSEST:
        scene = scene.model_copy(update={"model": scene.model.model_copy(update={"tolerance": _COARSEST})})
        centre = simulate(scene, displacement_mm=displacement_mm)
    kept, histories, refused = [], [], 0
    for values in draw_values(inputs, count, np.random.default_rng(seed)):
        changed = changed_scene(scene, inputs, values)
        one = None if changed is None else _run(changed, displacement_mm)
        if one is None:
            refused += 1
        else:
            kept.append(values)
            histories.append(one)
        if len(kept) == count or refused >= _MOST_REFUSED * count:
            break
    drawn = np.array(kept).reshape(len(kept), len(inputs))
    return Ensemble(inputs, drawn, tuple(histories), centre, refused)


def _run(scene: Scene, displacement_mm: float) -> "History | None":
    from ploughval.model import simulate

    try:
        return simulate(scene, displacement_mm=displacement_mm)
    except PloughvalError:
        return None
