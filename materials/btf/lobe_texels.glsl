// Terms of lobes, as field_texels.glsl asks for them; twin of LobeField.at.

#include "lobe.glsl"

float lobe_value(int place, vec3 light) {
    vec4 code = listed(kept, place);
    float cosine = dot(axis_of(code.xy), light);
    return cosine > 0.0 ? pow(cosine, exponent_of(code.z)) : 0.0;
}

vec4 field_value(ivec2 texel, ivec3 level, int view, vec3 light, int row) {
    int start = start_of(texel, level, view), amplitudes = start + SETS * KEPT_LOBES + row;
    vec4 total = listed(kept, amplitudes);
    for (int i = 0; i < KEPT_LOBES; ++i) {
        vec4 amplitude = listed(kept, amplitudes + (i + 1) * FOURS);
#if SETS == 1
        total += amplitude * lobe_value(start + i, light);
#else
        for (int j = 0; j < min(4, SETS - 4 * row); ++j)
            total[j] += amplitude[j] * lobe_value(start + (4 * row + j) * KEPT_LOBES + i, light);
#endif
    }
    return total * tallest;
}

#include "field_texels.glsl"
