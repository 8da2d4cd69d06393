// Light gathered by a reflectance field from all around, twin of field_gathering.py.
//
// Needs before its inclusion: what is in corners.glsl; vec4 field_term(ivec2 texel, ivec3 level, int view, int number,
// int row), four coefficients of a term; TERMS, their number.

uniform sampler2D views;

#include "hemisphere.glsl"

struct Here {
    vec4 terms[TERMS * FOURS];
};

Here here_at(Gathered s) {
    Here here;
    for (int k = 0; k < TERMS * FOURS; ++k) here.terms[k] = vec4(0.0);
    Corners corners = corners_about(s.uv, s.footprint);
    Around seen = around(views, VIEW_CELLS, plane_of(s.wo), -1.0);
    for (int look = 0; look < LOOKS; ++look) {
        if (corners.share[look] == 0.0) continue;
        Four four = corners.four[look];
        for (int corner = 0; corner < 4; ++corner) {
            ivec2 texel = corner_at(four, corner);
            float share = corners.share[look] * share_of(four, corner);
            for (int side = 0; side < 3; ++side) {
                float part = share * seen.share[side];
                if (part == 0.0) continue;
                for (int k = 0; k < TERMS * FOURS; ++k)
                    here.terms[k] += part * field_term(texel, four.level, seen.number[side], k / FOURS, k % FOURS);
            }
        }
    }
    return here;
}

#include "fixed_lobes.glsl"
