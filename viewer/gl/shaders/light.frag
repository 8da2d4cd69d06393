// One light at every sample: angles for look-ups of materials, and irradiance, shared by all materials and spectra;
// twin of software.backend._reached and materials.factored.pack.frame_angles. With mip-mapped factors, also the
// sample's span in each angle.

#include "angles.glsl"
#include "surface.glsl"
#ifdef FREE
uniform sampler2D free;         // share of the light that reaches each sample
#else
#include "shadows.glsl"
#endif

uniform sampler2D lit;          // 1 if the light is above a triangle's horizon
uniform vec4 light;             // homogeneous: direction to it and 0, or position and 1
uniform float irradiance;       // pi E / E_ref over the samples of a pixel, at length 1 of `offset_at`

vec3 offset_at(Surface at) {
    return light.xyz - light.w * at.position;
}

layout(location = 0) out vec4 io;       // theta_i, theta_o, phi; irradiance
layout(location = 1) out vec4 hd;       // theta_h, theta_d, phi_d; irradiance cos(theta_i)
layout(location = 2) out vec2 azimuth;  // phi_i, phi_h
#ifdef MIPMAPPED
#include "footprint.glsl"
layout(location = 3) out vec4 io_span;  // radians of theta_i, theta_o, phi, phi_i
layout(location = 4) out vec4 hd_span;  // radians of theta_h, theta_d, phi_d, phi_h
#endif

void main() {
    io = vec4(0.0);
    hd = vec4(0.0);
    azimuth = vec2(0.0);
#ifdef MIPMAPPED
    io_span = vec4(0.0);
    hd_span = vec4(0.0);
#endif
    int number = int(texelFetch(seen, ivec2(gl_FragCoord.xy), 0).x) - 1;
    if (number < 0) return;
    if (texelFetch(lit, ivec2(number % ROW_LENGTH, number / ROW_LENGTH), 0).x == 0.0) return;
    Surface at = surface_at(number, gl_FragCoord.xy * SUBSTEPS);
    vec3 offset = offset_at(at);
    float squared = dot(offset, offset);
    vec3 to_light = offset / sqrt(squared);
    float arriving = irradiance / squared;
    vec3 wi = to_local(at, to_light);
    if (!(wi.z > 0.0)) return;  // nor at the light's own position
#ifdef FREE
    arriving *= texelFetch(free, ivec2(gl_FragCoord.xy), 0).x;
#else
    arriving *= visibility(at.position, at.face);
#endif
    if (arriving == 0.0) return;
    vec3 wo = to_local(at, at.to_viewer);
    io = vec4(io_angles(wi, wo), arriving);
    hd = vec4(hd_angles(wi, wo), arriving * wi.z);
    azimuth = azimuths(wi, wo);
#ifdef MIPMAPPED
    footprint(number, at, to_light, wi, wo, io_span, hd_span);
#endif
}
