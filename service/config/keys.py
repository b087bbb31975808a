"""Keys of a configuration's section changed in its text: comments, order and everything else stay as they are."""

from __future__ import annotations

from collections.abc import Mapping

import yaml

Value = str | int | float
Edit = tuple[int, int, str]
"""From and to in the text, and what goes there."""


class KeysNotSet(Exception):
    """The text is not one in which they can be set: why, and the next step."""


def with_keys(text: str, section: str, changes: Mapping[str, Value]) -> str:
    """The text with the section's keys set; raise KeysNotSet."""
    node = _section(text, section)
    there = {key.value: value for key, value in node.value}
    edits = [_replaced(there[key], key, value) for key, value in changes.items() if key in there]
    added = {key: value for key, value in changes.items() if key not in there}
    if added:
        edits.append(_added(text, node, added))
    for begin, end, fresh in sorted(edits, reverse=True):
        text = text[:begin] + fresh + text[end:]
    if {key: yaml.safe_load(text)[section].get(key) for key in changes} != dict(changes):
        raise KeysNotSet(f"{section} cannot be changed in this text. Set the keys by hand")
    return text


def _section(text: str, section: str) -> yaml.MappingNode:
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    pairs = root.value if isinstance(root, yaml.MappingNode) else []
    node = next((value for key, value in pairs if key.value == section), None)
    if not isinstance(node, yaml.MappingNode) or not node.value:
        raise KeysNotSet(f"there is no section {section} with keys. Set them by hand")
    return node


def _replaced(node: yaml.Node, key: str, value: Value) -> Edit:
    if not isinstance(node, yaml.ScalarNode) or node.style in ("|", ">"):
        raise KeysNotSet(f"{key} holds no plain value. Set it by hand")
    return node.start_mark.index, node.end_mark.index, str(value)


def _added(text: str, node: yaml.MappingNode, added: Mapping[str, Value]) -> Edit:
    """New keys in the section's style: behind the last where it is in braces, else before the first."""
    last = node.value[-1][1].end_mark.index
    if node.flow_style:
        return last, last, "".join(f", {key}: {value}" for key, value in added.items())
    first = node.value[0][0].start_mark
    indent = " " * first.column
    begin = first.index - first.column
    return begin, begin, "".join(f"{indent}{key}: {value}\n" for key, value in added.items())
