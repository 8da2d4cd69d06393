"""Shader files: `#include`, `#define`d sizes, and compiler errors mapped back to file and line."""

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
#: Placeholder for the terms of the render form.
TERMS = "terms.glsl"
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
# Mesa: `2:17(5): error`; Nvidia: `2(17) : error`; AMD and macOS: `ERROR: 2:17:`. The first number is the source string.
_PLACE = re.compile(r"(?m)^(\s*(?:ERROR:\s*|WARNING:\s*)?)(\d+)(?::(\d+)|\((\d+)\) ?)")


class ShaderError(MetamerError):
    """Error of a shader that does not compile on this machine; the message names files and lines."""


def source(
    name: str, defines: Mapping[str, int | float] | None = None, terms: Path | None = None
) -> tuple[str, tuple[str, ...]]:
    """Return the text of shader file `name` with includes resolved, and the file names that its `#line` numbers refer
    to.

    Each file is included once, at its first `#include`. `defines` follow the version. `terms` is the file included by
    `#include "terms.glsl"`: the terms of a fast form, which may include files of its own folder.

    Raises
    ------
    ShaderError : a missing include, with the file and line of the directive.
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
    ShaderError : the compiler's or linker's message, with `number:line` replaced by `file:line`.
    """
    import moderngl

    vertex_source, vertex_files = source(vertex, defines)
    fragment_source, fragment_files = source(fragment, defines, terms)
    try:
        return context.program(vertex_shader=vertex_source, fragment_shader=fragment_source)
    except moderngl.Error as reason:
        message = str(reason)
        # moderngl's message starts with the stage; a linker's message has no positions to map.
        names = vertex_files if "vertex_shader" in message.replace(" ", "_").lower() else fragment_files
        raise ShaderError(f"{vertex} + {fragment}: {with_file_names(message, names)}") from reason


def shader_folder() -> Path:
    """Return the folder of the shaders; those of surfaces are next to their classes."""
    return Path(str(files(__package__ or "").joinpath("shaders")))


def with_file_names(message: str, names: tuple[str, ...]) -> str:
    """Replace source string numbers in a compiler's message by file names."""

    def replaced(match: re.Match[str]) -> str:
        number = int(match[2])
        return f"{match[1]}{names[number]}:{match[3] or match[4]}" if number < len(names) else match[0]

    return _PLACE.sub(replaced, message)
