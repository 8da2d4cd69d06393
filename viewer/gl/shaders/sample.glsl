// Input of a render form at each sample; docs/adding_a_surface.md describes its output.

struct Sample {
    vec4 angles;        // three of the summand's frame; irradiance ("io"), or irradiance times cos(theta_i) ("hd")
    vec2 azimuths;      // phi_i, phi_h
#ifdef MIPMAPPED
    vec4 span;          // footprint of the sample in each angle of the frame, radians
#endif
#ifdef USES_UV
    vec2 uv;
    mat2 footprint;     // of a sample: change of uv to the next column of samples, and to the next row
#endif
};
