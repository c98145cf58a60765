"""Small faults as somebody could write them, put into Python by its tree and into C by tokens."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterator

    Operators: TypeAlias = dict[type[ast.AST], type[ast.AST]]


class Fault(NamedTuple):
    """One change of a source text.

    Attributes
    ----------
    line
        Where it begins, from 1.
    begin, end
        What is taken out, in bytes of UTF-8.
    old, new
        What stood there, and what stands there then.
    """

    line: int
    begin: int
    end: int
    old: str
    new: str

    def put_into(self, source: str) -> str:
        """Change a text."""
        raw = source.encode()
        return (raw[: self.begin] + self.new.encode() + raw[self.end :]).decode()

    def __str__(self) -> str:
        """Say it in a line."""
        return f"`{_one_line(self.old)}` → `{_one_line(self.new)}`"


def _one_line(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


_COMPARED: Operators = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_AT_ITS_LIMIT: Operators = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
"""For whole numbers: of what is measured no value ever is exactly the limit."""
_COMPUTED: Operators = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Mod: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Pow: ast.Mult, ast.MatMult: ast.Add, ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd, ast.BitXor: ast.BitOr, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}  # fmt: skip
_JOINED: Operators = {ast.And: ast.Or, ast.Or: ast.And}


def python_faults(source: str) -> list[Fault]:
    """List the faults that a Python file can be given, one at a time, in order of place.

    Comparisons, arithmetic, conditions and numbers are changed, calls whose value nobody wants are
    left out. What is only for readers and for mypy stays: docstrings, annotations, texts, logging.
    """
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node, changed in _changes(ast.parse(source)):
        begin = starts[node.lineno - 1] + node.col_offset
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        end = starts[node.end_lineno - 1] + node.end_col_offset
        old = source.encode()[begin:end].decode()
        new = ast.unparse(changed)
        if isinstance(node, ast.expr) and not isinstance(changed, ast.Constant):
            new = f"({new})"
        found.append(Fault(node.lineno, begin, end, old, new))
    return sorted(found, key=lambda one: (one.begin, one.end, one.new))


def _changes(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    """Give each node that can be changed, with what it is changed into."""
    if isinstance(node, ast.expr | ast.stmt):
        for changed in _changed(node):
            yield node, changed
    if isinstance(node, ast.Raise):  # its words are for readers
        return
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns", "decorator_list", "bases", "type_params"}:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not _only_read(child):
                yield from _changes(child)


def _only_read(node: ast.AST) -> bool:
    """Whether nothing that is computed depends on it."""
    match node:
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.Expr(value=ast.Constant()) | ast.JoinedStr() | ast.Assert():
            return True
        case ast.keyword("strict", ast.Constant(True)):  # an assertion of zip
            return True
        case ast.Expr(value=ast.Call(func=ast.Attribute(value=ast.Name(id="log")))):
            return True
        case ast.Assign(targets=[ast.Name(id="__all__" | "__slots__")]):
            return True
    return False


def _changed(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Compare(left, [first, *others], comparators):
            whole = any(_is_whole(one) for one in (left, *comparators))
            table = _AT_ITS_LIMIT if whole and type(first) in _AT_ITS_LIMIT else _COMPARED
            yield ast.Compare(left, [table[type(first)](), *others], comparators)  # type: ignore[list-item]
        case ast.BinOp(left, operator, right) if not _is_text(left) and not _is_text(right):
            yield ast.BinOp(left, _COMPUTED[type(operator)](), right)  # type: ignore[arg-type]
        case ast.AugAssign(target, operator, value):
            yield ast.AugAssign(target, _COMPUTED[type(operator)](), value)  # type: ignore[arg-type]
        case ast.BoolOp(operator, values):
            yield ast.BoolOp(_JOINED[type(operator)](), values)  # type: ignore[arg-type]
        case ast.UnaryOp(ast.Not() | ast.USub(), operand):
            yield operand
        case ast.IfExp(test, body, otherwise):
            yield ast.IfExp(test, otherwise, body)
        case ast.Constant(bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(int(value)):
            yield ast.Constant(value + 1)
        case ast.Constant(float(value)):
            yield ast.Constant(2.0 * value or 1.0)
        case ast.Expr(value=ast.Call()) | ast.Raise():
            yield ast.Pass()


def _is_whole(node: ast.AST) -> bool:
    match node:
        case ast.Constant(int()) | ast.Call(func=ast.Name(id="len")):
            return True
    return False


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    )


_C_TOKENS = re.compile(
    r"""(?P<skip>/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|^[ \t]*\#(?:\\\n|[^\n])*)
    |(?P<number>\b(?:0x[0-9a-fA-F]+|\d+)(?=[uUlL]*\b))
    |(?P<operator><<=?|>>=?|<=|>=|==|!=|&&|\|\||\+\+|--|->|[-+*/%&|^]=?|<|>|!(?!=)|~)
    |(?P<call>^[ \t]+[a-z_]\w*\((?:[^()"']|\([^()]*\))*\);)""",
    re.MULTILINE | re.DOTALL | re.VERBOSE,
)
_C_OTHERS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "&&": "||", "||": "&&",
    "+": "-", "-": "+", "/": "*", "%": "/", "|": "&", "^": "|", "<<": ">>", ">>": "<<",
    "+=": "-=", "-=": "+=", "|=": "&=", "&=": "|=", "++": "--", "--": "++", "!": "", "~": "",
}  # fmt: skip
_PLACED = {"&", "*"}  # which may as well be an address and what is there


def c_faults(source: str) -> list[Fault]:
    """List the faults that a C file can be given, as `python_faults` does."""
    found = []
    for token in _C_TOKENS.finditer(source):
        kind, old = token.lastgroup, token.group()
        begin = token.start()
        if kind == "number":
            new = str(int(old, 0) + 1)
        elif kind == "call":
            begin += len(old) - len(old.lstrip())
            old, new = old.lstrip(), ";"
        elif kind == "operator" and old in _C_OTHERS:
            new = _C_OTHERS[old]
        elif (
            old in _PLACED
            and source[begin - 1 : begin] == source[token.end() : token.end() + 1] == " "
        ):
            new = {"&": "|", "*": "+"}[old]
        else:
            continue
        at = len(source[:begin].encode())
        line = source.count("\n", 0, begin) + 1
        found.append(Fault(line, at, at + len(old.encode()), old, new))
    return found
