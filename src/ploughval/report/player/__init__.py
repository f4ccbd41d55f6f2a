"""The player: one photograph at a time with its lines, dots and place in the force history."""

from ploughval.report.player.chapter import player_chapter

__all__ = ["player_chapter"]
