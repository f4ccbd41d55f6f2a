"""A logger is quiet below a level for a while, and says everything where everything is asked for."""

import logging

import pytest

from ploughval.quiet import hushed


@pytest.mark.parametrize("asked", [logging.WARNING, logging.DEBUG], ids=["usual", "debug"])
def test_a_logger_is_hushed_unless_everything_is_asked_for(asked, caplog):
    logger = logging.getLogger("ploughval.test_quiet")
    with caplog.at_level(asked, logger.name):
        with hushed(logger.name, logging.ERROR):
            logger.warning("within")
            logger.error("worse")
        logger.warning("after")
    heard = [record.message for record in caplog.records]
    assert heard == (["within"] if asked == logging.DEBUG else []) + ["worse", "after"]
    assert logger.level == logging.NOTSET
