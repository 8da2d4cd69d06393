// Light gathered by a matt texture from all around, twin of texture_form.py: a cosine times `planes` of coefficients.

#include "texels.glsl"

struct Here {
    Mixed texels;
};

Here here_at(Gathered s) {
    return Here(mixed_about(s.uv, s.footprint));
}

mat3 frame_of(Here here) {
    return mat3(1.0);
}

vec4 lobe(Here here, int number) {
    return vec4(0.0, 0.0, 1.0, 1.0);    // there are none
}

vec4 value(Here here, int number, int row) {
    return PI * mixed_between(here.texels, row);
}
