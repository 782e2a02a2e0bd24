"""Run a function block of structured text: the part of IEC 61131-3 that plantune writes.

`FunctionBlock(text)` is an instance; `block(sp=1.0, pv=0.5)` calls it once and returns the outputs.
Types are LREAL, INT and BOOL, and arrays of them, and nothing is converted: a sum of an INT and an
LREAL is an error here, as it is on a strict controller.  An INT that leaves 16 bits, an index that
leaves its array, and an assignment to an input or a constant are errors too.
"""

import re
from dataclasses import dataclass

TOKEN = re.compile(
    r"""\s+ | \(\*.*?\*\)                              # blanks and comments, skipped
    | (?P<real>\d+\.\d+(E[+-]?\d+)?) | (?P<int>\d+)
    | (?P<word>[A-Za-z](_?[A-Za-z0-9])*)
    | (?P<sign>:=|\.\.|<=|>=|<>|[-+*/=<>()\[\];:,])""",
    re.VERBOSE | re.DOTALL,
)
DEFAULT = {"LREAL": 0.0, "INT": 0, "BOOL": False}
KIND = {float: "LREAL", int: "INT", bool: "BOOL"}
# Operators between two bars bind equally and to the left.
WEAKEST = "OR|XOR|AND|= <>|< > <= >=|+ -|* / MOD"
BINARY = [operators.split() for operators in WEAKEST.split("|")]
NUMBERS, ANY = ("LREAL", "INT"), ("LREAL", "INT", "BOOL")
TAKES = {"OR": ("BOOL",), "XOR": ("BOOL",), "AND": ("BOOL",), "=": ANY, "<>": ANY, "MOD": ("INT",)}
DOES = {
    "OR": lambda a, b: a | b,
    "XOR": lambda a, b: a ^ b,
    "AND": lambda a, b: a & b,
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b if isinstance(a, float) else int(a / b),
    "MOD": lambda a, b: a - b * int(a / b),
}


class Wrong(Exception):  # noqa: N818 - it says what the text is
    """Not of the language, or not what its types allow."""


@dataclass
class Variable:
    """A declared name: where it stands, what it holds, and for an array the bounds of its index."""

    section: str
    kind: str
    value: object
    bounds: tuple[int, int] | None = None


class FunctionBlock:
    """An instance of the block in a text, which must hold exactly one."""

    def __init__(self, text):
        self.variables = {}
        self.statements = Parser(text, self.variables).block()

    def __call__(self, **inputs):
        """Assign inputs, run the body once, return the outputs: one alone, or a dict."""
        for name, value in inputs.items():
            variable = self.variables[name.upper()]
            if variable.section != "VAR_INPUT" or KIND[type(value)] != variable.kind:
                raise Wrong(f"{name} is no input of type {variable.kind}")
            variable.value = value
        run(self.statements)
        outputs = {n: v.value for n, v in self.variables.items() if v.section == "VAR_OUTPUT"}
        return next(iter(outputs.values())) if len(outputs) == 1 else outputs


def run(statements):
    """Run statements one after the other."""
    for statement in statements:
        statement()


class Parser:
    """Recursive descent; expressions become (kind, function without arguments)."""

    def __init__(self, text, variables):
        self.tokens, self.at, self.variables = list(tokens(text)), 0, variables

    def next(self):
        """Return the next token, upper case."""
        return self.tokens[self.at] if self.at < len(self.tokens) else ("end", "")

    def take(self, *expected):
        """Consume the next token, which must be one of these texts, or of these classes."""
        token = self.next()
        if expected and token[1] not in expected and token[0] not in expected:
            raise Wrong(f"{token[1]!r} where {' or '.join(expected)} should be")
        self.at += 1
        return token[1]

    def has(self, *texts):
        """Consume the next token if it is one of these."""
        return self.take() if self.next()[1] in texts else None

    def block(self):
        """FUNCTION_BLOCK name, sections, body."""
        self.take("FUNCTION_BLOCK")
        self.take("word")
        while self.next()[1] in ("VAR", "VAR_INPUT", "VAR_OUTPUT"):
            self.section()
        body = self.body("END_FUNCTION_BLOCK")
        self.take("END_FUNCTION_BLOCK")
        if self.next()[0] != "end":
            raise Wrong(f"{self.next()[1]!r} behind the block")
        return body

    def section(self):
        """Declarations up to END_VAR."""
        section = self.take()
        section += " CONSTANT" if self.has("CONSTANT") else ""
        while not self.has("END_VAR"):
            name = self.take("word")
            if name in self.variables:
                raise Wrong(f"{name} is declared twice")
            self.take(":")
            self.variables[name] = self.declared(section)
            self.take(";")

    def declared(self, section):
        """Return the variable of a type and its initial value."""
        if self.has("ARRAY"):
            self.take("[")
            low = int(self.take("int"))
            self.take("..")
            high = int(self.take("int"))
            self.take("]")
            self.take("OF")
            kind = self.take(*DEFAULT)
            return Variable(section, kind, [DEFAULT[kind]] * (high - low + 1), (low, high))
        kind = self.take(*DEFAULT)
        value = DEFAULT[kind]
        if self.has(":="):
            own, value = self.expression()
            value = value()
            if own != kind:
                raise Wrong(f"a {kind} begins as {own}")
        return Variable(section, kind, value)

    def body(self, *ends):
        """Return statements up to a word that ends them."""
        statements = []
        while self.next()[1] not in ends:
            statements.append(self.condition() if self.has("IF") else self.assignment())
        return statements

    def condition(self):
        """IF … THEN … ELSIF … ELSE … END_IF;"""
        branches = [self.branch()]
        while self.has("ELSIF"):
            branches.append(self.branch())
        otherwise = self.body("END_IF") if self.has("ELSE") else []
        self.take("END_IF")
        self.take(";")

        def choose():
            run(next((body for test, body in branches if test()), otherwise))

        return choose

    def branch(self):
        """Condition and statements."""
        kind, test = self.expression()
        if kind != "BOOL":
            raise Wrong(f"a condition is {kind}")
        self.take("THEN")
        return test, self.body("ELSIF", "ELSE", "END_IF")

    def assignment(self):
        """`name := …;` or `name[…] := …;`."""
        name = self.take("word")
        variable = self.variable(name)
        if variable.section in ("VAR_INPUT", "VAR CONSTANT"):
            raise Wrong(f"{name} must not be assigned")
        place = self.index(variable)
        self.take(":=")
        kind, value = self.expression()
        self.take(";")
        if kind != variable.kind:
            raise Wrong(f"{name} is {variable.kind}, not {kind}")

        def assign():
            if place is None:
                variable.value = value()
            else:
                variable.value[place()] = value()

        return assign

    def variable(self, name):
        """Return a declared variable."""
        if name not in self.variables:
            raise Wrong(f"{name} is not declared")
        return self.variables[name]

    def index(self, variable):
        """Return where in its array an index points; None for a scalar."""
        if variable.bounds is None:
            return None
        self.take("[")
        kind, index = self.expression()
        self.take("]")
        low, high = variable.bounds

        def place():
            at = index()
            if kind != "INT" or not low <= at <= high:
                raise Wrong(f"index {at} of an array from {low} to {high}")
            return at - low

        return place

    def expression(self, level=0):
        """Binary operators, the weakest first."""
        if level == len(BINARY):
            return self.unary()
        kind, value = self.expression(level + 1)
        while operator := self.has(*BINARY[level]):
            other = self.expression(level + 1)
            kind, value = joined(operator, (kind, value), other)
        return kind, value

    def unary(self):
        """NOT, a sign, or what they stand before."""
        if self.has("NOT"):
            kind, value = self.unary()
            if kind != "BOOL":
                raise Wrong(f"NOT {kind}")
            return kind, lambda: not value()
        if self.has("-"):
            kind, value = self.unary()
            if kind == "BOOL":
                raise Wrong("minus BOOL")
            return kind, lambda: -value()
        return self.primary()

    def primary(self):
        """A literal, a variable, or brackets."""
        if self.has("("):
            inner = self.expression()
            self.take(")")
            return inner
        kind, text = self.next()
        self.take("real", "int", "word")
        if kind == "word" and text not in ("TRUE", "FALSE"):
            variable = self.variable(text)
            place = self.index(variable)
            if place is None:
                return variable.kind, lambda: variable.value
            return variable.kind, lambda: variable.value[place()]
        literal = {"real": float, "int": int, "word": lambda word: word == "TRUE"}[kind](text)
        return KIND[type(literal)], lambda: literal


def joined(operator, left, right):
    """Return a binary operation, its types checked."""
    (kind, a), (other, b) = left, right
    if kind != other or kind not in TAKES.get(operator, NUMBERS):
        raise Wrong(f"{kind} {operator} {other}")
    does = DOES[operator]
    compares = operator in ("=", "<>", "<", ">", "<=", ">=")

    def value():
        result = does(a(), b())
        if type(result) is int and not -32768 <= result <= 32767:
            raise Wrong(f"{result} is no INT")
        return result

    return "BOOL" if compares else kind, value


def tokens(text):
    """Cut a text into (class, upper-case text); the language knows no small letters."""
    at = 0
    while at < len(text):
        found = TOKEN.match(text, at)
        if found is None:
            raise Wrong(f"{text[at : at + 20]!r} is not of the language")
        at = found.end()
        if found.lastgroup is not None:
            kind = next(k for k in ("real", "int", "word", "sign") if found[k] is not None)
            yield kind, found[kind].upper()
