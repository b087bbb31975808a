"""Structured Text (IEC 61131-3), the part that `controllers/iec61131` uses, checked for types and made to run.

The grammar is others' (tree-sitter-iec61131-3-st); types and meaning are ours, and stricter than compilers: no
conversion that is not written down, no value that does not fit, no index outside of its array. What it does not know it
refuses.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from tests.support.real_parts import missing

try:
    import tree_sitter_iec61131_3_st
    from tree_sitter import Language, Node, Parser
except ImportError:
    tree_sitter_iec61131_3_st = None

RANGES = {
    "INT": (-(2**15), 2**15 - 1),
    "DINT": (-(2**31), 2**31 - 1),
    "UINT": (0, 2**16 - 1),
    "UDINT": (0, 2**32 - 1),
    "WORD": (0, 2**16 - 1),
    "DWORD": (0, 2**32 - 1),
    "BOOL": (0, 1),
}
NUMBERS, BITS = ("INT", "DINT", "UINT", "UDINT"), ("BOOL", "WORD", "DWORD")
WIDTHS = {"WORD": 16, "DWORD": 32}
LITERAL = "literal"  # an integer that takes the type of what it meets
COMPARISONS = {"=": "==", "<>": "!=", "<": "<", ">": ">", "<=": "<=", ">=": ">="}
LOGIC = {"AND": "&", "OR": "|", "XOR": "^"}


class StructuredTextError(Exception):
    """The text cannot be compiled, or it did at run time what no controller defines."""


@dataclass(frozen=True)
class Type:
    """An elementary type, an array of one that begins at 0 (size 0 = no array), or an instance of a function block."""

    name: str
    size: int = 0
    block: str = ""


@dataclass
class Variable:
    """A declared name."""

    type: Type
    section: str
    initial: Any = 0  # a number, or a list of them for an array


@dataclass
class Unit:
    """A function or function block: its names, and its body as Python."""

    name: str
    variables: dict[str, Variable]
    result: Type | None = None
    code: str = ""
    inputs: list[str] = field(default_factory=list)


def parse(text: str) -> Any:
    """The tree's root; StructuredTextError with the place of the first fault. Skips where the grammar is not here."""
    if tree_sitter_iec61131_3_st is None:
        missing("tree-sitter-iec61131-3-st is not here. Install it: pip install -e '.[dev]'")
    root = Parser(Language(tree_sitter_iec61131_3_st.language())).parse(text.encode()).root_node
    for node in _walk(root):
        if node.is_error or node.is_missing:
            row, column = node.start_point
            raise StructuredTextError(f"line {row + 1}, column {column + 1}: not understood: {_text(node)[:60]!r}")
    return root


def _walk(node: Node) -> Iterator[Node]:
    yield node
    for child in node.children:
        yield from _walk(child)


def _text(node: Node) -> str:
    return node.text.decode()


class Program:
    """All units of a text, compiled; `block(name)` makes an instance of a function block."""

    def __init__(self, text: str) -> None:
        self.units: dict[str, Unit] = {}
        self._names: dict[str, Any] = {"fits": _fits, "at": _at, "StructuredTextError": StructuredTextError}
        for node in parse(text).named_children:
            if node.type in ("function_declaration", "function_block_declaration", "program_declaration"):
                unit = _Compiler(self.units).unit(node)
                self.units[unit.name] = unit
                exec(compile(unit.code, unit.name, "exec"), self._names)
            elif node.type != "comment":
                raise StructuredTextError(f"line {node.start_point[0] + 1}: {node.type} is not known here")

    def block(self, name: str) -> Block:
        """A new instance, everything at its initial value, and those within it."""
        block = Block(self.units[name], self._names[name])
        for inner, variable in self.units[name].variables.items():
            if variable.type.block:
                setattr(block, inner, self.block(variable.type.block))
        return block

    def call(self, name: str, *arguments: int) -> int:
        """A function's value."""
        return int(self._names[name](*arguments))


class Block:
    """An instance of a function block: variables by name; `scan` runs its body once."""

    def __init__(self, unit: Unit, body: Any) -> None:
        self._unit, self._body = unit, body
        for name, variable in unit.variables.items():
            size = variable.type.size
            initial = variable.initial
            setattr(self, name, list(initial) if isinstance(initial, list) else [initial] * size if size else initial)

    def scan(self, **inputs: Any) -> None:
        """Set inputs, which are checked as any value, and run the body."""
        for name, value in inputs.items():
            variable = self._unit.variables[name]
            if variable.section not in ("var_input", "var_in_out"):
                raise StructuredTextError(f"{name} is no input")
            setattr(self, name, value if variable.type.size else _fits(value, *RANGES[variable.type.name]))
        self._body(self)

    def restarted(self) -> Block:
        """The instance after a start of the controller: what is RETAIN is kept, all else as at first."""
        fresh = Block(self._unit, self._body)
        for name, variable in self._unit.variables.items():
            if variable.section == "retain":
                setattr(fresh, name, getattr(self, name))
        return fresh


def _fits(value: int, low: int, high: int) -> int:
    if not low <= value <= high:
        raise StructuredTextError(f"{value} does not fit, {low} to {high} does")
    return int(value)


def _at(index: int, size: int) -> int:
    if not 0 <= index < size:
        raise StructuredTextError(f"index {index} of an array 0..{size - 1}")
    return index


class _Compiler:
    """One unit to Python: functions become functions, blocks become functions of their instance."""

    def __init__(self, units: dict[str, Unit]) -> None:
        self._units = units
        self._variables: dict[str, Variable] = {}
        self._lines: list[str] = []
        self._prefix = ""

    def unit(self, node: Node) -> Unit:
        """The unit, compiled; StructuredTextError with its line."""
        name = _text(node.child_by_field_name("name"))
        kind = node.child_by_field_name("return_type")
        for section in node.named_children:
            if section.type.startswith("var_"):
                self._declare(section)
        inputs = [key for key, variable in self._variables.items() if variable.section == "var_input"]
        result = None
        if kind is not None:
            result = self._type(kind)
            self._variables[name] = Variable(result, "result")
            self._lines.append(f"def {name}({', '.join(map(_safe, inputs))}):")
            for key, variable in self._variables.items():
                if variable.section != "var_input":
                    self._lines.append(f"    {_safe(key)} = {variable.initial}")
        else:
            self._prefix = "self."
            self._lines.append(f"def {name}(self):")
        self._block(node.children_by_field_name("body"), 1)
        if kind is not None:
            self._lines.append(f"    return {_safe(name)}")
        return Unit(name, self._variables, result, "\n".join(self._lines), inputs)

    def _declare(self, section: Node) -> None:
        qualifiers = {_text(node).lower() for node in _walk(section) if node.type == "var_qualifier"}
        kind = "constant" if "constant" in qualifiers else "retain" if "retain" in qualifiers else section.type
        for line in section.named_children:
            if line.type != "variable_declaration":
                continue
            declared = self._type(line.child_by_field_name("type"))
            initial = line.children_by_field_name("initial_value")
            value = self._initial(initial, declared) if initial else 0
            for name in line.children_by_field_name("names"):
                if _text(name).lower() in {known.lower() for known in self._variables}:
                    raise self._wrong(name, f"{_text(name)} is declared twice (case does not count)")
                self._variables[_text(name)] = Variable(declared, kind, value)

    def _initial(self, nodes: list[Node], declared: Type) -> Any:
        literals = [child for node in nodes for child in _walk(node) if child.type == "integer_literal"]
        values = [_fits(_number(_text(literal)), *RANGES[declared.name]) for literal in literals]
        if len(values) != (declared.size or 1):
            raise self._wrong(nodes[0], f"{len(values)} initial values for {declared.size or 1}")
        return values if declared.size else values[0]

    def _type(self, node: Node) -> Type:
        if node.type == "array_type":
            bounds = node.child_by_field_name("range")
            if _text(bounds.child_by_field_name("lower")) != "0":
                raise self._wrong(node, "arrays begin at 0 here")
            element = self._type(node.child_by_field_name("element_type"))
            return Type(element.name, int(_text(bounds.child_by_field_name("upper"))) + 1)
        if _text(node) in self._units:
            return Type("block", block=_text(node))
        if _text(node) not in RANGES:
            raise self._wrong(node, f"type {_text(node)} is not known here")
        return Type(_text(node))

    # --- statements ----------------------------------------------------------------------------------------------

    def _block(self, nodes: list[Node], depth: int) -> None:
        before = len(self._lines)
        for node in nodes:
            if node.type not in ("comment", "empty_statement"):
                statement = getattr(self, f"_{node.type}", None)
                if statement is None:
                    raise self._wrong(node, f"{node.type} is not known here")
                statement(node, depth)
        if len(self._lines) == before:
            self._lines.append("    " * depth + "pass")

    def _assignment_statement(self, node: Node, depth: int) -> None:
        target, goal = self._expression(node.child_by_field_name("left"))
        name = _text(node.child_by_field_name("left")).split("[")[0]
        if self._variables[name].section in ("var_input", "constant"):
            raise self._wrong(node, f"{name} is an input or a constant, it cannot be assigned to")
        code, kind = self._expression(node.child_by_field_name("right"))
        self._must_be(node, kind, goal)
        low, high = RANGES[goal]
        self._lines.append("    " * depth + f"{target} = fits({code}, {low}, {high})")

    def _invocation_statement(self, node: Node, depth: int) -> None:
        """A scan of an instance: inputs by name, checked against the block's."""
        call = next(child for child in _walk(node) if child.type == "call_expression")
        name = call.child_by_field_name("function")
        block = self._units[self._known(name).type.block]
        given = []
        for argument in call.child_by_field_name("arguments").named_children:
            key, value = _text(argument.child_by_field_name("name")), argument.child_by_field_name("value")
            wanted = block.variables[key].type
            if wanted.size:
                if self._known(value).type != wanted:
                    raise self._wrong(argument, f"{_text(value)} is not the array that {key} is")
                given.append(f"{key}={self._prefix}{_text(value)}")
            else:
                code, kind = self._expression(value)
                self._must_be(argument, kind, wanted.name)
                given.append(f"{key}={code}")
        self._lines.append("    " * depth + f"{self._prefix}{_text(name)}.scan({', '.join(given)})")

    def _if_statement(self, node: Node, depth: int) -> None:
        self._branch("if", node, "consequence", depth)
        for clause in node.named_children:
            if clause.type == "elsif_clause":
                self._branch("elif", clause, "body", depth)
            elif clause.type == "else_clause":
                self._lines.append("    " * depth + "else:")
                self._block(clause.children_by_field_name("body"), depth + 1)

    def _branch(self, word: str, node: Node, body: str, depth: int) -> None:
        self._lines.append("    " * depth + f"{word} {self._condition(node)}:")
        self._block(node.children_by_field_name(body), depth + 1)

    def _condition(self, node: Node) -> str:
        code, kind = self._expression(node.child_by_field_name("condition"))
        self._must_be(node, kind, "BOOL")
        return code

    def _while_statement(self, node: Node, depth: int) -> None:
        self._lines.append("    " * depth + f"while {self._condition(node)}:")
        self._block(node.children_by_field_name("body"), depth + 1)

    def _for_statement(self, node: Node, depth: int) -> None:
        control, kind = self._expression(node.child_by_field_name("control"))
        ends = [self._expression(node.child_by_field_name(end)) for end in ("start", "end")]
        for _, end in ends:
            self._must_be(node, end, kind)
        self._lines.append("    " * depth + f"for {control} in range({ends[0][0]}, {ends[1][0]} + 1):")
        self._block(node.children_by_field_name("body"), depth + 1)

    # --- expressions: Python and the type ------------------------------------------------------------------------

    def _expression(self, node: Node) -> tuple[str, str]:
        if node.type == "integer_literal":
            return str(_number(_text(node))), LITERAL
        if node.type == "boolean_literal":
            return ("1" if _text(node).upper() == "TRUE" else "0"), "BOOL"
        if node.type == "typed_literal":
            kind = _text(node.child_by_field_name("type"))
            value = _number(_text(node.child_by_field_name("value")))
            return str(_fits(value, *RANGES[kind])), kind
        if node.type == "parenthesized_expression":
            code, kind = self._expression(node.named_children[0])
            return f"({code})", kind
        maker = getattr(self, f"_{node.type}", None)
        if maker is None:
            raise self._wrong(node, f"{node.type} is not known here")
        code, kind = maker(node)
        return code, kind

    def _identifier(self, node: Node) -> tuple[str, str]:
        variable = self._known(node)
        if variable.type.size:
            raise self._wrong(node, f"{_text(node)} is an array")
        return self._prefix + _safe(_text(node)), variable.type.name

    def _member_access_expression(self, node: Node) -> tuple[str, str]:
        whole, member = node.child_by_field_name("object"), node.child_by_field_name("member")
        variable = self._units[self._known(whole).type.block].variables.get(_text(member))
        if variable is None or variable.section != "var_output" or variable.type.size:
            raise self._wrong(node, f"{_text(member)} is no output of {_text(whole)}")
        return f"{self._prefix}{_text(whole)}.{_text(member)}", variable.type.name

    def _index_expression(self, node: Node) -> tuple[str, str]:
        whole = node.child_by_field_name("object")
        variable = self._known(whole)
        code, kind = self._expression(node.child_by_field_name("index"))
        if kind not in (*NUMBERS, LITERAL) or not variable.type.size:
            raise self._wrong(node, f"{_text(node)}: an array and a number are expected")
        return f"{self._prefix}{_safe(_text(whole))}[at({code}, {variable.type.size})]", variable.type.name

    def _known(self, node: Node) -> Variable:
        if _text(node) not in self._variables:
            raise self._wrong(node, f"{_text(node)} is not declared")
        return self._variables[_text(node)]

    def _unary_expression(self, node: Node) -> tuple[str, str]:
        code, kind = self._expression(node.named_children[-1])
        if _text(node.children[0]).upper() != "NOT" or kind != "BOOL":
            raise self._wrong(node, f"{_text(node)}: only NOT of a BOOL is known here")
        return f"(1 - ({code}))", "BOOL"

    def _binary_expression(self, node: Node) -> tuple[str, str]:
        (left, one), (right, other) = (self._expression(node.child_by_field_name(side)) for side in ("left", "right"))
        operator = _text(node.child_by_field_name("operator")).upper()
        kind = other if one == LITERAL else one
        for seen in (one, other):
            self._must_be(node, seen, kind)
        if operator in COMPARISONS and (operator in ("=", "<>") or kind in (*NUMBERS, LITERAL)):
            return f"(({left}) {COMPARISONS[operator]} ({right}))", "BOOL"
        if operator in LOGIC and kind in BITS:
            return f"(({left}) {LOGIC[operator]} ({right}))", kind
        if operator in ("+", "-", "*", "MOD") and kind in (*NUMBERS, LITERAL):
            sign = "%" if operator == "MOD" else operator
            low, high = RANGES["DINT" if kind == LITERAL else kind]
            return f"fits(({left}) {sign} ({right}), {low}, {high})", kind
        raise self._wrong(node, f"{operator} of {kind} is not defined")

    def _call_expression(self, node: Node) -> tuple[str, str]:
        name = _text(node.child_by_field_name("function"))
        given = node.child_by_field_name("arguments").named_children
        if name in self._units:
            return self._own(node, self._units[name], given)
        arguments = [self._expression(argument) for argument in given]
        conversion = re.fullmatch(r"([A-Z]+)_TO_([A-Z]+)", name)
        if conversion and len(arguments) == 1:
            return self._converted(node, *conversion.groups(), arguments[0])
        if name in ("SHL", "SHR") and len(arguments) == 2 and arguments[0][1] in WIDTHS:
            (code, kind), (count, _) = arguments
            mask = 2 ** WIDTHS[kind] - 1
            return f"((({code}) {'<<' if name == 'SHL' else '>>'} ({count})) & {mask})", kind
        if name in ("MIN", "MAX") and len(arguments) == 2 and arguments[0][1] in NUMBERS:
            self._must_be(node, arguments[1][1], arguments[0][1])
            return f"{name.lower()}({arguments[0][0]}, {arguments[1][0]})", arguments[0][1]
        raise self._wrong(node, f"{name} with {len(arguments)} arguments is not known here")

    def _own(self, node: Node, unit: Unit, given: list[Node]) -> tuple[str, str]:
        values: dict[str, tuple[str, str]] = {}
        for place, argument in enumerate(given):
            named = argument.type == "named_argument"
            name = _text(argument.child_by_field_name("name")) if named else unit.inputs[place]
            values[name] = self._expression(argument.child_by_field_name("value") if named else argument)
        if list(values) != unit.inputs:
            raise self._wrong(node, f"{unit.name} takes {unit.inputs}, given are {list(values)}")
        for name, (_, kind) in values.items():
            self._must_be(node, kind, unit.variables[name].type.name)
        assert unit.result is not None
        return f"{unit.name}({', '.join(code for code, _ in values.values())})", unit.result.name

    def _converted(self, node: Node, source: str, goal: str, argument: tuple[str, str]) -> tuple[str, str]:
        code, kind = argument
        if source not in RANGES or goal not in RANGES:
            raise self._wrong(node, f"{source}_TO_{goal} is not known here")
        self._must_be(node, kind, source)
        low, high = RANGES[goal]
        if source in WIDTHS or goal in WIDTHS:  # bits stay as they are; where the goal is signed, two's complement
            width = 32 if high > 2**16 else 16
            code = f"(({code}) & {2**width - 1})"
            if low < 0:
                code = f"(({code} ^ {1 << (width - 1)}) - {1 << (width - 1)})"
            return code, goal
        return f"fits({code}, {low}, {high})", goal

    def _must_be(self, node: Node, seen: str, expected: str) -> None:
        if seen == expected or (seen == LITERAL and expected in NUMBERS):
            return
        raise self._wrong(node, f"{_text(node)[:70]!r}: {seen} where {expected} is expected")

    def _wrong(self, node: Node, what: str) -> StructuredTextError:
        return StructuredTextError(f"line {node.start_point[0] + 1}: {what}")


def _safe(name: str) -> str:
    return f"{name}_" if name in ("register", "pass", "from", "in", "is", "not", "with") else name


def _number(text: str) -> int:
    base, _, digits = text.replace("_", "").rpartition("#")
    return int(digits, int(base) if base else 10)


@functools.cache
def compiled(text: str) -> Program:
    """The program of a text, compiled once."""
    return Program(text)
