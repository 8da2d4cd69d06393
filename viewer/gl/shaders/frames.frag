// Position and frame of every sample and the direction to the viewer, shared by all area, environment and indirect
// light.

#include "surface.glsl"

layout(location = 0) out vec4 tangent;      // and the local direction to the viewer, one component with each
layout(location = 1) out vec4 bitangent;
layout(location = 2) out vec4 normal;
layout(location = 3) out vec4 position;     // in radii about the scene's centre

void main() {
    tangent = bitangent = normal = position = vec4(0.0);
    int number = int(texelFetch(seen, ivec2(gl_FragCoord.xy), 0).x) - 1;
    if (number < 0) return;
    Surface at = surface_at(number, gl_FragCoord.xy * SUBSTEPS);
    vec3 wo = to_local(at, at.to_viewer);
    tangent = vec4(at.tangent, wo.x);
    bitangent = vec4(at.bitangent, wo.y);
    normal = vec4(at.normal, wo.z);
    position = vec4(at.position, 1.0);
}
