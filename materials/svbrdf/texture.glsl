// Terms of a spectral texture, twin of texture_form.py: `planes` of coefficients, at `levels`.

#include "texels.glsl"

struct Here {
    Four fine;
#ifdef MIPMAPPED
    Four coarse;
    float blend;                // how far from the fine level to the coarse one
#endif
    float scale;
};

Here here_at(Sample s) {
    Here here;
    here.scale = s.angles.w;
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

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    vec4 found = between(here.fine, row);
#ifdef MIPMAPPED
    found = mix(found, between(here.coarse, row), here.blend);
#endif
    return found * here.scale;
}
