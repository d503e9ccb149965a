"""A controller as bytes: what distinguishes it from another one, its base, or from an empty network.

Mutants keep most of their parent's genes, and two thirds of a gene's bytes are the random digits of its
weight, which no compression makes smaller. The layout is in ``docs/run-file.md``.
"""

from __future__ import annotations

import dataclasses
import zlib
from collections.abc import Sequence
from itertools import accumulate
from typing import Any, Final, Self

import numpy as np

from engine.control.genome import MAX_CONNECTIONS, MAX_NODES, ConnectionGene, Controller, NodeGene
from engine.errors import InvalidData
from engine.storage.layouts.numbers import Bytes, inflate, pack_bits, varint, zigzag

MAX_STRUCTURE: Final = 1_000_000
"""Largest size in bytes of the part that is compressed, before compression."""
_RESPONSE: Final = 1.0
"""Of a new node, unless it says otherwise."""


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Genes:
    """A controller's genes by column, in their order.

    Attributes:
        n_inputs: of the network.
        keys: of the nodes.
        links: source, target and innovation of the connections.
        enabled: (connections,) bool.
        values: float64: every node's bias, every node's response, every connection's weight.
    """

    n_inputs: int
    keys: tuple[int, ...]
    links: tuple[tuple[int, int, int], ...]
    enabled: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, c: Controller) -> Self:
        """Return the genes of a controller."""
        values = [n.bias for n in c.nodes]
        values += [n.response for n in c.nodes]
        values += [link.weight for link in c.connections]
        return cls(
            c.n_inputs,
            tuple(n.key for n in c.nodes),
            tuple((link.source, link.target, link.innovation) for link in c.connections),
            np.array([link.enabled for link in c.connections], dtype=bool),
            np.array(values, dtype="<f8"),
        )

    def controller(self) -> Controller:
        """Return the controller.

        Raises:
            InvalidData: the genes are not those of a network.
        """
        n, values = len(self.keys), self.values.tolist()
        return Controller(
            n_inputs=self.n_inputs,
            nodes=tuple(map(NodeGene, self.keys, values[:n], values[n : 2 * n])),
            connections=tuple(
                ConnectionGene(source, target, weight, enabled, innovation)
                for (source, target, innovation), weight, enabled in zip(
                    self.links, values[2 * n :], self.enabled.tolist(), strict=True
                )
            ),
        )


EMPTY: Final = Genes(0, (), (), np.zeros(0, dtype=bool), np.zeros(0, dtype="<f8"))
"""The base of a controller that has none."""


def encode(genes: Genes, base: Genes = EMPTY) -> bytes:
    """Return a controller as bytes.

    Args:
        genes: of the controller.
        base: what ``decode`` will be given.
    """
    kept_keys = _kept(base.keys, genes.keys)
    kept_links = _kept(base.links, genes.links)
    new_keys = genes.keys[sum(kept_keys) :]
    new_links = genes.links[sum(kept_links) :]
    before = _before(base, kept_keys, kept_links, len(new_keys), len(new_links))
    enabled = _enabled_before(base, kept_links, len(new_links))
    difference = genes.values.view("<u8") ^ before.view("<u8")
    changed = difference != 0
    planes = difference[changed].view(np.uint8).reshape(-1, 8)
    structure = b"".join(
        (
            varint(genes.n_inputs),
            varint(len(new_keys)),
            varint(len(new_links)),
            pack_bits(kept_keys),
            pack_bits(kept_links),
            pack_bits(genes.enabled ^ enabled),
            pack_bits(changed),
            *(_differences(column) for column in (new_keys, *zip(*new_links, strict=True))),
            planes[:, 7].tobytes(),
            planes[:, 6].tobytes(),
        )
    )
    packed = zlib.compressobj(9, zlib.DEFLATED, -15, 9)
    deflated = packed.compress(structure) + packed.flush()
    return varint(len(deflated)) + deflated + np.ascontiguousarray(planes[:, :6]).tobytes()


def decode(content: bytes, base: Genes = EMPTY) -> Genes:
    """Return the genes that ``encode`` made bytes of.

    Raises:
        InvalidData: the bytes are not from ``encode``, or the base is another one.
    """
    outer = Bytes(content)
    inner = Bytes(inflate(outer.take(outer.varint()), MAX_STRUCTURE))
    n_inputs, n_keys, n_links = inner.varint(), inner.varint(), inner.varint()
    if n_keys > MAX_NODES or n_links > MAX_CONNECTIONS:
        raise InvalidData("a controller has too many genes")
    kept_keys, kept_links = inner.bits(len(base.keys)), inner.bits(len(base.links))
    keys = [k for k, keep in zip(base.keys, kept_keys, strict=True) if keep]
    links = [k for k, keep in zip(base.links, kept_links, strict=True) if keep]
    enabled = _enabled_before(base, kept_links, n_links) ^ inner.bits(len(links) + n_links)
    values = _before(base, kept_keys, kept_links, n_keys, n_links)
    changed = inner.bits(len(values))
    keys += accumulate(inner.signed(n_keys))
    columns = [accumulate(inner.signed(n_links)) for _ in range(3)] if n_links else []
    links += zip(*columns, strict=True)
    n_changed = int(changed.sum())
    planes = np.empty((n_changed, 8), dtype=np.uint8)
    planes[:, 7] = np.frombuffer(inner.take(n_changed), np.uint8)
    planes[:, 6] = np.frombuffer(inner.take(n_changed), np.uint8)
    planes[:, :6] = np.frombuffer(outer.take(6 * n_changed), np.uint8).reshape(-1, 6)
    inner.end()
    outer.end()
    values.view("<u8")[changed] ^= planes.view("<u8")[:, 0]
    return Genes(n_inputs, tuple(keys), tuple(links), enabled, values)


def _kept(base: Sequence[Any], now: Sequence[Any]) -> list[bool]:
    """Return which entries of a list another one begins with; none if it has them in another order."""
    there = set(now)
    kept = [entry in there for entry in base]
    if [entry for entry, keep in zip(base, kept, strict=True) if keep] != list(now[: sum(kept)]):
        return [False] * len(base)
    return kept


def _before(base: Genes, keys: Any, links: Any, n_keys: int, n_links: int) -> np.ndarray:
    """Return the values that a network has before its changes: the base's, and those of new genes."""
    n = len(base.keys)
    keep_keys, keep_links = np.array(keys, dtype=bool), np.array(links, dtype=bool)
    return np.concatenate(
        (
            base.values[:n][keep_keys],
            np.zeros(n_keys),
            base.values[n : 2 * n][keep_keys],
            np.full(n_keys, _RESPONSE),
            base.values[2 * n :][keep_links],
            np.zeros(n_links),
        )
    ).astype("<f8")


def _enabled_before(base: Genes, links: Any, n_links: int) -> np.ndarray:
    return np.concatenate((base.enabled[np.array(links, dtype=bool)], np.ones(n_links, dtype=bool)))


def _differences(column: Sequence[int]) -> bytes:
    """Return whole numbers as the differences from each to the next, the first from 0."""
    return b"".join(varint(zigzag(b - a)) for a, b in zip((0, *column), column, strict=False))
