// Terms of a factor pack, twin of pack.py: one texel holds four terms at one node of one axis. Interpolated by
// hand, because texture units filter with 8 bits of fraction, which would show.

uniform sampler2D factors;
uniform vec4 axes[AXES];      // 1 / maximum, size - 1, first column, 0 linear, 1 square root, 2 periodic

struct Place {
    int below, beyond;          // columns of the two nodes about an angle
    float between;              // its fraction of the way from the one to the other
};

Place place_among(float first, float steps, float position) {
    float below = min(floor(position), steps);
    return Place(int(first + below), int(first + min(below + 1.0, steps)), position - below);
}

Place place_on(vec4 axis, float angle) {
    float u = angle * axis.x;
    u = axis.w == 2.0 ? fract(u) : clamp(u, 0.0, 1.0);
    return place_among(axis.z, axis.y, (axis.w == 1.0 ? sqrt(u) : u) * axis.y);
}

vec4 look_up(Place place, int row) {
    return mix(texelFetch(factors, ivec2(place.below, row), 0), texelFetch(factors, ivec2(place.beyond, row), 0),
        place.between);
}

#ifdef MIPMAPPED
// Means over what a sample spans, between two levels; twin of pyramids.py.

uniform vec3 levels[AXES * MOST_LEVELS];        // first column, size - 1 and 1 / spacing of each
uniform float last_level[AXES];

struct Mean {
    Place fine, coarse;
    float blend;                // fraction of the way from the fine level to the coarse one; 0 reads the fine one alone
};

Mean mean_on(int number, float angle, float span) {
    vec4 axis = axes[number];
    float u = angle * axis.x, steps = axis.y;
    if (axis.w == 2.0) u = fract(u);
    // Levels go on beyond the last node.
    float position = (axis.w == 1.0 ? sqrt(u) : u) * steps;
    float nodes = span * axis.x * steps;
    if (axis.w == 1.0) {
        float spread = 0.5 * nodes * steps;
        nodes = spread > 2.0 * position * position ? 2.0 * sqrt(spread - position * position) : spread / position;
    }
    float level = clamp(log2(max(nodes, 1.0)), 0.0, last_level[number]);
    int fine = int(level);
    vec3 here = levels[number * MOST_LEVELS + fine];
    vec3 next = levels[number * MOST_LEVELS + min(fine + 1, int(last_level[number]))];
    Place finer = place_among(here.x, here.y, min(position * here.z, here.y));
    Place coarser = place_among(next.x, next.y, min(position * next.z, next.y));
    return Mean(finer, coarser, level - float(fine));
}

vec4 look_up(Mean mean, int row) {
    vec4 found = look_up(mean.fine, row);
    return mean.blend > 0.0 ? mix(found, look_up(mean.coarse, row), mean.blend) : found;
}
#endif

#ifdef MIPMAPPED
#define PLACE Mean
#define PLACE_ON(number, angle) mean_on(number, angle, s.span[number])
#else
#define PLACE Place
#define PLACE_ON(number, angle) place_on(axes[number], angle)
#endif

uniform int azimuth_channel;    // that of the fourth axis: phi_i or phi_h

struct Here {
    PLACE first, second, third;
#if AXES == 4
    PLACE fourth;
#endif
    float scale;
};

Here here_at(Sample s) {
    Here here;
#if AXES == 3
    s.angles.z = min(s.angles.z, 6.28318530717958648 - s.angles.z);
#else
    here.fourth = PLACE_ON(3, s.azimuths[azimuth_channel]);
#endif
    here.first = PLACE_ON(0, s.angles.x);
    here.second = PLACE_ON(1, s.angles.y);
    here.third = PLACE_ON(2, s.angles.z);
    here.scale = s.angles.w;
    return here;
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    vec4 found = look_up(here.first, row) * look_up(here.second, row) * look_up(here.third, row) * here.scale;
#if AXES == 4
    found *= look_up(here.fourth, row);
#endif
    return found;
}
