// Terms of a BTF, twin of texels.py: of four texels what their clusters' components come to, then mixed.

uniform sampler2D components;
uniform sampler2D views;
uniform sampler2D lights;

#include "hemisphere.glsl"
#include "texel.glsl"

struct Here {
    Corners corners;
    Around view;
    Around light;
    float scale;
};

Here here_at(Sample s) {
    float light = s.azimuths.x, view = s.azimuths.x + s.angles.z;
    Around seen = around(views, VIEW_CELLS, s.angles.y * vec2(cos(view), sin(view)), -1.0);
    Around lit = around(lights, LIGHT_CELLS, s.angles.x * vec2(cos(light), sin(light)), max(cos(s.angles.x), 0.0));
    return Here(corners_about(s.uv, s.footprint), seen, lit, s.angles.w);
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 cluster_at(int cluster, vec4 weights[QUADS_A_TEXEL], Here here, int row) {
    vec4 total = vec4(0.0);
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            float share = here.view.share[a] * here.light.share[b];
            if (share == 0.0) continue;
            int pair = (cluster * VIEWS + here.view.number[a]) * LIGHTS + here.light.number[b];
            int at = pair * COMPONENTS * FOURS + row;
            vec4 found = vec4(0.0);
            for (int i = 1; i <= COMPONENTS; ++i) {
                found += weights[i / 4][i % 4] * listed(components, at);
                at += FOURS;
            }
            total += share * found;
        }
    }
    return total;
}

vec4 term(Here here, int mixed, int row) {
    vec4 total = vec4(0.0), weights[QUADS_A_TEXEL];
    for (int look = 0; look < LOOKS; ++look) {
        if (here.corners.share[look] == 0.0) continue;
        Four four = here.corners.four[look];
        Clustered from = clustered(four);
        for (int corner = 0; corner < 4; ++corner) {
            if (!weights_of(from, four, corner, weights)) continue;
            total += here.corners.share[look] * cluster_at(from.cluster[corner], weights, here, row);
        }
    }
    return total * here.scale;
}
