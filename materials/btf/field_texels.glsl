// Terms of a reflectance field, twin of field_texels.py: four texels in three views, each under the light as it comes.
//
// Needs before its inclusion: what is in corners.glsl; vec4 field_value(ivec2 texel, ivec3 level, int view, vec3 light,
// int row), the values of four coefficients, those of number `row`; FOURS, the number of fours.

uniform sampler2D views;
uniform vec2 steepest;          // angle of the lowest light that was measured, and its cosine

#include "hemisphere.glsl"

struct Here {
    Corners corners;
    Around view;
    vec3 light;
    float scale;
};

Here here_at(Sample s) {
    float azimuth = s.azimuths.x, view = azimuth + s.angles.z;
    Around seen = around(views, VIEW_CELLS, s.angles.y * vec2(cos(view), sin(view)), -1.0);
    bool low = s.angles.x > steepest.x;
    float theta = low ? steepest.x : s.angles.x;
    float falling = low ? max(cos(s.angles.x), 0.0) / steepest.y : 1.0;
    vec3 light = vec3(sin(theta) * vec2(cos(azimuth), sin(azimuth)), cos(theta));
    return Here(corners_about(s.uv, s.footprint), seen, light, s.angles.w * falling);
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    vec4 total = vec4(0.0);
    for (int look = 0; look < LOOKS; ++look) {
        if (here.corners.share[look] == 0.0) continue;
        Four four = here.corners.four[look];
        for (int corner = 0; corner < 4; ++corner) {
            ivec2 texel = corner_at(four, corner);
            float share = here.corners.share[look] * share_of(four, corner);
            for (int side = 0; side < 3; ++side) {
                float part = share * here.view.share[side];
                if (part == 0.0) continue;
                total += part * field_value(texel, four.level, here.view.number[side], here.light, row);
            }
        }
    }
    return total * here.scale;
}
