// What a reflectance field gathers of light from all around, twin of field_gathering.py.
//
// Whoever includes it has, before: uniform ivec2 size; vec4 field_term(ivec2 texel, int view, int number, int row), four
// coefficients of a term; there are TERMS of them.

uniform sampler2D views;

#include "hemisphere.glsl"
#include "corners.glsl"

struct Here {
    vec4 terms[TERMS * FOURS];
};

Here here_at(Gathered s) {
    Here here;
    for (int k = 0; k < TERMS * FOURS; ++k) here.terms[k] = vec4(0.0);
    vec2 place = vec2(s.uv.x, 1.0 - s.uv.y) * vec2(size) - 0.5;
    vec2 first = floor(place);
    Around seen = around(views, VIEW_CELLS, plane_of(s.wo), -1.0);
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 texel = corner_at(ivec2(first), corner);
        float share = share_of(place - first, corner);
        for (int side = 0; side < 3; ++side) {
            float part = share * seen.share[side];
            if (part == 0.0) continue;
            for (int k = 0; k < TERMS * FOURS; ++k)
                here.terms[k] += part * field_term(texel, seen.number[side], k / FOURS, k % FOURS);
        }
    }
    return here;
}

#include "standing.glsl"
