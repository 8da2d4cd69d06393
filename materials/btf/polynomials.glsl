// Polynomials of the light, twin of polynomials.py: whole numbers of steps above an offset, of each view and coefficient.

#include "corners.glsl"
#include "listed.glsl"

uniform sampler2D codes;
uniform sampler2D steps;
uniform sampler2D lowest;

// The coefficient of monomial number `number`; codes of coarser texels are means.
vec4 field_term(ivec2 texel, ivec3 level, int view, int number, int row) {
    int place = VIEWS * level.z + (view * level.y + texel.y) * level.x + texel.x;
    int of_view = (view * 6 + number) * FOURS + row;
    vec4 code = listed(codes, (place * 6 + number) * FOURS + row);
    return code * listed(steps, of_view) + listed(lowest, of_view);
}

vec4 field_value(ivec2 texel, ivec3 level, int view, vec3 light, int row) {
    float monomials[6] = float[6](light.x * light.x, light.y * light.y, light.x * light.y, light.x, light.y, 1.0);
    vec4 total = vec4(0.0);
    for (int number = 0; number < 6; ++number) total += monomials[number] * field_term(texel, level, view, number, row);
    return total;
}
