// Texture coordinates and footprints at every sample; twin of surfaces.uv_at.

#include "surface.glsl"

uniform sampler2D uvs;          // see resources.uv_texels

layout(location = 0) out vec2 uv;
layout(location = 1) out vec4 footprint;    // change of (u, v) to the next column of samples, and to the next row

vec4 uv_texel(int number, int index) {
    return texelFetch(uvs, ivec2((number % UVS_A_ROW) * UV_TEXELS + index, number / UVS_A_ROW), 0);
}

// Derivatives of the areas for a step of one sample: along x the heights of the sides, along y minus their widths.
vec3 slopes(vec3 from, vec3 to, vec3 inverse_w) {
    return SUBSTEPS * (from - to) * inverse_w;
}

void main() {
    uv = vec2(0.0);
    footprint = vec4(0.0);
    int number = int(texelFetch(seen, ivec2(gl_FragCoord.xy), 0).x) - 1;
    if (number < 0) return;
    vec2 point = gl_FragCoord.xy * SUBSTEPS;
    vec4 ends = triangle_texel(number, 0);
    vec2 a = ends.xy, b = ends.zw, c = triangle_texel(number, 1).xy;
    vec3 inverse_w = triangle_texel(number, 2).xyz;
    vec3 weights = areas(a - point, b - point, c - point) * inverse_w;
    float whole = weights.x + weights.y + weights.z;
    if (whole == 0.0) whole = 1.0;
    vec4 first = uv_texel(number, 0);
    vec2 third = uv_texel(number, 1).xy;
    uv = (weights.x * first.xy + weights.y * first.zw + weights.z * third) / whole;
    mat3x2 apart = mat3x2(first.xy - uv, first.zw - uv, third - uv);
    footprint.xy = apart * slopes(vec3(b.y, c.y, a.y), vec3(c.y, a.y, b.y), inverse_w) / whole;
    footprint.zw = apart * slopes(vec3(c.x, a.x, b.x), vec3(b.x, c.x, a.x), inverse_w) / whole;
}
