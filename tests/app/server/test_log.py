from __future__ import annotations

import logging

from app.server.log import AtMost


def test_a_flood_of_faults_is_cut_short_and_said_so_and_later_ones_are_shown_again() -> None:
    now, shown = 0.0, []

    class Screen(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            shown.append(self.format(record))

    log, screen = logging.Logger("a server's"), Screen()
    screen.addFilter(AtMost(3, 60.0, lambda: now))
    log.addHandler(screen)
    for k in range(100):
        try:
            raise ValueError(k)
        except ValueError:
            log.exception("fault %d", k)
    assert len(shown) == 3
    assert shown[0].startswith("fault 0\nTraceback")
    assert "Traceback" not in shown[2]
    assert "the rest is not shown" in shown[2]
    now = 61.0
    log.warning("another one")
    assert shown[3] == "another one"
