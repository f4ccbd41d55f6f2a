"""Steps of a run: from a test folder to its result files, resumable and traceable."""

from ploughval.run.process import Outcome, process_folder

__all__ = ["Outcome", "process_folder"]
