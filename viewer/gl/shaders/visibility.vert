// Clipped and snapped triangles: positions are exact on the grid of 1/256 sample.

#include "triangles.glsl"

uniform vec2 half_size;         // of the target, in 1/256 sample

flat out ivec2 plane_reference;
flat out vec3 plane;
flat out vec2 plane_range;
flat out float triangle;

void main() {
    int number = gl_VertexID / 3, corner = gl_VertexID % 3;
    vec4 first = triangle_texel(number, 0), place = triangle_texel(number, 3), range = triangle_texel(number, 4);
    vec2 at = corner == 0 ? first.xy : corner == 1 ? first.zw : triangle_texel(number, 1).xy;
    plane_reference = ivec2(place.w, range.w);
    plane = place.xyz;
    plane_range = range.xy;
    triangle = float(number + 1);
    // The target's rows are the image's rows: row 0 on top, so that y points down in clip space too.
    gl_Position = vec4(at / half_size - 1.0, 0.0, 1.0);
}
