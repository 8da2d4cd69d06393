// Input of a render form at each sample; docs/adding_a_surface.md describes its output.

struct Sample {
    vec4 angles;        // three of the summand's frame; the light that arrives ("io"), or that times cos(theta_i) ("hd")
    vec2 azimuths;      // phi_i, phi_h
#ifdef MIPMAPPED
    vec4 span;          // radians of each angle of the frame that the sample stands for
#endif
#ifdef USES_UV
    vec2 uv;
    mat2 footprint;     // of a sample: how far uv go across a column of samples, and across a row
#endif
};
