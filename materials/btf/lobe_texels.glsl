// Terms of a lobe field, twin of lobe_texels.py: of four texels in three views what their lobes come to, then mixed.

uniform sampler2D kept;
uniform sampler2D views;
uniform ivec2 size;
uniform float steepest;         // angle of the lowest light that was measured
uniform float tallest;          // what amplitudes are relative to

#include "hemisphere.glsl"
#include "lobe.glsl"

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
    float theta = min(s.angles.x, steepest);
    float falling = s.angles.x > steepest ? max(cos(s.angles.x), 0.0) / cos(steepest) : 1.0;
    vec3 light = vec3(sin(theta) * vec2(cos(azimuth), sin(azimuth)), cos(theta));
    return Here(ivec2(first), place - first, seen, light, s.angles.w * falling * tallest);
}

int entry(Here here, int mixed) {
    return 0;
}

float lobe_value(int place, vec3 light) {
    vec4 code = kept_at(place);
    float cosine = dot(axis_of(code.xy), light);
    return cosine > 0.0 ? pow(cosine, exponent_of(code.z)) : 0.0;
}

vec4 texel_at(int start, vec3 light, int row) {
    int amplitudes = start + SETS * KEPT_LOBES + row;
    vec4 total = kept_at(amplitudes);
    for (int i = 0; i < KEPT_LOBES; ++i) {
        vec4 amplitude = kept_at(amplitudes + (i + 1) * FOURS);
#if SETS == 1
        total += amplitude * lobe_value(start + i, light);
#else
        for (int j = 0; j < min(4, SETS - 4 * row); ++j)
            total[j] += amplitude[j] * lobe_value(start + (4 * row + j) * KEPT_LOBES + i, light);
#endif
    }
    return total;
}

vec4 term(Here here, int mixed, int row) {
    vec4 total = vec4(0.0);
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 texel = corner_at(here.first, corner);
        float share = share_of(here.part, corner);
        for (int a = 0; a < 3; ++a) {
            float part = share * here.view.share[a];
            if (part == 0.0) continue;
            total += part * texel_at(start_of(texel, here.view.number[a]), here.light, row);
        }
    }
    return total * here.scale;
}
