"""What if: the chosen robot of one browser with another body, simulated on the spot and kept nowhere."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable

import viser

from app.gui.actions import Actions
from app.gui.click_channel import ClickChannel
from app.gui.widgets import ignoring_event, put, put_html
from engine.body.feet import FEET_TEXT, Feet
from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS, module_number
from engine.body.morphology import Morphology, with_face, with_feet, with_modules, with_stiffness
from engine.errors import InvalidData
from engine.replay.what_if import WhatIf, WhatIfReplay
from engine.tasks import get_task
from viz.robot import what_if_table as view
from viz.robot.robot_differences import Entry

ALL = "all modules"
CALM = 0.35
"""Seconds without another change before a variant is simulated: a slider passes many values."""
NOTHING = (
    '<div style="font-size:12.5px;line-height:1.45;opacity:.7;padding:6px 10px">Choose a robot, then change'
    " its body here and see at once how the same controller fares with it.</div>"
)
HELP = (
    '<div style="font-size:12px;line-height:1.45;opacity:.7;padding:6px 10px 0">Change the body: the same'
    " controller drives it towards all targets, under the noise of the evaluation. Nothing of it enters the"
    " archive.</div>"
)


@dataclasses.dataclass(frozen=True, slots=True)
class WhatIfEvents:
    """What the panel reports and asks.

    Attributes:
        play: the scene is to show the variant, or the robot itself again.
        may_simulate: asked before so many seconds of robots' time are simulated; it says why not.
    """

    play: Callable[[], None]
    may_simulate: Callable[[float], bool]


class WhatIfPanel:
    """Lets a body be changed and shows what becomes of it. One variant is simulated at a time.

    Args:
        client: the browser.
        tabs: the group that gets the tab.
        actions: of the browser.
        events: whom it reports to.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        tabs: viser.GuiTabGroupHandle,
        actions: Actions,
        events: WhatIfEvents,
    ) -> None:
        gui = client.gui
        self._actions, self._events = actions, events
        self._robot: Entry | None = None
        self._body: Morphology | None = None
        self._what_if: WhatIf | None = None
        self._timer: threading.Timer | None = None
        self._mutex = threading.RLock()
        self.watching = False
        """Whether the scene shows the variant instead of the robot itself."""
        with tabs.add_tab("What if", viser.Icon.FLASK):
            self._text = gui.add_html(NOTHING)
            self._modules = gui.add_slider(
                "Modules",
                min=MIN_MODULES,
                max=MAX_MODULES,
                step=1,
                initial_value=MIN_MODULES,
                visible=False,
                hint="Taken from the chain's end, or added there as copies of its last module",
            )
            self._stiffness = gui.add_slider(
                "Stiffness",
                min=0.1,
                max=1.0,
                step=0.1,
                initial_value=0.5,
                visible=False,
                hint="Relative stiffness of the cables",
            )
            self._which = gui.add_dropdown(
                "Stiffness of", (ALL,), visible=False, hint="Where every module has a stiffness of its own"
            )
            self._feet = gui.add_dropdown(
                "Feet",
                tuple(FEET_TEXT.values()),
                visible=False,
                hint="Feet that grip one way: whether, and towards which end of the chain they slide",
            )
            self._genes = gui.add_html("")
            self._handler = ClickChannel(gui, actions.guarded(self._clicked), label="genes").handler
            self._result = gui.add_html("")
            self._watch = gui.add_button(
                "Watch the original", visible=False, hint="Replay the robot itself, or its variant"
            )
            self._reset = gui.add_button(
                "As it was",
                icon=viser.Icon.ARROW_BACK_UP,
                color="gray",
                visible=False,
                hint="Undo all changes of the body",
            )

        @self._modules.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                actions.guarded(self._change)(lambda b: with_modules(b, _whole(event.target.value)))

        @self._stiffness.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                actions.guarded(self._change)(self._stiffer)

        @self._which.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and self._body is not None:
                actions.guarded(self._show_body)()

        @self._feet.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                actions.guarded(self._change)(lambda body: with_feet(body, _feet(event.target.value)))

        self._watch.on_click(ignoring_event(actions.guarded(self._toggle)))
        self._reset.on_click(ignoring_event(actions.guarded(self._undo)))

    def choose(self, robot: Entry | None, *, again: bool = False) -> None:
        """Offer to change a robot; what was changed of another one is forgotten.

        Args:
            robot: to change, None for none.
            again: whether to replay the robot itself if its variant was being watched.
        """
        was = self.watching
        self.stop()
        self._robot, self.watching = robot, False
        self._body = None if robot is None else robot.evaluation.solution.morphology
        put_html(self._text, NOTHING if robot is None else HELP)
        put_html(self._result, "")
        self._show_body()
        if again and was:
            self._events.play()

    def leave(self) -> None:
        """Watch something else; the comparison goes on."""
        self.watching = False
        self._show_buttons()

    def replay(self, target: int) -> WhatIfReplay:
        """Return the replay of the variant towards a target.

        Raises:
            InvalidData: there is no such target or no variant.
        """
        if self._what_if is None:
            raise InvalidData("Change the robot first.")
        return WhatIfReplay(self._what_if, target)

    def _stiffer(self, body: Morphology) -> Morphology:
        value = self._stiffness.value
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise InvalidData(f"stiffness must be from 0.1 to 1.0, not {value!r}")
        return with_stiffness(body, round(N_STIFFNESS_LEVELS * value), self._module())

    def _module(self) -> int | None:
        """Return the index of the module whose stiffness the slider sets, None for all."""
        name = str(self._which.value)
        if self._body is None or self._body.stiffness_mode == "shared" or not name.isdecimal():
            return None
        return min(max(int(name[:3]) - 1, 0), self._body.n_modules - 1)

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "face" and len(index) == 2:
            self._change(lambda body: with_face(body, *index))

    def _change(self, change: Callable[[Morphology], Morphology]) -> None:
        """Change the body and simulate it once no other change follows."""
        if self._body is None:
            raise InvalidData("Click a filled cell of a map first.")
        try:
            body = change(self._body)
        finally:
            self._show_body()
        if body == self._body:
            return
        if self._robot is not None and body == self._robot.evaluation.solution.morphology:
            self.choose(self._robot, again=True)
            return
        self.stop()
        self._body, self.watching = body, False
        self._show_body()
        put_html(self._result, "")
        with self._mutex:
            self._timer = threading.Timer(CALM, self._actions.guarded(self._start), [body])
            self._timer.daemon = True
            self._timer.start()

    def _start(self, body: Morphology) -> None:
        robot = self._robot
        if robot is None or body != self._body:
            return
        config = robot.config
        trials, n_targets = config.trials, get_task(config.task).n_targets
        seconds = trials.settle_time + trials.open_loop_time + n_targets * trials.repeats * trials.trial_time
        if not self._events.may_simulate(seconds):
            return
        what_if = WhatIf(config, robot.evaluation, body)
        with self._mutex:
            self._what_if = what_if
        self._tell(what_if)
        run = self._actions.guarded(what_if.run, alone=False)
        threading.Thread(target=run, args=(lambda: self._tell(what_if),), name="what-if", daemon=True).start()
        self.watching = True
        self._show_buttons()
        self._events.play()

    def _tell(self, what_if: WhatIf) -> None:
        """Show how the variant fares so far, unless another one is wanted by now."""
        robot = self._robot
        if robot is None or what_if is not self._what_if or what_if.cancelled:
            return
        end, second = what_if.config.trials.trial_time, max(0, math.floor(what_if.time + 1e-6))
        if what_if.finished:
            heading, second = f"cm at the end, after {end:g} s", math.ceil(end)
        elif what_if.scores is None:
            heading, second = "The robot settles and looks for its head …", math.ceil(end)
        else:
            heading = f"cm after {second} s of {end:g} s, simulating …"
        lines = view.compare(what_if.config, robot.evaluation, what_if.scores, second)
        put_html(self._result, view.render_table(lines, heading, what_if.failure))

    def _undo(self) -> None:
        self.choose(self._robot, again=True)

    def _toggle(self) -> None:
        self.watching = not self.watching and self._what_if is not None
        self._show_buttons()
        self._events.play()

    def stop(self) -> None:
        """Simulate no more."""
        with self._mutex:
            if self._timer is not None:
                self._timer.cancel()
            if self._what_if is not None:
                self._what_if.cancel()
            self._timer = self._what_if = None

    def _show_body(self) -> None:
        body, robot = self._body, self._robot
        for widget in (self._modules, self._stiffness):
            widget.visible = body is not None
        # only the kernel knows them
        self._feet.visible = robot is not None and robot.config.physics.simulator == "kernel"
        self._show_buttons()
        if body is None or robot is None:
            self._which.visible = False
            put_html(self._genes, "")
            return
        original = robot.evaluation.solution.morphology
        put(self._feet, FEET_TEXT[body.feet])
        self._which.visible = body.stiffness_mode == "per-module"
        names = (ALL, *(str(module_number(i)) for i in range(body.n_modules)))
        if tuple(self._which.options) != names:
            self._which.options = names
        module = self._module()
        put(self._modules, body.n_modules)
        stiffness = body.stiffness if module is None else body.stiffnesses[min(module, body.n_modules - 1)]
        put(self._stiffness, round(stiffness, 1))
        put_html(self._genes, view.render_genes(body, original, self._handler))

    def _show_buttons(self) -> None:
        robot = self._robot
        self._reset.visible = robot is not None and self._body != robot.evaluation.solution.morphology
        self._watch.visible = self._what_if is not None
        label = "Watch the original" if self.watching else "Watch the variant"
        if self._watch.label != label:
            self._watch.label = label


def _feet(value: object) -> Feet:
    """Return the feet whose name a browser sent.

    Raises:
        InvalidData: there are none of that name.
    """
    for feet, name in FEET_TEXT.items():
        if value == name:
            return feet
    raise InvalidData(f"feet must be {', '.join(FEET_TEXT.values())}, not {value!r:.60}")


def _whole(value: object) -> int:
    """Return a whole number that a browser sent.

    Raises:
        InvalidData: it is none.
    """
    if not isinstance(value, int | float) or not math.isfinite(value) or value != int(value):
        raise InvalidData(f"modules must be a whole number, not {value!r}")
    return int(value)
