// The terms of a factor pack at one sample, four at a time; twin of FactorPack.geometry_at.

uniform sampler2D factors;      // a column a node, the axes side by side; a row for every four terms
uniform vec4 axes[AXES];        // 1 / maximum, size - 1, first column, 0 linear, 1 square root, 2 periodic

struct Place {
    int below, beyond;          // columns of the two nodes about an angle
    float between;              // how far it is from the one to the other
};

Place place_on(vec4 axis, float angle) {
    float u = angle * axis.x;
    u = axis.w == 2.0 ? fract(u) : clamp(u, 0.0, 1.0);
    float position = (axis.w == 1.0 ? sqrt(u) : u) * axis.y;
    float below = min(floor(position), axis.y);
    return Place(int(axis.z + below), int(axis.z + min(below + 1.0, axis.y)), position - below);
}

vec4 look_up(Place place, int row) {
    return mix(texelFetch(factors, ivec2(place.below, row), 0), texelFetch(factors, ivec2(place.beyond, row), 0),
        place.between);
}
