// One light at every sample: the angles that materials are looked up at, and the irradiance that arrives. Kept for all
// materials and all spectra; twin of software._reached and materials.factored.pack.frame_angles. Where factors are mip-mapped,
// what the sample spans of each angle too.

#include "angles.glsl"
#include "surface.glsl"
#ifdef FREE
uniform sampler2D free;         // what of the light reaches each sample
#else
#include "shadows.glsl"
#endif

uniform sampler2D lit;          // 1 where the light stands above a triangle's horizon
uniform vec4 light;             // homogeneous: direction to it and 0, or where it stands and 1
uniform float irradiance;       // pi E / E_ref over the samples of a pixel, where `offset_at` has length 1

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
    if (!(wi.z > 0.0)) return;  // nor where the light stands on the very sample
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
