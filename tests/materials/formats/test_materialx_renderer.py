"""MaterialX files drawn by MaterialX itself: the GLSL that its generator makes of them, beside the BRDF."""

import numpy as np
import pytest
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.export.files import export
from metamer.materials.formats.materialx_writer import _REC709_FROM_ACESCG
from metamer.spectral.upsampling import xyz_from_rgb

from .test_materialx_writer import WRITTEN, of

SPHERE = sphere_protocol(24, True)
#: The largest mean of ΔE94 under D65 by name. Metals come out brighter: light that facets send to one another is kept.
MOST = {
    "lambert": 0.1, "rough": 0.6, "metal": 1.5, "dark metal": 0.6, "glTF's metal": 0.2, "glTF's plastic": 0.5,
    "a coat": 1.0, "a coat on matt": 0.6, "outside Rec.709": 0.1,
}  # fmt: skip
# The places are points: the light is along z, and viewer, normal and tangent are turned to it.
VERTEX = """#version 400
uniform float side;
in vec3 view; in vec3 normal; in vec3 tangent; in float place;
out VertexData { vec3 normalWorld; vec3 tangentWorld; vec3 positionWorld; } vd;
void main() {
    vd.normalWorld = normal;
    vd.tangentWorld = tangent;
    vd.positionWorld = -view;
    vec2 at = vec2(mod(place, side), floor(place / side)) + 0.5;
    gl_Position = vec4(2.0 * at / side - 1.0, 0.0, 1.0);
}
"""


def fragment_shader(path, space):
    """GLSL of the material of a file, for one directional light, in linear colours of a space."""
    materialx = pytest.importorskip("MaterialX")
    shaders = pytest.importorskip("MaterialX.PyMaterialXGenShader")
    glsl = pytest.importorskip("MaterialX.PyMaterialXGenGlsl")
    library, document = materialx.createDocument(), materialx.createDocument()
    places = materialx.getDefaultDataSearchPath()
    materialx.loadLibraries(materialx.getDefaultDataLibraryFolders(), places, library)
    materialx.readFromXmlFile(document, str(path))
    document.setDataLibrary(library)
    generator = glsl.GlslShaderGenerator.create()
    colours = shaders.DefaultColorManagementSystem.create(generator.getTarget())
    colours.loadLibrary(library)
    generator.setColorManagementSystem(colours)
    context = shaders.GenContext(generator)
    context.registerSourceCodeSearchPath(places)
    options = context.getOptions()
    options.hwSpecularEnvironmentMethod = shaders.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_NONE
    options.targetColorSpaceOverride, options.hwMaxActiveLightSources = space, 1
    shaders.HwShaderGenerator.bindLightShader(library.getNodeDef("ND_directional_light"), 1, context)
    (material,) = document.getMaterialNodes()
    source = generator.generate(material.getName(), material, context).getSourceCode("pixel")
    # Without light from all around, this is left undeclared.
    return source.replace("#version 400", "#version 400\nconst bool u_refractionTwoSided = false;", 1)


def towards_z(wi, vectors):
    """Turn vectors as `wi` is turned to z."""
    axis = np.cross(wi, [0.0, 0.0, 1.0])
    along = (axis * vectors).sum(axis=1, keepdims=True)
    return vectors * wi[:, 2:] + np.cross(axis, vectors) + axis * along / (1.0 + wi[:, 2:])


def drawn(gl, source):
    """Linear colours of each sample of the protocol."""
    count, wi = len(SPHERE.wi), SPHERE.wi
    side = int(np.ceil(np.sqrt(count)))
    turned = [towards_z(wi, np.broadcast_to(each, wi.shape)) for each in (SPHERE.wo, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])]
    corners = np.concatenate([*turned, np.arange(count)[:, None]], axis=1).astype(np.float32)
    program = gl.program(vertex_shader=VERTEX, fragment_shader=source)
    values = {"side": side, "u_viewPosition": (0, 0, 0), "u_numActiveLightSources": 1}
    light = {"type": 1, "direction": (0, 0, -1), "color": (1, 1, 1), "intensity": np.pi}
    for name, value in (values | {f"u_lightData[0].{key}": value for key, value in light.items()}).items():
        program[name] = value
    target = gl.framebuffer([gl.texture((side, side), 4, dtype="f4")])
    points = gl.vertex_array(program, [(gl.buffer(corners), "3f 3f 3f 1f", "view", "normal", "tangent", "place")])
    target.use()
    gl.disable(gl.DEPTH_TEST | gl.BLEND | gl.CULL_FACE)
    points.render(gl.POINTS)
    found = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(-1, 4)
    return found[:count, :3].astype(np.float64)


@pytest.mark.slow_cases(*(name for name in MOST if name != "lambert"))
@pytest.mark.parametrize("name", MOST)
def test_materialx_draws_the_surface(gl, tmp_path, name):
    brdf = next(brdf for other, brdf, _ in WRITTEN if other == name)
    (done,) = export([of("it", brdf)], "materialx", tmp_path / "it.mtlx")
    wide = "acescg" in done.path.read_text(encoding="utf-8")
    to_xyz = xyz_from_rgb() @ _REC709_FROM_ACESCG if wide else xyz_from_rgb()
    found = drawn(gl, fragment_shader(done.path, "acescg" if wide else "lin_rec709")) @ to_xyz.T
    assert SPHERE.compare(SPHERE.reference(brdf), found).mean <= MOST[name]
