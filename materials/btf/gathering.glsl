// Light gathered by a BTF from all around, twin of gathering.py: terms of a light basis, times the light in each.

uniform sampler2D components;
uniform sampler2D views;

#include "hemisphere.glsl"
#include "texel.glsl"

struct Here {
    vec4 terms[TERMS * FOURS];
};

Here here_at(Gathered s) {
    Here here;
    for (int k = 0; k < TERMS * FOURS; ++k) here.terms[k] = vec4(0.0);
    Corners corners = corners_about(s.uv, s.footprint);
    Around seen = around(views, VIEW_CELLS, plane_of(s.wo), -1.0);
    vec4 weights[QUADS_A_TEXEL];
    for (int look = 0; look < LOOKS; ++look) {
        if (corners.share[look] == 0.0) continue;
        Four four = corners.four[look];
        Clustered from = clustered(four);
        for (int corner = 0; corner < 4; ++corner) {
            if (!weights_of(from, four, corner, weights)) continue;
            for (int i = 0; i < COMPONENTS; ++i) {
                float weight = corners.share[look] * weights[(i + 1) / 4][(i + 1) % 4];
                if (weight == 0.0) continue;
                for (int a = 0; a < 3; ++a) {
                    float part = weight * seen.share[a];
                    int at = ((from.cluster[corner] * VIEWS + seen.number[a]) * COMPONENTS + i) * TERMS * FOURS;
                    for (int k = 0; k < TERMS * FOURS; ++k)
                        here.terms[k] += part * listed(components, at + k);
                }
            }
        }
    }
    return here;
}

#include "fixed_lobes.glsl"
