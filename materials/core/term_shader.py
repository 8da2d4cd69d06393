"""Shader of a fast form's terms: its GLSL, and the textures and numbers that it reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class TermShader:
    """The terms of a summand on the GPU.

    file : GLSL that defines, as `docs/adding_a_surface.md` says, `Here`, `here_at`, `entry` and `term`.
    sizes : what is written into it as `#define`s; with each combination of them a program is compiled once.
    textures : (h, w, 4) float32 or float16 arrays by the names of their samplers; uniforms : numbers by name.
    steps : rounds of loops for a sample, at most: a driver may end a shader after some 65,000 without a word.
    """

    file: Path
    sizes: Mapping[str, int] = field(default_factory=dict)
    textures: Mapping[str, np.ndarray] = field(default_factory=dict)
    uniforms: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 1000
