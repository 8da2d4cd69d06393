// What a matt texture gathers of light from all around, twin of matt_texture.py: a cosine times `planes` of coefficients.

#include "texels.glsl"

struct Here {
    Four fine;
#ifdef MIPMAPPED
    Four coarse;
    float blend;                // how far from the fine level to the coarse one
#endif
};

Here here_at(Gathered s) {
    Here here;
#ifdef MIPMAPPED
    float level = level_at(s.footprint);
    int fine = int(level);
    here.fine = four_about(s.uv, LEVEL(fine));
    here.coarse = four_about(s.uv, LEVEL(min(fine + 1, LEVELS - 1)));
    here.blend = level - float(fine);
#else
    here.fine = four_about(s.uv, LEVEL(0));
#endif
    return here;
}

mat3 frame_of(Here here) {
    return mat3(1.0);
}

vec4 lobe(Here here, int number) {
    return vec4(0.0, 0.0, 1.0, 1.0);    // there are none
}

vec4 value(Here here, int number, int row) {
    vec4 found = between(here.fine, row);
#ifdef MIPMAPPED
    found = mix(found, between(here.coarse, row), here.blend);
#endif
    return PI * found;
}
