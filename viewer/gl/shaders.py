"""Shaders are files: `#include` with errors mapped back to the file and line, and sizes given as `#define`s."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from ...runtime.errors import MetamerError

if TYPE_CHECKING:
    import moderngl

GLSL_VERSION = "#version 410 core"
#: Placeholder for the terms of the render form that is drawn.
TERMS = "terms.glsl"
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
# Mesa: `2:17(5): error`; Nvidia: `2(17) : error`; AMD and macOS: `ERROR: 2:17:`. The first number is the source string.
_PLACE = re.compile(r"(?m)^(\s*(?:ERROR:\s*|WARNING:\s*)?)(\d+)(?::(\d+)|\((\d+)\) ?)")


class ShaderError(MetamerError):
    """A shader that this machine's compiler refuses; the message names files and lines, not source numbers."""


def source(
    name: str, defines: Mapping[str, int | float] | None = None, terms: Path | None = None
) -> tuple[str, tuple[str, ...]]:
    """Text of shader file `name`, includes put in, and the file names that its `#line` numbers refer to.

    Each file is included once, the first time it is asked for. `defines` come right after the version. `terms` is what
    `#include "terms.glsl"` includes: the terms of a fast form, whose file lies beside it; what that includes may lie
    beside itself.

    Raises
    ------
    ShaderError : an include that is not there; names the file and line that asks for it.
    """
    seen: list[str] = []
    names: list[str] = []

    def lines_of(file: str, wanted_by: str) -> list[str]:
        beside = terms.with_name(file) if terms is not None else None
        path = shader_folder().joinpath(file) if beside is None or not beside.is_file() else beside
        path = terms if file == TERMS and terms is not None else path
        if not path.is_file():
            raise ShaderError(f"{wanted_by}: there is no shader file {str(path if file == TERMS else file)!r}")
        number = len(seen)
        seen.append(file)
        names.append(path.name)
        out = [f"#line 1 {number}"]
        for line_number, line in enumerate(path.read_text("utf-8").splitlines(), start=1):
            include = _INCLUDE.match(line)
            if include is None:
                out.append(line)
                continue
            if include[1] not in seen:
                out += lines_of(include[1], f"{path.name}:{line_number}")
            out.append(f"#line {line_number + 1} {number}")
        return out

    body = lines_of(name, "the program")
    header = [GLSL_VERSION, *(f"#define {key} {value}" for key, value in (defines or {}).items())]
    return "\n".join([*header, *body]) + "\n", tuple(names)


def program(
    context: moderngl.Context,
    vertex: str,
    fragment: str,
    defines: Mapping[str, int | float] | None = None,
    terms: Path | None = None,
) -> moderngl.Program:
    """Compile and link two shader files; see `source`.

    Raises
    ------
    ShaderError : the compiler's or linker's words, with `number:line` replaced by `file:line`.
    """
    import moderngl

    vertex_source, vertex_files = source(vertex, defines)
    fragment_source, fragment_files = source(fragment, defines, terms)
    try:
        return context.program(vertex_shader=vertex_source, fragment_shader=fragment_source)
    except moderngl.Error as reason:
        message = str(reason)
        # moderngl heads its message with the stage; a linker's message has no places to map.
        names = vertex_files if "vertex_shader" in message.replace(" ", "_").lower() else fragment_files
        raise ShaderError(f"{vertex} + {fragment}: {with_file_names(message, names)}") from reason


def shader_folder() -> Path:
    """Return the folder of the shaders; those of surfaces lie beside their classes."""
    return Path(str(files(__package__ or "").joinpath("shaders")))


def with_file_names(message: str, names: tuple[str, ...]) -> str:
    """Return a compiler's message with source string numbers replaced by the files they stand for."""

    def replaced(match: re.Match[str]) -> str:
        number = int(match[2])
        return f"{match[1]}{names[number]}:{match[3] or match[4]}" if number < len(names) else match[0]

    return _PLACE.sub(replaced, message)
