"""The protocol's rules that the service keeps, in the protocol's order."""

from __future__ import annotations

from tests.rules import of_blocks, of_starts, of_transfers, of_triggers

RULES = (*of_blocks.RULES, *of_transfers.RULES, *of_starts.RULES, *of_triggers.RULES)
