"""Every GLSL twin compiles on its own and agrees with numpy, model by model, at the ends of the parameters."""

import re
import sys
import types
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from metamer.materials.analytic import MODELS
from metamer.materials.core.directions import TAU, io_from_half_difference, spherical

WAVELENGTHS = np.array([400.0, 500.0, 600.0, 700.0])
EXAMPLES = [
    pytest.param(brdf, id=f"{model.NAME}-{index}")
    for model in MODELS
    for index, brdf in enumerate(model.examples(WAVELENGTHS))
]

VERTEX = """#version 410 core
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""
# One fragment is one direction pair (column) at one wavelength (row); `parameters` holds a row a wavelength.
FRAGMENT = """#version 410 core
{model}
uniform sampler2D light, view, parameters;
out float value;
void main()
{{
    int pair = int(gl_FragCoord.x), wavelength = int(gl_FragCoord.y);
    vec3 wi = texelFetch(light, ivec2(pair, 0), 0).xyz, wo = texelFetch(view, ivec2(pair, 0), 0).xyz;
    value = {name}(wi, wo, {arguments});
}}
"""


def source(model):
    return (files("metamer.materials.analytic") / f"{model.NAME}.glsl").read_text(encoding="utf-8")


def glsl_arguments(brdf):
    """The parameters as numbers (P, L), and the expressions that read them in the shader."""
    rows, expressions = [], []
    for index, (name, value) in enumerate(brdf.parameters().items()):
        choices = type(brdf).CHOICES.get(name)
        number = choices.index(value) if choices else value
        rows.append(np.broadcast_to(number, WAVELENGTHS.shape))
        read = f"texelFetch(parameters, ivec2({index}, wavelength), 0).r"
        expressions.append(f"int({read})" if choices else read)
    return np.stack(rows), ", ".join(expressions)


def evaluate(gl, brdf, wi, wo, twin=None):
    """f_r (N,L) by the GLSL twin in float32."""
    numbers, arguments = glsl_arguments(brdf)
    program = gl.program(
        vertex_shader=VERTEX,
        fragment_shader=FRAGMENT.format(model=twin or source(type(brdf)), name=brdf.NAME, arguments=arguments),
    )
    vertices = gl.vertex_array(program, [])
    textures = {
        "light": gl.texture((len(wi), 1), 3, wi.astype("f4").tobytes(), dtype="f4"),
        "view": gl.texture((len(wo), 1), 3, wo.astype("f4").tobytes(), dtype="f4"),
        "parameters": gl.texture(numbers.shape, 1, np.ascontiguousarray(numbers.T, "f4").tobytes(), dtype="f4"),
    }
    for unit, (name, texture) in enumerate(textures.items()):
        # A driver may drop a sampler that a model does not read.
        if name in program:
            texture.use(unit)
            program[name] = unit
    target = gl.texture((len(wi), len(WAVELENGTHS)), 1, dtype="f4")
    frame = gl.framebuffer([target])
    try:
        frame.use()
        vertices.render(vertices=3)
        return np.frombuffer(target.read(), "f4").reshape(len(WAVELENGTHS), len(wi)).T
    finally:
        for resource in (frame, target, *textures.values(), vertices, program):
            resource.release()


def pairs(count):
    """Direction pairs (N,3) in float32: all over the hemisphere, inside narrow highlights, retro, and too low."""
    random = np.random.default_rng(11)
    theta_i, theta_o = np.arccos(1 - random.random((2, count)) * (1 - np.cos(np.radians(89.5))))
    phi_i, phi_o = random.random((2, count)) * TAU
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_o)
    mirror_i, mirror_o = io_from_half_difference(0.5 * random.random(count) ** 8, theta_i * 0.9, phi_i, phi_o)
    lights = np.concatenate([wi, mirror_i, wi[:50], wi[:8]])
    views = np.concatenate([wo, mirror_o, wi[:50], -wo[:8]])
    return lights.astype(np.float32), views.astype(np.float32)


@pytest.mark.parametrize("brdf", EXAMPLES)
def test_glsl_agrees_with_numpy(gl, brdf):
    compare(gl, brdf)


def test_the_documented_example_works_as_printed(gl, monkeypatch):
    text = (Path(__file__).parents[3] / "docs" / "adding_a_brdf.md").read_text(encoding="utf-8")
    (python,), (twin,) = (re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL) for kind in ("python", "glsl"))
    module = types.ModuleType("metamer.materials.analytic.minnaert")
    module.__package__ = "metamer.materials.analytic"
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(python, module.__dict__)
    for brdf in module.Minnaert.examples(WAVELENGTHS):
        compare(gl, brdf, twin)
        assert brdf.from_parameters(WAVELENGTHS, brdf.parameters()).darkening == brdf.darkening


def compare(gl, brdf, twin=None):
    wi, wo = pairs(1000)
    # Both get the same float32 directions; numpy computes in float64 from there.
    truth = brdf.eval(wi.astype(np.float64), wo.astype(np.float64))
    found = evaluate(gl, brdf, wi, wo, twin)
    assert np.isfinite(found).all() and found.min() >= 0
    # A rounding of h = wi + wo by 6e-8, t standard deviations out in a lobe of exponent n, moves log f by
    # t sqrt(n) 6e-8: 1e-4 at t = 5 and n = 1e5. All else is some ten roundings, 1e-6. Where Oren-Nayar's terms
    # cancel, and far out in a lobe, the error is small beside the other values instead: a millionth of a white
    # surface's f_r times pi.
    tolerance = 1e-4 * truth + 1e-6 * min(truth.max(), 1.0)
    gap = np.abs(found - truth) / tolerance
    row, wavelength = np.unravel_index(gap.argmax(), gap.shape)
    assert gap.max() <= 1, (
        f"pair {row}: wi {wi[row]}, wo {wo[row]}, {WAVELENGTHS[wavelength]} nm: GLSL {found[row, wavelength]!r}, "
        f"numpy {truth[row, wavelength]!r}, {gap.max():.1f} times the tolerance"
    )


def test_the_harness_sees_a_wrong_constant(gl):
    lambert, *_ = MODELS[0].examples(WAVELENGTHS)
    wi, wo = pairs(10)
    wrong = type(lambert).from_parameters(WAVELENGTHS, {"reflectance": lambert.parameters()["reflectance"] * 0.99})
    gap = np.abs(evaluate(gl, lambert, wi, wo) - wrong.eval(wi.astype(float), wo.astype(float)))
    assert gap.max() > 5e-4


def test_all_twins_fit_into_one_shader(gl):
    program = gl.program(
        vertex_shader=VERTEX,
        fragment_shader="#version 410 core\n"
        + "".join(source(model) for model in MODELS)
        + "out float value; void main() { value = lambert(vec3(0, 0, 1), vec3(0, 0, 1), 0.5); }",
    )
    program.release()
