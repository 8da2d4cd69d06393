// Terms of a reflectance field, twin of field_texels.py: four texels in three views, each under the light as it comes.
//
// Whoever includes it has, before: uniform ivec2 size; vec4 field_value(ivec2 texel, int view, vec3 light, int row), the
// values of four coefficients, those of number `row`; FOURS says how many fours there are.

uniform sampler2D views;
uniform vec2 steepest;          // angle of the lowest light that was measured, and its cosine

#include "hemisphere.glsl"
#include "corners.glsl"

struct Here {
    ivec2 first;
    vec2 part;
    Around view;
    vec3 light;
    float scale;
};

Here here_at(Sample s) {
    vec2 place = vec2(s.uv.x, 1.0 - s.uv.y) * vec2(size) - 0.5;
    vec2 first = floor(place);
    float azimuth = s.azimuths.x, view = azimuth + s.angles.z;
    Around seen = around(views, VIEW_CELLS, s.angles.y * vec2(cos(view), sin(view)), -1.0);
    bool low = s.angles.x > steepest.x;
    float theta = low ? steepest.x : s.angles.x;
    float falling = low ? max(cos(s.angles.x), 0.0) / steepest.y : 1.0;
    vec3 light = vec3(sin(theta) * vec2(cos(azimuth), sin(azimuth)), cos(theta));
    return Here(ivec2(first), place - first, seen, light, s.angles.w * falling);
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    vec4 total = vec4(0.0);
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 texel = corner_at(here.first, corner);
        float share = share_of(here.part, corner);
        for (int side = 0; side < 3; ++side) {
            float part = share * here.view.share[side];
            if (part == 0.0) continue;
            total += part * field_value(texel, here.view.number[side], here.light, row);
        }
    }
    return total * here.scale;
}
