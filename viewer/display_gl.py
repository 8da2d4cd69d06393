"""The display transform on the GPU, through the GLSL that OpenColorIO itself writes.

Twin of `DisplayTransform.apply`. Look-up tables become float32 textures, 1-D ones as rows of a 2-D texture because
moderngl has no 1-D textures; uniforms are set from OCIO's getters. The target is float32, so that what falls
outside [0, 1] can still be counted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from ..spectral.errors import InputError

if TYPE_CHECKING:
    from .display import DisplayTransform

_VERTEX = """#version 410 core
void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
"""

_FRAGMENT = """#version 410 core
{ocio}
uniform sampler2D xyz_d65;
out vec4 rgb;
void main() {{
    rgb = OCIOMain(vec4(texelFetch(xyz_d65, ivec2(gl_FragCoord.xy), 0).rgb, 1.0));
}}
"""


class DisplayPass:
    """A compiled display transform on one moderngl context; keep it for as long as the transform is used.

    Raises
    ------
    InputError : the transform has no GLSL form, or the driver does not compile it.
    """

    def __init__(self, context: Any, transform: DisplayTransform) -> None:
        import moderngl
        import PyOpenColorIO as ocio

        self._context = context
        self._description = ocio.GpuShaderDesc.CreateShaderDesc(
            language=ocio.GPU_LANGUAGE_GLSL_4_0, functionName="OCIOMain", resourcePrefix="ocio_"
        )
        self._description.setAllowTexture1D(False)
        # The transform's textures must fit the context, or OCIO has to fold them over more rows.
        self._description.setTextureMaxWidth(min(4096, context.info["GL_MAX_TEXTURE_SIZE"]))
        gpu = transform.processor.getOptimizedGPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
        gpu.extractGpuShaderInfo(self._description)
        source = _FRAGMENT.format(ocio=self._description.getShaderText())
        try:
            self._program = context.program(vertex_shader=_VERTEX, fragment_shader=source)
        except moderngl.Error as reason:
            raise InputError(
                "the driver does not compile OpenColorIO's shader for this display",
                field=f"{transform.display} / {transform.view}",
                found=str(reason).strip(),
                hint="the CPU path shows the same picture",
            ) from None
        self._textures = [*self._flat_textures(), *self._cubes()]
        self._array = context.vertex_array(self._program, [])

    def _flat_textures(self) -> list[tuple[str, Any]]:
        import PyOpenColorIO as ocio

        made = []
        for texture in self._description.getTextures():
            components = 1 if texture.channel == self._description.TEXTURE_RED_CHANNEL else 3
            values = np.ascontiguousarray(texture.getValues(), dtype=np.float32)
            size = (texture.width, max(texture.height, 1))
            made.append((texture.samplerName, self._context.texture(size, components, values.tobytes(), dtype="f4")))
            self._set_filter(made[-1][1], texture.interpolation == ocio.INTERP_NEAREST)
        return made

    def _cubes(self) -> list[tuple[str, Any]]:
        import PyOpenColorIO as ocio

        made = []
        for texture in self._description.get3DTextures():
            values = np.ascontiguousarray(texture.getValues(), dtype=np.float32)
            size = (texture.edgeLen,) * 3
            made.append((texture.samplerName, self._context.texture3d(size, 3, values.tobytes(), dtype="f4")))
            made[-1][1].repeat_z = False
            self._set_filter(made[-1][1], texture.interpolation == ocio.INTERP_NEAREST)
        return made

    def _set_filter(self, texture: Any, nearest: bool) -> None:
        import moderngl

        kind = moderngl.NEAREST if nearest else moderngl.LINEAR
        texture.filter = (kind, kind)
        texture.repeat_x = texture.repeat_y = False

    def _set_uniforms(self) -> None:
        import PyOpenColorIO as ocio

        read = {
            ocio.UNIFORM_DOUBLE: lambda data: data.getDouble(),
            ocio.UNIFORM_BOOL: lambda data: data.getBool(),
            ocio.UNIFORM_FLOAT3: lambda data: tuple(data.getFloat3()),
            ocio.UNIFORM_VECTOR_FLOAT: lambda data: np.asarray(data.getVectorFloat(), dtype="f4").tolist(),
            ocio.UNIFORM_VECTOR_INT: lambda data: np.asarray(data.getVectorInt(), dtype="i4").tolist(),
        }
        for name, data in self._description.getUniforms():
            # A compiler drops uniforms that do not reach the output.
            if name in self._program:
                self._program[name].value = read[data.type](data)

    def apply(self, xyz_d65: Float[np.ndarray, "H W 3"]) -> Float[np.ndarray, "H W 3"]:
        """Encode XYZ that already has the display's white; float32, not clipped."""
        height, width = xyz_d65.shape[:2]
        source = self._context.texture(
            (width, height), 3, np.ascontiguousarray(xyz_d65, dtype="f4").tobytes(), dtype="f4"
        )
        target = self._context.texture((width, height), 4, dtype="f4")
        framebuffer = self._context.framebuffer([target])
        try:
            self.draw(source, framebuffer)
            data = np.frombuffer(framebuffer.read(components=3, dtype="f4", alignment=1), dtype=np.float32)
        finally:
            for resource in (framebuffer, target, source):
                resource.release()
        return data.reshape(height, width, 3).copy()

    def draw(self, xyz_d65_texture: Any, framebuffer: Any) -> None:
        """Encode one float texture into a framebuffer of its size, texel for texel."""
        import moderngl

        xyz_d65_texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        xyz_d65_texture.use(0)
        self._program["xyz_d65"].value = 0
        for unit, (sampler, texture) in enumerate(self._textures, start=1):
            if sampler in self._program:
                texture.use(unit)
                self._program[sampler].value = unit
        self._set_uniforms()
        framebuffer.use()
        framebuffer.viewport = (0, 0, *framebuffer.size)
        self._context.disable(moderngl.DEPTH_TEST | moderngl.BLEND | moderngl.CULL_FACE)
        self._array.render(moderngl.TRIANGLES, vertices=3)
