# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of Warp kernels to GLSL: compute programs share the source of the kernels on CPU and CUDA.

A kernel and all functions that it calls are translated from their syntax trees; types follow from their annotations.
A kernel's structs and arrays are global in GLSL, so a function with such parameters is written once for each
combination of arguments. shaders/kernels/kernel_language.glsl defines what GLSL lacks.

Supported: numbers, vectors, structs, reading arrays, writing elements of arrays, `if`, `while`, `for` over ranges,
several return values, random numbers and `mesh_query_ray`. Anything else raises `NotImplementedError` with its line.
"""

import ast
import inspect
import textwrap
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

_KINDS = dict.fromkeys((float, wp.float32, wp.float64), "float") | dict.fromkeys((int, wp.int32, wp.uint8), "int")
_KINDS |= {
    wp.uint32: "uint",
    bool: "bool",
    wp.bool: "bool",
    wp.uint64: "int",
}  # uint64: the id of a mesh, unused in GLSL
_KINDS |= {wp.vec2: "vec2", wp.vec3: "vec3", wp.vec4: "vec4", wp.vec3i: "ivec3"}
_ELEMENTS = {"vec2": "float", "vec3": "float", "vec4": "float", "ivec3": "int"}
_ZERO = {"float": "0.0", "int": "0", "uint": "0u", "bool": "false"}
_RAY = "MeshQueryRay"  # the type that `wp.mesh_query_ray` returns
_RAY_FIELDS = {"result": "bool", "t": "float", "u": "float", "v": "float", "face": "int", "normal": "vec3"}

_SIGNS = (
    "Add + Sub - Mult * Div / Mod % BitAnd & BitOr | BitXor ^ LShift << RShift >> "
    "Lt < LtE <= Gt > GtE >= Eq == NotEq != And && Or || USub - Not !"
).split()
_OPERATORS = {getattr(ast, name): sign for name, sign in zip(_SIGNS[::2], _SIGNS[1::2], strict=True)}
_COMPARISONS = "<", "<=", ">", ">=", "==", "!="
# (function of Warp, number of arguments) → (GLSL, type of the result; None: the type of the first argument).
_CALLS = {
    **{(name, 1): (f"{name}({{0}})", None) for name in ("sqrt", "exp", "log", "sin", "cos", "atan", "abs", "floor")},
    ("asin", 1): ("arc_sine({0})", None),
    ("atan2", 2): ("atan({0}, {1})", None),
    ("pow", 2): ("pow({0}, {1})", None),
    ("min", 2): ("min({0}, {1})", None),
    ("max", 2): ("max({0}, {1})", None),
    ("max", 1): ("greatest({0})", "float"),
    ("clamp", 3): ("clamp({0}, {1}, {2})", None),
    ("sign", 1): ("sign_of({0})", None),
    ("dot", 2): ("dot({0}, {1})", "float"),
    ("length", 1): ("length({0})", "float"),
    ("cross", 2): ("cross({0}, {1})", None),
    ("normalize", 1): ("unit_of({0})", None),
    ("rand_init", 2): ("rand_init({0}, {1})", "uint"),
}


@dataclass(frozen=True)
class Given:
    """A kernel parameter, or a member of a parameter; path: the parameter's name, then names of members."""

    path: tuple[str, ...]
    kind: Any  # a type of GLSL, `wp.struct` or `wp.array`

    @property
    def name(self) -> str:
        """Name in GLSL."""
        return "_".join(self.path)


@dataclass(frozen=True)
class KernelText:
    """The GLSL of a kernel: `source` defines `run_kernel()`, which reads `given`.

    members: numbers in the block `given`; arrays: arrays that the kernel reads; for each array, `given` has the index
    of its first element in the texture of its type, and its size along each further axis; written: {name: type} of
    arrays that the kernel writes by `write_NAME(index, value)`; has_mesh: whether the kernel traces rays through the
    triangles of a mesh.
    """

    source: str
    members: dict[str, Given]
    arrays: dict[str, Given]
    written: dict[str, str]
    has_mesh: bool


@dataclass(frozen=True)
class _Value:
    text: str
    kind: Any  # a type of GLSL, or `wp.struct`
    operator: str = ""  # the outermost operator

    def operand(self, *operators):
        """Return the text as an operand, in parentheses unless its outermost operator is among `operators`."""
        return f"({self.text})" if self.operator and self.operator not in operators else self.text


def kernel_text(kernel: wp.Kernel) -> KernelText:
    """Translate a kernel of one dimension."""
    program = _Program()
    parameters = {argument.label: argument.type for argument in kernel.adj.args}
    names = {name: Given((name,), kind_of(kind)) for name, kind in parameters.items()}
    body = _Function(program, kernel.func, names)
    text = body.text("void", "run_kernel", [])
    writing = [_writing(name, kind) for name, kind in program.written.items()]
    source = "\n".join([*program.structs.values(), *writing, *program.texts, text])
    return KernelText(source, program.members, program.arrays, program.written, program.has_mesh)


def function_text(*functions: wp.Function) -> str:
    """Return GLSL of functions of numbers, in single precision, and of the functions that they call."""
    program = _Program()
    for function in functions:
        arguments = [_Value("", "float" if kind is Any else kind_of(kind)) for kind in function.input_types.values()]
        program.call(function, arguments)
    return "\n".join([*program.structs.values(), *program.texts])


def _writing(name, kind):
    """Return GLSL that writes an element of an array to an image, which begins at the first thread's element."""
    store = f"imageStore({name}, element_texel(index - given.first), texel_of_{kind}(value));"
    return f"void write_{name}(int index, {kind} value)\n{{\n  {store}\n}}\n"


def kind_of(annotation: Any) -> Any:
    """Return the GLSL type of an annotation; structs and arrays are returned unchanged."""
    return annotation if _is_struct(annotation) or _is_array(annotation) else _KINDS[annotation]


def _is_struct(kind):
    return isinstance(getattr(kind, "vars", None), dict) and not _is_array(kind)


def _is_array(kind):
    return hasattr(kind, "ndim")


def _type_name(kind):
    return kind if isinstance(kind, str) else kind.cls.__name__.lstrip("_")


@dataclass
class _Program:
    """Structs and functions, each after the ones that it uses, and the kernel parameters in use."""

    structs: dict[str, str] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    known: dict[tuple, tuple] = field(default_factory=dict)  # function, arguments → name, types of results
    members: dict[str, Given] = field(default_factory=dict)
    arrays: dict[str, Given] = field(default_factory=dict)
    written: dict[str, str] = field(default_factory=dict)
    has_mesh: bool = False

    def call(self, function, arguments):
        """Translate a function for arguments, `Given` or `_Value`; returns (name, types of results)."""
        key = function.key, id(function.func), *(a if isinstance(a, Given) else _type_name(a.kind) for a in arguments)
        if key not in self.known:
            taken = sum(known[0] == function.key and known[1] != id(function.func) for known in self.known)
            name = function.key.lstrip("_") + (f"_{taken}" if taken else "")
            names = dict(zip(function.input_types, arguments, strict=True))
            body = _Function(self, function.func, {n: a for n, a in names.items() if isinstance(a, Given)})
            parameters = [(n, a.kind) for n, a in names.items() if not isinstance(a, Given)]
            body.kinds |= dict(parameters)
            lines = body.block(body.tree.body, 1)
            returned = body.returned
            head = [f"{_type_name(kind)} {body.local(n)}" for n, kind in parameters]
            if len(returned) > 1:
                head += [f"out {_type_name(kind)} returned_{place}" for place, kind in enumerate(returned)]
            first = "void" if len(returned) != 1 else _type_name(returned[0])
            text = body.joined(f"{first} {name}({', '.join(head)})", lines, dict(parameters))
            self.texts.append(body.comment() + text)
            self.known[key] = name, returned
        return self.known[key]

    def struct(self, struct):
        """Declare a struct, and a function that returns it with all members zero."""
        name = _type_name(struct)
        if name not in self.structs:
            fields = {label: kind_of(variable.type) for label, variable in struct.vars.items()}
            for kind in fields.values():
                if _is_struct(kind):
                    self.struct(kind)
            declared = [f"  {_type_name(kind)} {label};" for label, kind in fields.items()]
            empty = [f"  made.{label} = {_zero(kind)};" for label, kind in fields.items()]
            declaration = [f"struct {name} {{", *declared, "};", f"{name} empty_{name}()", "{", f"  {name} made;"]
            self.structs[name] = "\n".join([*declaration, *empty, "  return made;", "}", ""])
        return name

    def array_place(self, array, indices):
        """Return the index of an element in the texture of its type."""
        self.arrays[array.name] = array
        place = indices[0].operand("*")
        for axis, index in enumerate(indices[1:], start=1):
            place = f"({place}) * {self.side(array, axis)} + {index.operand('*')}"
        return f"given.{array.name}_first + {place}"

    def side(self, array, axis):
        """Return the number of elements along an axis."""
        self.arrays[array.name] = array
        return f"given.{array.name}_side_{axis}"


def _zero(kind):
    if kind in _ZERO:
        return _ZERO[kind]
    return f"{kind}({_ZERO[_ELEMENTS[kind]]})" if kind in _ELEMENTS else f"empty_{_type_name(kind)}()"


class _Function:
    """A function for given arguments: its syntax tree, and the types of its variables."""

    def __init__(self, program, function, given):
        lines, self.first_line = inspect.getsourcelines(function)
        self.file = inspect.getsourcefile(function)
        self.tree: Any = ast.parse(textwrap.dedent("".join(lines))).body[0]
        self.globals = inspect.getclosurevars(function).nonlocals | function.__globals__
        self.program, self.given = program, given
        self.kinds, self.returned = {}, ()  # types of variables; types of results
        self.declared: set[str] = set()  # variables declared by their first assignment
        self.before: list[str] = []  # statements to insert before the present one
        self.random_count = 0
        self.turns: dict[str, int] = {}  # present values of the variables of unrolled loops

    def text(self, kind, name, parameters):
        lines = self.block(self.tree.body, 1)
        return self.joined(f"{kind} {name}({', '.join(parameters)})", lines, {})

    def comment(self):
        """Return the docstring as a comment."""
        lines = (ast.get_docstring(self.tree) or "").splitlines()
        return "".join(f"// {line}\n" if line else "//\n" for line in lines)

    def joined(self, head, lines, parameters):
        known = parameters.keys() | self.declared
        variables = {name: kind for name, kind in self.kinds.items() if name not in known}
        declared = [f"  {_type_name(kind)} {self.local(name)};" for name, kind in variables.items()]
        return "\n".join([head, "{", *declared, *lines, "}", ""])

    @staticmethod
    def local(name):
        """Return the name of a variable in GLSL, which differs from functions and keywords."""
        return f"{name.lstrip('_')}_"

    def refuse(self, node, why):
        line = self.first_line + node.lineno - 1
        raise NotImplementedError(f"{self.file}:{line}: {why}: {ast.unparse(node)}")

    # Statements

    def block(self, statements, depth):
        """Translate statements; returns lines."""
        lines = []
        for statement in statements:
            own = getattr(self, f"_{type(statement).__name__.lower()}", None)
            if own is None:
                self.refuse(statement, "unsupported statement")
            outer, self.before = self.before, []
            found = own(statement, depth)
            lines += ["  " * depth + line for line in self.before] + found
            self.before = outer
        return lines

    def _expr(self, statement, depth):
        if isinstance(statement.value, ast.Constant):
            return []  # a docstring
        return self.refuse(statement, "unused value")

    def _assign(self, statement, depth):
        (target,) = statement.targets
        if isinstance(target, ast.Tuple):
            return self._assign_several(target.elts, statement.value, depth)
        return self._stored(target, self.value(statement.value), depth)

    def _assign_several(self, targets, value, depth):
        if isinstance(value, ast.Tuple):
            pairs = zip(targets, value.elts, strict=True)
            return [line for target, one in pairs for line in self._stored(target, self.value(one), depth)]
        function = self.object_of(value.func) if isinstance(value, ast.Call) else None
        if not isinstance(function, wp.Function):
            self.refuse(value, "only the results of a function can be assigned to several variables")
        arguments = [self.value(argument) for argument in value.args]
        name, kinds = self.program.call(function, arguments)
        for target, kind in zip(targets, kinds, strict=True):
            self._know(target, kind)
        texts = [argument.text for argument in arguments if isinstance(argument, _Value)]
        texts += [self.local(target.id) for target in targets]
        return ["  " * depth + f"{name}({', '.join(texts)});"]

    def _know(self, target, kind):
        if not isinstance(target, ast.Name):
            self.refuse(target, "not a variable")
        if self.kinds.setdefault(target.id, kind) != kind:
            self.refuse(target, f"{_type_name(self.kinds[target.id])} before, {_type_name(kind)} here")
        if _is_struct(kind):
            self.program.struct(kind)

    def _stored(self, target, value, depth):
        if isinstance(value, Given):
            self.refuse(target, "a kernel parameter cannot be assigned to a variable")
        array = self.value(target.value) if isinstance(target, ast.Subscript) else None
        if isinstance(array, Given):
            self.program.written[array.name] = kind_of(array.kind.dtype)
            return ["  " * depth + f"write_{array.name}({self.value(target.slice).text}, {value.text});"]
        if isinstance(target, ast.Name):
            is_new = depth == 1 and target.id not in self.kinds
            self._know(target, value.kind)
            if is_new:  # other variables are declared at the top: Python has no block scope
                self.declared.add(target.id)
            kind = f"{_type_name(value.kind)} " if is_new else ""
            return ["  " * depth + f"{kind}{self.local(target.id)} = {value.text};"]
        return ["  " * depth + f"{self.value(target).text} = {value.text};"]

    def _augassign(self, statement, depth):
        if isinstance(statement.target, ast.Subscript) and isinstance(self.value(statement.target.value), Given):
            self.refuse(statement, "an array is both read and written")
        changed = self.value(statement.target).text
        sign = _OPERATORS[type(statement.op)]
        return ["  " * depth + f"{changed} {sign}= {self.value(statement.value).text};"]

    def _return(self, statement, depth):
        parts = statement.value.elts if isinstance(statement.value, ast.Tuple) else [statement.value]
        values = [self.value(part) for part in parts if part is not None]
        kinds = tuple(value.kind for value in values)
        if self.returned not in ((), kinds):
            self.refuse(statement, "the types differ from those of another return")
        self.returned = kinds
        indent = "  " * depth
        if len(values) < 2:
            return [indent + "return" + "".join(f" {value.text}" for value in values) + ";"]
        return [*(f"{indent}returned_{k} = {value.text};" for k, value in enumerate(values)), indent + "return;"]

    def _if(self, statement, depth):
        indent = "  " * depth
        lines = [f"{indent}if ({self.value(statement.test).text}) {{", *self.block(statement.body, depth + 1)]
        if statement.orelse:
            lines += [f"{indent}}} else {{", *self.block(statement.orelse, depth + 1)]
        return [*lines, indent + "}"]

    def _while(self, statement, depth):
        indent, known = "  " * depth, len(self.before)
        condition = self.value(statement.test).text
        if statement.orelse or len(self.before) > known:
            self.refuse(statement.test, "a random number in a condition")
        return [f"{indent}while ({condition}) {{", *self.block(statement.body, depth + 1), indent + "}"]

    def _break(self, statement, depth):
        if self.turns:
            self.refuse(statement, "a break in an unrolled loop")
        return ["  " * depth + "break;"]

    def _has_constants(self, node):
        """Return whether a loop reads constant vectors; such a loop is unrolled, as by Warp."""
        subscripts = [part for part in ast.walk(node) if isinstance(part, ast.Subscript)]
        return any(hasattr(self.object_of(part.value), "_length_") for part in subscripts)

    def _for(self, statement, depth):
        is_range = isinstance(statement.iter, ast.Call) and self.object_of(statement.iter.func) is range
        if not is_range or len(statement.iter.args) > 2 or statement.orelse:
            self.refuse(statement, "not a loop over a range")
        ends = [self.value(argument).text for argument in statement.iter.args]
        if len(ends) == 1 and ends[0].isdecimal() and self._has_constants(statement):
            lines = []
            for turn in range(int(ends[0])):
                self.turns[statement.target.id] = turn
                lines += self.block(statement.body, depth)
            del self.turns[statement.target.id]
            return lines
        self._know(statement.target, "int")
        turn, indent = self.local(statement.target.id), "  " * depth
        first, last = ends[0] if len(ends) > 1 else 0, ends[-1]
        if not last.isdecimal():  # evaluated once, as in Python
            last = self.local(f"{statement.target.id}_end")
            self.kinds[f"{statement.target.id}_end"] = "int"
            self.before.append(f"{last} = {ends[-1]};")
        head = f"{indent}for ({turn} = {first}; {turn} < {last}; {turn}++) {{"
        return [head, *self.block(statement.body, depth + 1), indent + "}"]

    # Expressions

    def object_of(self, node):
        """Return the Python object of a global name or of its attribute; None for other nodes."""
        known = self.kinds, self.given, self.turns
        if isinstance(node, ast.Name) and not any(node.id in names for names in known):
            builtins = {"range": range, "int": int, "float": float, "type": type}
            return self.globals.get(node.id, builtins.get(node.id))
        if isinstance(node, ast.Attribute):
            return getattr(self.object_of(node.value), node.attr, None)
        return None

    def value(self, node):
        """Return the `_Value` of an expression, or its `Given`."""
        constant = self.object_of(node)
        if constant is not None:
            return self._constant(node, constant)
        own = getattr(self, f"_{type(node).__name__.lower()}_value", None)
        if own is None:
            self.refuse(node, "unsupported expression")
        return own(node)

    def _constant(self, node, constant):
        constant = getattr(constant, "value", constant)  # for scalars of Warp
        if isinstance(constant, bool):
            return _Value("true" if constant else "false", "bool")
        if isinstance(constant, int | float):
            kind = "int" if isinstance(constant, int) else "float"
            text = str(constant) if kind == "int" else str(np.float32(constant))
            return _Value(text, kind, "unary" if constant < 0 else "")
        return self.refuse(node, "not a number")

    def _constant_value(self, node):
        return self._constant(node, node.value)

    def _name_value(self, node):
        if node.id in self.given:
            return self._given(self.given[node.id])
        if node.id in self.turns:
            return _Value(str(self.turns[node.id]), "int")
        if node.id not in self.kinds:
            self.refuse(node, "unknown name")
        return _Value(self.local(node.id), self.kinds[node.id])

    def _given(self, given):
        """Return the `_Value` of a number that the kernel is given; structs and arrays are returned unchanged."""
        if not isinstance(given.kind, str):
            return given
        if self.program.members.setdefault(given.name, given) != given:
            raise NotImplementedError(f"two members have the name {given.name}")
        return _Value(f"given.{given.name}", given.kind)

    def _attribute_value(self, node):
        whole = self.value(node.value)
        if whole.kind == _RAY:
            return _Value(f"{whole.operand()}.{node.attr}", _RAY_FIELDS[node.attr])
        if not _is_struct(whole.kind):
            self.refuse(node, "not a member of a struct")
        kind = kind_of(whole.kind.vars[node.attr].type)
        if isinstance(whole, Given):
            return self._given(Given((*whole.path, node.attr), kind))
        return _Value(f"{whole.text}.{node.attr}", kind)

    def _subscript_value(self, node):
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            array = self.value(node.value.value)
            if _is_array(array.kind):
                return _Value(self.program.side(array, node.slice.value), "int")
        vector = self.object_of(node.value)
        if hasattr(vector, "_length_"):
            return self._constant_element(node, vector)
        whole = self.value(node.value)
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        indices = [self.value(part) for part in parts]
        if isinstance(whole, Given):
            kind = kind_of(whole.kind.dtype)
            return _Value(f"{kind}_at({self.program.array_place(whole, indices)})", kind)
        return _Value(f"{whole.operand()}[{indices[0].text}]", _ELEMENTS[whole.kind])

    def _constant_element(self, node, vector):
        place = self.value(node.slice).text
        if not place.isdecimal():
            self.refuse(node, "the index of a constant vector must be constant")
        return _Value(str(np.float32(vector[int(place)])), "float")

    def _binop_value(self, node):
        left, right = self.value(node.left), self.value(node.right)
        kind = right.kind if right.kind in _ELEMENTS else left.kind
        if left.text.isdecimal() and right.text.isdecimal() and isinstance(node.op, ast.Sub):
            return _Value(str(int(left.text) - int(right.text)), "int")
        operator = _OPERATORS[type(node.op)]
        products = ("*", "/") if operator in "+-*/" else ()
        sums = ("+", "-") if operator in "+-" else ()
        left_text = left.operand(*products, *sums)
        right_text = right.operand(*(products if operator in "+-" else ()))
        return _Value(f"{left_text} {operator} {right_text}", kind, operator)

    def _unaryop_value(self, node):
        value = self.value(node.operand)
        return _Value(f"{_OPERATORS[type(node.op)]}{value.operand()}", value.kind, "unary")

    def _boolop_value(self, node):
        known = len(self.before)
        values = [self.value(part).operand(*_COMPARISONS) for part in node.values]
        if len(self.before) > known:
            self.refuse(node, "a random number in a condition")
        operator = _OPERATORS[type(node.op)]
        return _Value(f" {operator} ".join(values), "bool", operator)

    def _compare_value(self, node):
        (other,), (operator,) = node.comparators, node.ops
        sides = [self.value(side).operand("+", "-", "*", "/") for side in (node.left, other)]
        sign = _OPERATORS[type(operator)]
        return _Value(f"{sides[0]} {sign} {sides[1]}", "bool", sign)

    def _call_value(self, node):
        if isinstance(node.func, ast.Call):  # type(x)(value)
            return self._converted(self.value(node.func.args[0]).kind, node.args)
        function = self.object_of(node.func)
        if _is_struct(function):
            return _Value(f"empty_{self.program.struct(function)}()", function)
        if isinstance(function, type) and function in _KINDS:
            return self._converted(_KINDS[function], node.args)
        if isinstance(node.func, ast.Attribute) and self.object_of(node.func.value) is wp:
            return self._call_of_warp(node.func.attr, node)
        if not isinstance(function, wp.Function):
            self.refuse(node, "an unknown function")
        arguments = [self.value(argument) for argument in node.args]
        name, kinds = self.program.call(function, arguments)
        if len(kinds) != 1:
            self.refuse(node, "a function with several results in an expression")
        return _Value(f"{name}({', '.join(a.text for a in arguments if isinstance(a, _Value))})", kinds[0])

    def _converted(self, kind, arguments):
        values = [self.value(argument) for argument in arguments]
        if [value.kind for value in values] == [kind]:
            return values[0]
        return _Value(f"{kind}({', '.join(value.text for value in values)})" if values else _zero(kind), kind)

    def _call_of_warp(self, name, node):
        if name == "tid":
            return _Value("thread_index()", "int")
        if name in ("mesh_query_ray", "mesh_query_ray_anyhit"):
            self.program.has_mesh = True
            ray = [self.value(argument).text for argument in node.args[1:]]
            nearest = f"mesh_query_ray({', '.join(ray)})"
            return _Value(nearest, _RAY) if name == "mesh_query_ray" else _Value(f"{nearest}.result", "bool")
        arguments = [self.value(argument) for argument in node.args]
        texts = [argument.text for argument in arguments if isinstance(argument, _Value)]
        if name == "randf":
            # GLSL does not define the order of evaluation within an expression.
            self.random_count += 1
            number = f"random_{self.random_count}"
            self.kinds[number] = "float"
            self.before.append(f"{self.local(number)} = randf({texts[0]});")
            return _Value(self.local(number), "float")
        if name == "where":
            chosen = [argument.operand() for argument in arguments]
            return _Value(f"{chosen[0]} ? {chosen[1]} : {chosen[2]}", arguments[1].kind, "?")
        form, kind = _CALLS.get((name, len(texts)), (None, None))
        if name in ("cw_mul", "cw_div"):
            sign = "*" if name == "cw_mul" else "/"
            return _Value(f"{arguments[0].operand('*', '/')} {sign} {arguments[1].operand()}", arguments[0].kind, sign)
        if form is None:
            self.refuse(node, "unsupported function of Warp")
        return _Value(form.format(*texts), kind or arguments[0].kind)
