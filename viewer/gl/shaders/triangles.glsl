// Triangles of a window, clipped and snapped to the grid; see resources.triangle_texels.

uniform sampler2D triangles;

vec4 triangle_texel(int number, int index) {
    return texelFetch(triangles, ivec2((number % TRIANGLES_A_ROW) * TRIANGLE_TEXELS + index, number / TRIANGLES_A_ROW), 0);
}
