// Input of an environment form at each sample; docs/adding_a_surface.md describes its output.

struct Gathered {
    vec3 wo;            // local direction to the viewer
#ifdef USES_UV
    vec2 uv;
    mat2 footprint;     // of a sample: change of uv to the next column of samples, and to the next row
#endif
};
