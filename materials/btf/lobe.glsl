// Stored lobes of a texel, twin of quantisation.py: of each view and texel SETS sets of KEPT_LOBES lobes, then FOURS
// of each amplitude. Levels lie one behind the other.

#include "corners.glsl"
#include "listed.glsl"

uniform sampler2D kept;
uniform float tallest;          // unit of the amplitudes

const int STRIDE = SETS * KEPT_LOBES + (KEPT_LOBES + 1) * FOURS;

// Index of the first number of a texel in a view.
int start_of(ivec2 texel, ivec3 level, int view) {
    return (VIEWS * level.z + (view * level.y + texel.y) * level.x + texel.x) * STRIDE;
}

// Direction from bytes of an unfolded octahedron (Meyer et al. 2010).
vec3 axis_of(vec2 code) {
    vec2 place = (code - 127.0) / 127.0;
    float up = 1.0 - abs(place.x) - abs(place.y);
    vec2 turned = (1.0 - abs(place.yx)) * vec2(place.x < 0.0 ? -1.0 : 1.0, place.y < 0.0 ? -1.0 : 1.0);
    return normalize(vec3(up < 0.0 ? turned : place, up));
}

float exponent_of(float code) {
    return exp2(0.5 * code);
}
