"""What the YAML library finds wrong with a file, in words for who wrote the file, with what to do."""

from __future__ import annotations

import re

import yaml

_INDENT = "Keys of one section stand one below the other, indented alike, by spaces"

# By what the library says. {0} … are its groups, {opened} is the line where what it was reading began.
_WORDS = (
    (r"found character '\\t'", "a tab; indent by spaces"),
    (r"found character '(.)' that cannot", "text that begins with {0} has to be put in quotes"),
    (
        r"mapping values are not allowed",
        "a colon where none can stand. Begin each key on a line of its own, with a colon after it; put text that holds "
        "a colon in quotes",
    ),
    (r"expected ',' or '([]}])'", "the bracket opened in line {opened} is not closed by {0}, or a comma is missing"),
    (r"expected <block end>, but found '([]}])'", "the bracket {0} closes none"),
    (r"expected <block end>, but found ':'", "a colon without a key before it"),
    (r"expected <block end>", "indented otherwise than line {opened}, where its section begins. " + _INDENT),
    (r"sequence entries are not allowed", "a list's dash where none can stand. Begin each entry on a line of its own"),
    (r"expected the node content, but found '?(.)'?", "a value is missing before {0}"),
    (r"found unexpected end of stream", "the quote opened in line {opened} is not closed"),
    (
        r"unknown escape|expected escape sequence",
        "in double quotes a \\ begins a character's code. Put the text in single quotes",
    ),
    (r"could not find expected ':'", "a key without its colon. Write `key: value`"),
    (r"found undefined alias", "text that begins with * has to be put in quotes"),
    (r"found unconstructable recursive node", "refers to itself by * and &. Write it out"),
    (r"expected alphabetic or numeric", "text that begins with * or & has to be put in quotes"),
    (r"but found another document|expected '<document start>'", "goes on after its end. One file is one configuration"),
    (r"expected a comment or a line break", "after | or > text begins on the next line. Put it in quotes instead"),
)


class FileLoader(yaml.SafeLoader):
    """YAML as usual, but without what would be lost or changed without a word."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """A node; those that name their own type are refused."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if getattr(event, "tag", None) is not None:
            raise _mistake("text that begins with ! has to be put in quotes", event.start_mark)
        return super().compose_node(parent, index)


def _mistake(words: str, mark: yaml.Mark) -> yaml.MarkedYAMLError:
    return yaml.constructor.ConstructorError(None, None, words, mark)


def _unique_mapping(loader: FileLoader, node: yaml.MappingNode) -> dict[str, object]:
    """Keys as text; one that stands twice is an error: the first would be lost."""
    seen: dict[str, int] = {}
    for key_node, _ in node.value:
        if not isinstance(key_node, yaml.ScalarNode):
            raise _mistake("a key is not a plain word", key_node.start_mark)
        key, line = key_node.value, key_node.start_mark.line + 1
        if key in seen:
            raise _mistake(f"key {key!r} stands twice, first in line {seen[key]}", key_node.start_mark)
        seen[key] = line
    return {key.value: loader.construct_object(value, deep=True) for key, value in node.value}


def _decimal_integer(loader: FileLoader, node: yaml.ScalarNode) -> int:
    """An integer; YAML 1.1 would read 05020 as octal 2576, and 1:30 as 90."""
    digits = node.value.lstrip("+-")
    if len(digits) > 1 and digits[0] == "0" and digits[1].isdigit():
        raise _mistake(f"{node.value} begins with 0; write {digits.lstrip('0') or '0'}", node.start_mark)
    if ":" in digits:
        raise _mistake(f"{node.value} is no plain number; write it without a colon, or in quotes", node.start_mark)
    if len(digits) > _LONGEST_NUMBER:
        raise _mistake(f"a number of {len(digits)} digits", node.start_mark)
    return loader.construct_yaml_int(node)


def _date(loader: FileLoader, node: yaml.ScalarNode) -> object:
    """A date, where it is one."""
    try:
        return loader.construct_yaml_timestamp(node)
    except ValueError as error:
        raise _mistake(f"{node.value} is no date ({error}); put it in quotes if it is text", node.start_mark) from error


_LONGEST_NUMBER = 1000

FileLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _unique_mapping)
FileLoader.add_constructor("tag:yaml.org,2002:int", _decimal_integer)
FileLoader.add_constructor("tag:yaml.org,2002:timestamp", _date)


def in_words(error: yaml.MarkedYAMLError) -> str:
    """Line and column, what is wrong there, and what to do."""
    mark = error.problem_mark
    where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
    problem = error.problem or error.context or ""
    opened = error.context_mark.line + 1 if error.context_mark else "?"
    for pattern, words in _WORDS:
        found = re.search(pattern, problem)
        if found:
            return where + words.format(*found.groups(), opened=opened)
    return where + problem


def unreadable(error: Exception, text: str) -> str:
    """What is wrong with a file's text where the library does not say in which line."""
    if isinstance(error, RecursionError):
        return "brackets are nested too deeply. Take some out"
    if isinstance(error, OverflowError):
        return "holds the code of a character (\\U…) that does not exist. Write the character itself"
    if isinstance(error, yaml.reader.ReaderError):
        line = text.count("\n", 0, error.position) + 1
        return f"line {line}: holds a control character (code {error.character}). Write the line anew"
    return " ".join(str(error).split())
