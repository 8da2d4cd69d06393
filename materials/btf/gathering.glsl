// What a BTF gathers of light from all around, twin of gathering.py: terms of a light basis, times what they take of it.

uniform sampler2D components;
uniform sampler2D texels;
uniform sampler2D views;
uniform ivec2 size;

#include "hemisphere.glsl"
#include "texel.glsl"

struct Here {
    vec4 terms[TERMS * FOURS];
};

Here here_at(Gathered s) {
    Here here;
    for (int k = 0; k < TERMS * FOURS; ++k) here.terms[k] = vec4(0.0);
    vec2 place = vec2(s.uv.x, 1.0 - s.uv.y) * vec2(size) - 0.5;
    vec2 first = floor(place);
    Around seen = around(views, VIEW_CELLS, plane_of(s.wo), -1.0);
    int width = textureSize(components, 0).x;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 texel = corner_at(ivec2(first), corner);
        float share = share_of(place - first, corner);
        int cluster = int(number_of(texel, 0));
        for (int i = 0; i < COMPONENTS; ++i) {
            float weight = share * number_of(texel, i + 1);
            if (weight == 0.0) continue;
            for (int a = 0; a < 3; ++a) {
                float part = weight * seen.share[a];
                int at = ((cluster * VIEWS + seen.number[a]) * COMPONENTS + i) * TERMS * FOURS;
                for (int k = 0; k < TERMS * FOURS; ++k)
                    here.terms[k] += part * texelFetch(components, ivec2((at + k) % width, (at + k) / width), 0);
            }
        }
    }
    return here;
}

#include "standing.glsl"
