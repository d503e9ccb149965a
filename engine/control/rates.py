"""How controllers begin and how NEAT mutates them: what a configuration says, and what is published."""

from __future__ import annotations

import dataclasses
from typing import Final, Literal

from engine.control.genome import MAX_POWER
from engine.errors import InvalidData

MAX_HIDDEN: Final = 100
LEAST: Final = 0.001
"""Smallest rate and power of the biases. Every controller has biases, so every one can be mutated."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class NeatRates:
    """How controllers begin and how NEAT mutates them. The defaults change a controller gently.

    Raises:
        InvalidData: a number is out of its range.
    """

    hidden: int = 3
    """Hidden neurons of a new network, between all inputs and all outputs; with 0, inputs lead to outputs."""
    weight_rate: float = 0.2
    """Probability, for each weight, that a Gaussian number is added to it."""
    weight_power: float = 0.2
    """Standard deviation of what is added to a weight."""
    weight_replace: float = 0.02
    """Probability, for each weight, that it is drawn anew."""
    bias_rate: float = 0.2
    """Probability, for each neuron's bias, that a Gaussian number is added to it."""
    bias_power: float = 0.2
    """Standard deviation of what is added to a bias."""
    bias_replace: float = 0.02
    """Probability, for each bias, that it is drawn anew."""
    link_add: float = 0.1
    """Probability that a link is added."""
    link_remove: float = 0.1
    """Probability that a link is removed."""
    link_toggle: float = 0.002
    """Probability, for each link, that chance decides anew whether it is enabled."""
    neuron_add: float = 0.04
    """Probability that a hidden neuron is added, in the middle of a link."""
    neuron_remove: float = 0.04
    """Probability that a hidden neuron is removed, with its links."""
    version: Literal["2.0", "0.92"] = "2.0"
    """NEAT-Python whose rules add links and neurons and cross controllers; 0.92 is the paper's."""

    def __post_init__(self) -> None:
        if not 0 <= self.hidden <= MAX_HIDDEN:
            raise InvalidData(f"hidden must be from 0 to {MAX_HIDDEN}, not {self.hidden}")
        for field in (f for f in dataclasses.fields(self) if f.type == "float"):
            least = LEAST if field.name in ("bias_rate", "bias_power", "weight_power") else 0.0
            most = MAX_POWER if field.name.endswith("power") else 1.0
            if not least <= getattr(self, field.name) <= most:
                raise InvalidData(
                    f"{field.name} must be from {least:g} to {most:g}, not {getattr(self, field.name)}"
                )
        for gene in ("weight", "bias"):
            if getattr(self, f"{gene}_rate") + getattr(self, f"{gene}_replace") > 1.0 + 1e-9:
                raise InvalidData(f"{gene}_rate and {gene}_replace must be at most 1 together")

    def parameters(self) -> dict[str, str]:
        """Return these numbers as NEAT-Python's parameters."""
        values = {
            "num_hidden": self.hidden,
            "conn_add_prob": self.link_add,
            "conn_delete_prob": self.link_remove,
            "node_add_prob": self.neuron_add,
            "node_delete_prob": self.neuron_remove,
            "weight_mutate_rate": self.weight_rate,
            "weight_mutate_power": self.weight_power,
            "weight_replace_rate": self.weight_replace,
            "bias_mutate_rate": self.bias_rate,
            "bias_mutate_power": self.bias_power,
            "bias_replace_rate": self.bias_replace,
            "enabled_mutate_rate": self.link_toggle,
        }
        return {name: str(value) for name, value in values.items()}


PUBLISHED_RATES: Final = NeatRates(
    weight_rate=0.8,
    weight_power=0.5,
    weight_replace=0.1,
    bias_rate=0.7,
    bias_power=0.5,
    bias_replace=0.1,
    link_add=0.5,
    link_remove=0.5,
    link_toggle=0.01,
    neuron_add=0.2,
    neuron_remove=0.2,
)
"""The rates of the authors' published configuration; ``paper`` has NEAT-Python 0.92 as well."""
