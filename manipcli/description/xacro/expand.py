"""Safe expansion of xacro: the xacro library with its file access, evaluation and environment access replaced.

Each expansion loads a private copy of the library's module and replaces its entry points there: reading files,
evaluating expressions and `$(...)`, loading YAML, warnings. The module that others import is unchanged.
"""

from __future__ import annotations

import glob
import importlib.util
import os
import re
import threading
import xml.dom.minidom
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.dom.minidom import Document
from xml.dom.minidom import Element as DomElement

from manipcli.core.errors import EXPANDED, Diagnostic, InvalidInput, Place
from manipcli.description.bounds import bounds
from manipcli.description.located_xml import called_from, invalid, place_of, read_document
from manipcli.description.packages import Absent, NotFound, Packages
from manipcli.description.xacro.expression import Evaluator
from manipcli.description.xacro.similar_names import UnknownArgument, names_of, near_macro, near_name
from manipcli.description.xacro.values import (
    OPTENV,
    Beyond,
    Clock,
    Refused,
    math_symbols,
    python_symbols,
    size_of,
    too_large,
)
from manipcli.description.xacro.words import tokenize, typed
from manipcli.description.xacro.yaml_data import Mistyped, load_yaml

_loading = threading.Lock()
_ABOUT_A_CALL = ("Undefined parameters", "Unused block", "Not enough blocks", "Invalid parameter", "unknown macro")
# The library's own pattern for `name:=^|default` backtracks exponentially on an unclosed quote. This one matches the
# same texts without ambiguity.
_MACRO_ARGUMENT = re.compile(
    r"""^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?(\$\{.*?\}|\$\(.*?\)|(?:'[^'\n]*'|"[^"\n]*"|[^\s'"])+|)(?:\s+|$)(.*)"""
)
ALLOW_ENV = "MANIPCLI_ALLOW_ENV"
"""Environment variable with the names of variables that descriptions may read."""
_NODE = 16
"""Cost of an attribute, a text or an element in addition to its characters: empty nodes use memory, too."""
_DATA = "expressions in a description can only compute numbers and text"


def expand(
    path: Path, arguments: Mapping[str, str], packages: Packages, *, allow_env: Collection[str] = ()
) -> tuple[Document, tuple[Diagnostic, ...]]:
    """The expanded document of a xacro file; its elements keep their places in the source files.

    Args:
        path: the file.
        arguments: values of `<xacro:arg>`.
        packages: resolves included files.
        allow_env: environment variables that the file may read.

    Returns:
        The document, and the warnings of the description and of the expansion.

    Raises:
        InvalidInput: with the place of the innermost element being expanded, and the macros around it.
    """
    return _Expansion(packages, frozenset(allow_env)).run(path, arguments)


def _private_module() -> ModuleType:
    """A private copy of the xacro module."""
    with _loading:
        # xacro replaces this method of the standard library on import; restore it.
        original = xml.dom.minidom.Element.writexml
        try:
            spec = importlib.util.find_spec("xacro")
            if spec is None or spec.loader is None:
                raise invalid("XACRO001", "the Python package 'xacro' is not installed")
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        finally:
            xml.dom.minidom.Element.writexml = original  # type: ignore[method-assign]
    return module


class _Expansion:
    """The replaced entry points of one private module, and their counters."""

    def __init__(self, packages: Packages, allow_env: frozenset[str]) -> None:
        self._packages = packages
        self._allow_env = allow_env
        self._module = _private_module()
        self._clock = Clock()
        self._evaluate = Evaluator(self._clock)
        self._bounds = bounds()
        self._characters = 0
        self._findings: list[Diagnostic] = []
        self._current: DomElement | None = None
        self._calls: list[DomElement] = []
        self._expansions = 0
        self._near: str | None = None
        self._optional = False
        self._macros: object = None
        self._known_arguments: set[str] = set()
        module = self._module
        self._eval_all = module.eval_all
        self._eval_text = module.eval_text
        self._macro_call = module.handle_macro_call
        self._check = module.check_attrs
        self._required = module.reqd_attrs
        replaced: dict[str, Callable[..., object]] = {
            "parse": self._on_parse,
            "safe_eval": self._on_eval,
            "eval_extension": self._on_extension,
            "load_yaml": self._load_yaml,
            "get_include_files": self._on_include_files,
            "eval_all": self._on_eval_all,
            "eval_text": self._on_eval_text,
            "handle_macro_call": self._on_macro_call,
            "check_attrs": self._on_check_attrs,
            "reqd_attrs": self._on_reqd_attrs,
            "warning": self._warn,
            "error": self._warn,
            "message": lambda *words, **options: "",
            "print_location": lambda: None,
        }
        for name, function in replaced.items():
            setattr(module, name, function)
        # Attributes of the private copy of the library, which ModuleType does not declare.
        module.re_macro_arg = _MACRO_ARGUMENT  # type: ignore[attr-defined]
        module._global_symbols = self._symbols()  # type: ignore[attr-defined]

    def run(self, path: Path, arguments: Mapping[str, str]) -> tuple[Document, tuple[Diagnostic, ...]]:
        module = self._module
        document = read_document(path)
        self._current = document.documentElement
        module.init_stacks(str(path.absolute()))
        try:
            module.process_doc(document, mappings=dict(arguments), verbosity=0)
        except InvalidInput:
            raise
        except RecursionError as error:
            message = "macros, properties or elements are nested too deeply for the stack; no bound changes this"
            raise invalid("XACRO004", message, self._place()) from error
        except MemoryError as error:
            raise invalid("XACRO004", "out of memory while expanding the description", self._place()) from error
        except Exception as error:
            raise self._failed(error) from error
        unknown = [name for name in arguments if name not in self._known_arguments]
        if unknown:
            known = ", ".join(sorted(self._known_arguments)) or "none"
            raise invalid(
                "XACRO003",
                f"unknown argument {', '.join(repr(name) for name in unknown)}; the description has: {known}",
                place_of(document.documentElement) if document.documentElement else None,
            )
        return document, tuple(self._findings)

    def _place(self) -> Place | None:
        return place_of(self._current) if self._current is not None else None

    def _failed(self, error: Exception) -> InvalidInput:
        cause: BaseException | None = error
        code, own_hint, place = "XACRO001", None, self._place()
        while cause is not None:
            if isinstance(cause, Beyond):
                code, own_hint = "XACRO004", cause.hint
            elif isinstance(cause, Refused):
                code, own_hint = "XACRO002", cause.hint or _DATA
            elif isinstance(cause, UnknownArgument):
                code, own_hint = "XACRO003", cause.hint
            elif isinstance(cause, NotFound):
                own_hint = cause.hint
            elif isinstance(cause, Mistyped):
                place, own_hint = cause.place, f"the file is loaded at {self._place()}"
            cause = getattr(cause, "exc", None) or cause.__cause__
        lines = re.sub(r" \(<unknown>, line \d+\)", "", str(error)).splitlines()
        message = "; ".join(line.strip() for line in lines if line.strip()) or repr(error)
        if self._calls and message.startswith(_ABOUT_A_CALL):
            place = place_of(self._calls[-1])
        around = [f"{call.tagName} at {place_of(call)}" for call in reversed(self._calls) if place_of(call) is not None]
        more = [f"{len(around) - 4} more"] if len(around) > 4 else []
        hint = f"{EXPANDED} " + ", from ".join([*around[:4], *more]) if around else None
        if message.startswith("unknown macro") and self._calls:
            own_hint = near_macro(self._calls[-1].tagName, names_of(self._macros))
        elif "is not defined" in message:
            own_hint = own_hint or self._near
        return invalid(code, message, place, "; ".join(filter(None, (own_hint, hint))) or None)

    def _warn(self, *words: object, **options: object) -> str:
        message = " ".join(str(word) for word in words)
        self._findings.append(Diagnostic("XACRO010", message, self._place(), severity="warning"))
        return ""

    # --- the entry points, with the library's signatures ---

    def _on_parse(self, inp: object, filename: str | None = None) -> Document:
        *around, own = [Path(str(each)) for each in self._module.filestack]
        most = self._bounds.include_depth
        if len(around) >= most:
            if own in around:  # a larger bound would not help
                circle = around[len(around) - 1 - around[::-1].index(own) :]
                names = " -> ".join(each.name for each in [*circle, own])
                message, hint = f"files include each other in a circle: {names}", "remove one of these includes"
                raise invalid("XACRO004", message, self._place(), hint)
            raise Beyond(f"includes are nested more than {most} deep", "include_depth")
        return read_document(Path(str(filename)))

    def _on_eval(self, expr: str, globals: Mapping[str, object], locals: object = None) -> object:
        self._clock.look()
        try:
            return self._evaluate(expr, globals)
        except NameError as error:
            self._near = near_name(error, names_of(globals))
            raise

    def _on_eval_text(self, text: str, symbols: Mapping[str, object]) -> object:
        value: object = self._eval_text(text, symbols)
        size = size_of(value)
        if size > self._bounds.value_size:
            raise too_large("a value")
        self._grow(size)
        return value

    def _on_eval_all(self, node: DomElement, macros: object, symbols: object) -> None:
        self._count()
        self._grow(_NODE * (len(node.childNodes) + len(node.attributes)))
        self._current = node if place_of(node) is not None else self._current
        if self._calls:
            self._mark(node)
        self._eval_all(node, macros, symbols)

    def _mark(self, body: DomElement) -> None:
        """Stores at the elements of a macro's body the outermost and the innermost call."""
        ends = self._calls[:1] + self._calls[1:][-1:]
        calls = tuple(place for call in ends if (place := place_of(call)) is not None)
        for child in body.childNodes:
            if child.nodeType == child.ELEMENT_NODE:
                called_from(child, calls)

    def _on_macro_call(self, node: DomElement, macros: object, symbols: object) -> bool:
        if not node.tagName.startswith("xacro:"):
            return False
        self._current = node
        if node.tagName == "xacro:call":
            return bool(self._macro_call(node, macros, symbols))
        self._count()
        if len(self._calls) >= self._bounds.macro_depth:
            raise Beyond(f"macro calls are nested more than {self._bounds.macro_depth} deep", "macro_depth")
        self._calls.append(node)
        self._macros = macros
        done = bool(self._macro_call(node, macros, symbols))
        self._calls.pop()
        return done

    def _count(self) -> None:
        self._expansions += 1
        if self._expansions > self._bounds.expansions:
            raise Beyond(f"the expansion has more than {self._bounds.expansions} steps", "expansions")
        self._clock.look()

    def _grow(self, size: int) -> None:
        self._characters += size
        if self._characters > self._bounds.characters:
            raise Beyond(f"the description expands to more than {self._bounds.characters} characters", "characters")

    def _on_check_attrs(self, tag: DomElement, required: list[str], optional: list[str]) -> list[str | None]:
        self._current = tag
        found: list[str | None] = self._check(tag, required, optional)
        if tag.tagName == "xacro:include":
            self._optional = found[optional.index("optional") + len(required)] in ("true", "True", "1")
        if tag.tagName == "xacro:arg":
            self._known_arguments.add(str(found[0]))
        return found

    def _on_reqd_attrs(self, tag: DomElement, names: list[str]) -> list[str]:
        self._current = tag
        found: list[str] = self._required(tag, names)
        return found

    def _on_include_files(self, filename_spec: str, symbols: Mapping[str, object]) -> Iterator[str]:
        spec = str(self._on_eval_text(filename_spec, symbols))
        if any(character in spec for character in "*[?"):
            parent, folder = Path(spec).parent, self._folder() / Path(spec).parent
            # Like the library and unlike Path.glob: `**` means `*`, so no folder tree is walked; hidden files excluded.
            names = sorted(str(parent / name) for name in glob.glob(Path(spec).name, root_dir=folder))  # noqa: PTH207
            if not names:
                self._warn(f"'{spec}' matches no file")
        else:
            names = [spec]
        for name in names:
            try:
                yield str(self._packages.resolve(name, relative_to=self._folder()))
            except Absent as error:
                if self._optional:
                    continue
                raise self._exception(error.message) from error
            except NotFound as error:
                raise self._exception(error.message) from error

    def _exception(self, message: str, **details: object) -> Exception:
        created: Exception = self._module.XacroException(message, **details)
        return created

    def _folder(self) -> Path:
        return Path(str(self._module.filestack[-1])).parent

    def _on_extension(self, text: str) -> object:
        command, _, rest = text[2:-1].strip().partition(" ")
        rest = rest.strip()
        if command == "find":
            return str(self._packages.root(rest))
        if command == "arg":
            return self._argument(rest)
        if command == "dirname":
            return str(self._folder())
        if command == "eval":
            names: dict[str, object] = {**math_symbols(), **python_symbols(), "true": True, "false": False}
            names |= {name: typed(value) for name, value in self._arguments().items()}
            names["arg"] = lambda name: typed(self._argument(name))
            names["find"] = lambda name: str(self._packages.root(name))
            return str(self._evaluate(rest, names))
        if command in {"env", "optenv"}:
            return self._environment(command, rest)
        if command == "cwd":
            hint = "use $(dirname) for the folder of this file, or $(find NAME) for that of a package"
            raise Refused("$(cwd): a description may not depend on the working directory", hint=hint)
        if command in {"command", "anon"}:
            raise Refused(f"$({command} ...) is not allowed in a description; use an argument, $(arg NAME), instead")
        raise Refused(f"unknown substitution '{text}'; known: $(find NAME), $(arg NAME), $(dirname), $(eval ...)")

    def _environment(self, command: str, rest: str) -> str:
        """`$(env NAME)` and `$(optenv NAME DEFAULT)`, for variables that the user allowed; of others, the default.

        What a file describes does not depend on the machine, so a variable is not read unless the user names it.
        """
        name, default = (*map(str.strip, rest.partition(" ")[::2]),)
        if name not in self._allow_env and name not in os.environ.get(ALLOW_ENV, "").replace(",", " ").split():
            hint = f"allow it with {ALLOW_ENV}={name} before the command (check-urdf: --allow-env), or use $(arg NAME)"
            if command == "optenv":
                note = f"$(optenv {name}): the environment is not read; the default '{default}' is used"
                noted = Diagnostic(OPTENV, note, self._place(), hint, severity="note")
                if all(finding.message != note for finding in self._findings):
                    self._findings.append(noted)
                return default
            hint += ", with its value under `args:` of the robot file"
            raise Refused(f"$({command} {name}): a description may not read the environment", hint=hint)
        value = os.environ.get(name)
        if value is None and command == "env":
            raise NameError(f"environment variable '{name}' is not set")
        return default if value is None else value

    def _arguments(self) -> dict[str, str]:
        found: dict[str, str] = self._module.substitution_args_context["arg"]
        return found

    def _argument(self, name: str) -> str:
        self._known_arguments.add(name)
        try:
            return self._arguments()[name]
        except KeyError:
            raise UnknownArgument(name, self._arguments()) from None

    def _load_yaml(self, name: str) -> object:
        path = self._packages.resolve(name, relative_to=self._folder())
        return self._module.YamlListWrapper.wrap(
            load_yaml(path, lambda text: self._evaluate(text, math_symbols()), self._clock)
        )

    def _absolute(self, name: str) -> str:
        return str(self._folder() / name)

    def _fatal(self, *words: object) -> object:
        raise self._exception(" ".join(str(word) for word in words))

    def _symbols(self) -> dict[str, object]:
        def namespace(symbols: dict[str, object]) -> Any:
            created = self._module.NameSpace()
            for name, value in symbols.items():
                dict.__setitem__(created, name, value)
            return created

        own: dict[str, object] = {
            "load_yaml": self._load_yaml,
            "abs_filename": self._absolute,
            "dotify": self._module.YamlDictWrapper,
        }
        messages = {"warning": self._warn, "error": self._warn, "message": lambda *words: "", "fatal": self._fatal}
        plain = python_symbols()
        everything: dict[str, object] = {**math_symbols(), **plain, **own}
        return everything | {
            "python": namespace(plain),
            "math": namespace(math_symbols()),
            "xacro": namespace({**own, **messages, "tokenize": tokenize, "arg": self._argument}),
        }
