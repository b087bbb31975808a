"""What the foreign reader has written of a node."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


class Read:
    """Lines of one node; None = of all."""

    def __init__(self, file: Path, node: str | None = "cell-1") -> None:
        self.file, self.node = file, node

    def lines(self, *kinds: str) -> list[dict[str, Any]]:
        """Messages of these kinds, all without any, in the order in which they came."""
        text = self.file.read_text(encoding="utf-8") if self.file.exists() else ""
        found = [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]
        return [
            line
            for line in found
            if line["node"] and self.node in (None, line["node"]) and (not kinds or line["kind"] in kinds)
        ]

    def told(self, name: str, kind: str = "NDATA") -> list[dict[str, Any]]:
        """Each telling of one metric."""
        return [one for line in self.lines(kind) for one in line["metrics"] if one["name"] == name]

    def values(self, name: str, kind: str = "NDATA") -> list[Any]:
        """Its values."""
        return [one["value"] for one in self.told(name, kind)]


def faults(lines: list[dict[str, Any]]) -> list[str]:
    """What is wrong with one node's messages by Sparkplug's rules, for a reader who has seen them all."""
    wrong, born, expected = [], None, 0
    for line in lines:
        if "error" in line:
            wrong.append(f"cannot be read: {line['error']}")
            continue
        if (line["qos"], line["retain"]) != (int(line["kind"] == "NDEATH"), 0):
            wrong.append(f"{line['kind']} of QoS {line['qos']}, retained {line['retain']}")
        count = next((one["value"] for one in line["metrics"] if one["name"] == "bdSeq"), None)
        if line["kind"] == "NBIRTH":
            born, expected = count, 0
        elif line["kind"] == "NDEATH":
            wrong += [f"death {count} after birth {born}"] if born is not None and count != born else []
            born = None
            continue
        elif born is None:
            wrong.append("data of a node that is not born")
        if line["seq"] != expected:
            wrong.append(f"{line['kind']} number {line['seq']}, expected {expected}")
        expected = (expected + 1) % 256
    return wrong
