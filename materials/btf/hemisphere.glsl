// Interpolation between measured directions, twin of hemisphere.py: the three around another one, and their weights.

#include "listed.glsl"

const float HORIZON = 1.5707963267948966;

struct Around {
    ivec3 number;
    vec3 share;
};

// `plane`: theta (cos phi, sin phi); `most`: triangles of a cell; `cosine`: of a direction whose values fall with it
// beyond the outermost, or less than 0.
Around around(sampler2D list, int most, vec2 plane, float cosine) {
    ivec2 cell = clamp(ivec2(floor((plane / (2.0 * HORIZON) + 0.5) * float(CELLS))), 0, CELLS - 1);
    int first = 1 + 6 * int(listed(list, 0).x) + (cell.y * CELLS + cell.x) * most;
    vec3 here = vec3(plane, 1.0), share = vec3(0.0);
    float best = -1e30;
    int found = 0;
    for (int i = 0; i < most; ++i) {
        int triangle = int(listed(list, first + i).x);
        if (triangle < 0) break;
        int at = 1 + 6 * triangle;
        vec3 shares = vec3(
            dot(listed(list, at).xyz, here), dot(listed(list, at + 2).xyz, here), dot(listed(list, at + 4).xyz, here));
        float least = min(shares.x, min(shares.y, shares.z));
        if (least > best) {
            best = least;
            found = at;
            share = shares;
        }
    }
    share = max(share, 0.0);
    share /= share.x + share.y + share.z;
    vec4 a = listed(list, found + 1), b = listed(list, found + 3), c = listed(list, found + 5);
    float outermost = dot(share, vec3(a.y, b.y, c.y));
    bool held = a.z + b.z + c.z > 0.0;
    if (held && cosine >= 0.0 && cosine < outermost) share *= cosine / outermost;
    return Around(ivec3(int(a.x), int(b.x), int(c.x)), share);
}

// theta (cos phi, sin phi) of a direction above the horizon; Mesa's own atan is off by thousands of units in the last place.
vec2 plane_of(vec3 w) {
    float level = length(w.xy);
    return level > 0.0 ? w.xy * (atan(level, w.z) / level) : vec2(0.0);
}
