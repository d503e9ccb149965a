"""How one browser wants its maps coloured: by what, with which colours, on which scale."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Sequence
from typing import Final

import viser

from app.gui.widgets import in_a_row, put
from engine.errors import InvalidData
from viz import theme

AUTOMATIC: Final = "automatic"
ALL_RUNS: Final = "all runs alike"
FIXED: Final = "fixed"
FARTHEST: Final = 1000.0
"""Centimetres: no fitness lies beyond it."""
TYPING: Final = 1.5
"""Seconds that an impossible end of a scale may stand, because somebody may still be typing it."""


@dataclasses.dataclass(frozen=True, slots=True)
class ColorWish:
    """What a user has chosen.

    Attributes:
        coloring: what the colours stand for; empty for the usual.
        colormap: one of ``theme.MAPS``.
        scale: one of the three above.
        limits: ends of a fixed scale of fitnesses, in cm.
    """

    coloring: str = ""
    colormap: str = "viridis"
    scale: str = AUTOMATIC
    limits: tuple[float, float] = (0.0, 1.0)


class ColorControls:
    """The widgets.

    Args:
        gui: of one client, inside the panel that they belong to.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._changed: Callable[[ColorWish], None] = lambda _wish: None
        self._shown_limits: tuple[float, float] | None = None
        self._accepted = (0.0, 0.0)
        """The last ends of a fixed scale that make sense."""
        self._typing: threading.Timer | None = None
        self.coloring = gui.add_dropdown("Colour", ("-",), hint="What the colours of the maps stand for")
        colormap = self._colormap = gui.add_dropdown(
            "Colours",
            tuple(theme.MAPS),
            initial_value="viridis",
            hint="Both are perceptually uniform; cividis looks the same to the colour-blind",
        )
        scale = self._scale = gui.add_dropdown(
            "Scale",
            (AUTOMATIC, ALL_RUNS, FIXED),
            hint="The ends of the scale of f_s: each map's own, shared by all runs of its task, or yours",
        )
        self._low, self._high = (
            gui.add_number(label, 0.0, step=0.5, visible=False, hint=hint)
            for label, hint in (
                ("From, cm", "f_s in cm that takes the first colour; all below it does too"),
                ("to, cm", "f_s in cm that takes the last colour; all above it does too"),
            )
        )
        gui.add_html(
            in_a_row((self.coloring, 40), (colormap, 28), (scale, 32), labelled=1)
            + in_a_row((self._low, 50), (self._high, 50))
        )

        @scale.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is None:
                return
            if scale.value == FIXED and self._shown_limits is not None:  # it begins as what is seen
                put(self._low, self._shown_limits[0])
                put(self._high, self._shown_limits[1])
            self._accepted = (self._low.value, self._high.value)
            self._low.visible = self._high.visible = scale.value == FIXED
            self._report()

        for end in (self._low, self._high):

            @end.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is not None:
                    self._limits_typed()

        for widget in (self.coloring, colormap):

            @widget.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is not None:
                    self._report()

    def on_change(self, changed: Callable[[ColorWish], None]) -> None:
        """Call a function with what the user wants, whenever that changes."""
        self._changed = changed

    def offer(self, colorings: Sequence[str], coloring: str) -> None:
        """List what the maps can be coloured by."""
        if tuple(colorings) != tuple(self.coloring.options):
            self.coloring.options = tuple(colorings)
        put(self.coloring, coloring)

    def show_limits(self, limits: tuple[float, float] | None) -> None:
        """Take note of the ends, in cm, of the scale that is shown; None if it is of something else."""
        if limits is not None:
            self._shown_limits = limits

    def _limits_typed(self) -> None:
        """Take the typed ends, or, if they stay impossible for a while, say so and put the last ones back."""
        if self._typing is not None:
            self._typing.cancel()
        limits = (self._low.value, self._high.value)
        try:
            self._accepted = checked_limits(limits)
        except InvalidData:
            # a number arrives figure by figure
            self._typing = threading.Timer(TYPING, self._put_back, [limits])
            self._typing.daemon = True
            self._typing.start()
        else:
            self._report()

    def _put_back(self, refused: tuple[float, float]) -> None:
        if (self._low.value, self._high.value) == refused and self._scale.value == FIXED:
            self._report()
            put(self._low, self._accepted[0])
            put(self._high, self._accepted[1])

    def _report(self) -> None:
        self._changed(
            ColorWish(
                coloring=str(self.coloring.value),
                colormap=str(self._colormap.value),
                scale=str(self._scale.value),
                limits=(self._low.value, self._high.value),
            )
        )


def checked_limits(limits: tuple[float, float]) -> tuple[float, float]:
    """Return the ends of a fixed scale, which a browser has sent.

    Raises:
        InvalidData: they are no numbers, far beyond any fitness or the wrong way round.
    """
    for value in limits:
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not number or abs(value) > FARTHEST:
            raise InvalidData(f"a colour scale ends between {-FARTHEST:.0f} and {FARTHEST:.0f} cm")
    low, high = (float(v) for v in limits)
    if low >= high:
        raise InvalidData(f"the colour scale must begin below its end, not from {low:g} to {high:g} cm")
    return low, high
