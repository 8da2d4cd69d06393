// Terms of a spectral texture, twin of texture_form.py: `planes` of coefficients, at `levels`.

#include "texels.glsl"

struct Here {
    Mixed texels;
    float scale;
};

Here here_at(Sample s) {
    return Here(mixed_about(s.uv, s.footprint), s.angles.w);
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    return mixed_between(here.texels, row) * here.scale;
}
