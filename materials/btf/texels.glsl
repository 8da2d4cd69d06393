// Terms of a BTF, twin of texels.py: of four texels what their clusters' components come to, then mixed.

uniform sampler2D components;
uniform sampler2D texels;
uniform sampler2D views;
uniform sampler2D lights;
uniform ivec2 size;

#include "hemisphere.glsl"
#include "texel.glsl"

struct Here {
    ivec2 first;
    vec2 part;
    Around view;
    Around light;
    float scale;
};

Here here_at(Sample s) {
    vec2 place = vec2(s.uv.x, 1.0 - s.uv.y) * vec2(size) - 0.5;
    vec2 first = floor(place);
    float light = s.azimuths.x, view = s.azimuths.x + s.angles.z;
    Around seen = around(views, VIEW_CELLS, s.angles.y * vec2(cos(view), sin(view)), -1.0);
    Around lit = around(lights, LIGHT_CELLS, s.angles.x * vec2(cos(light), sin(light)), max(cos(s.angles.x), 0.0));
    return Here(ivec2(first), place - first, seen, lit, s.angles.w);
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 texel_at(ivec2 texel, Here here, int row) {
    int cluster = int(number_of(texel, 0)), width = textureSize(components, 0).x;
    vec4 total = vec4(0.0);
    float weights[COMPONENTS];
    for (int i = 0; i < COMPONENTS; ++i) weights[i] = number_of(texel, i + 1);
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            float share = here.view.share[a] * here.light.share[b];
            if (share == 0.0) continue;
            int pair = (cluster * VIEWS + here.view.number[a]) * LIGHTS + here.light.number[b];
            int at = pair * COMPONENTS * FOURS + row;
            vec4 found = vec4(0.0);
            for (int i = 0; i < COMPONENTS; ++i) {
                found += weights[i] * texelFetch(components, ivec2(at % width, at / width), 0);
                at += FOURS;
            }
            total += share * found;
        }
    }
    return total;
}

vec4 term(Here here, int mixed, int row) {
    vec4 total = vec4(0.0);
    for (int corner = 0; corner < 4; ++corner) {
        total += share_of(here.part, corner) * texel_at(corner_at(here.first, corner), here, row);
    }
    return total * here.scale;
}
