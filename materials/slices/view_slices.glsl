// Slices over a grid of viewers, twin of view_slices.py: a row a slice, and four terms a texel of its values.

uniform sampler2D axes;         // axis of each Gaussian, and 1 / lambda
uniform sampler2D values;       // value of each Gaussian, and of the cosine, last
uniform int quads;              // texels a value
uniform float last;             // theta_o of the last viewer

#if AZIMUTHS == 1
#define CORNERS 2
#else
#define CORNERS 4
#endif

struct Here {
    int rows[CORNERS];
    float weights[CORNERS];
    vec2 plane;                 // the viewer's, from that of +x
};

Here here_at(Gathered s) {
    Here here;
    float level = length(s.wo.xy);
    float share = clamp(atan(level, s.wo.z) / last, 0.0, 1.0);
    float place = (1.0 - pow(1.0 - share, 2.0 / 3.0)) * float(POLAR - 1);
    int below = min(int(place), POLAR - 2);
    float polar = place - float(below);
#if AZIMUTHS == 1
    here.rows = int[2](below, below + 1);
    here.weights = float[2](1.0 - polar, polar);
    here.plane = level > 0.0 ? s.wo.xy / level : vec2(1.0, 0.0);
#else
    float turn = atan(s.wo.y, s.wo.x) / (2.0 * PI);
    float around = (turn - floor(turn)) * float(AZIMUTHS);
    int first = int(floor(around));
    float azimuth = around - float(first);
    int one = first % AZIMUTHS, other = (first + 1) % AZIMUTHS;
    here.rows = int[4](below * AZIMUTHS + one, below * AZIMUTHS + other,
        (below + 1) * AZIMUTHS + one, (below + 1) * AZIMUTHS + other);
    here.weights = float[4]((1.0 - polar) * (1.0 - azimuth), (1.0 - polar) * azimuth,
        polar * (1.0 - azimuth), polar * azimuth);
    here.plane = vec2(1.0, 0.0);
#endif
    return here;
}

// Frame of the slices: of isotropic materials, turned into the viewer's plane.
mat3 frame_of(Here here) {
    return mat3(here.plane.x, here.plane.y, 0.0, -here.plane.y, here.plane.x, 0.0, 0.0, 0.0, 1.0);
}

vec4 lobe(Here here, int number) {
    vec4 found = vec4(0.0);
    for (int k = 0; k < CORNERS; ++k) found += here.weights[k] * texelFetch(axes, ivec2(number, here.rows[k]), 0);
    found.xyz = normalize(found.xyz);
    return found;
}

vec4 value(Here here, int number, int row) {
    vec4 found = vec4(0.0);
    for (int k = 0; k < CORNERS; ++k)
        found += here.weights[k] * texelFetch(values, ivec2(number * quads + row, here.rows[k]), 0);
    return found;
}
