// Light gathered by a lobe field from all around, twin of lobe_gathering.py: a Gaussian and a bent cosine a lobe.

uniform sampler2D views;
uniform sampler2D prefiltered;  // three texels an angle, a row an exponent; the last row is of what is even

#include "hemisphere.glsl"
#include "lobe.glsl"

const int AROUND = 12 * LOOKS;
const int EACH = SETS * KEPT_LOBES;

struct Here {
    Corners corners;
    Around view;
    vec4 even[FOURS];
    vec4 matt[BENT * FOURS];
};

// A texel in a view, of the twelve about a point at a level: where its numbers begin, and its weight.
int start_at(Corners corners, Around seen, int number) {
    Four four = corners.four[number / 12];
    return start_of(corner_at(four, number % 12 / 3), four.level, seen.number[number % 3]);
}

float counted(Corners corners, Around seen, int number) {
    return corners.share[number / 12] * share_of(corners.four[number / 12], number % 12 / 3) * seen.share[number % 3];
}

// Column of `prefiltered`: evenly in the sine of half the angle to the normal.
int angle_of(vec3 axis) {
    int angles = textureSize(prefiltered, 0).x / 3;
    return 3 * min(int(floor(sqrt(max(0.5 * (1.0 - axis.z), 0.0)) * float(angles - 1) + 0.5)), angles - 1);
}

int row_of(float code) {
    return int(code) + 2;
}

// Weights of a lobe on the polynomials of `environment_form.bends`, from its azimuth's cosine and sine.
void bend(vec4 low, vec4 high, vec2 azimuth, out float taken[BENT]) {
    taken[0] = low.x;
    taken[1] = low.y * azimuth.x;
    taken[2] = low.y * azimuth.y;
    taken[3] = low.z;
    taken[4] = 4.0 * high.x * azimuth.x * azimuth.y;
    taken[5] = low.w * azimuth.y;
    taken[6] = low.w * azimuth.x;
    taken[7] = high.x * (azimuth.x * azimuth.x - azimuth.y * azimuth.y);
    taken[8] = high.y;
}

vec2 azimuth_of(vec3 axis) {
    float level = length(axis.xy);
    return level > 0.0 ? axis.xy / level : vec2(1.0, 0.0);
}

// Amplitudes, of four, of one set of lobes; 0 for the others.
vec4 of_set(vec4 amplitude, int set, int row) {
#if SETS == 1
    return amplitude;
#else
    vec4 found = vec4(0.0);
    if (set / 4 == row) found[set % 4] = amplitude[set % 4];
    return found;
#endif
}

Here here_at(Gathered s) {
    Here here;
    here.corners = corners_about(s.uv, s.footprint);
    here.view = around(views, VIEW_CELLS, plane_of(s.wo), -1.0);
    for (int k = 0; k < FOURS; ++k) here.even[k] = vec4(0.0);
    for (int k = 0; k < BENT * FOURS; ++k) here.matt[k] = vec4(0.0);
    float taken[BENT];
    for (int number = 0; number < AROUND; ++number) {
        float part = counted(here.corners, here.view, number) * tallest;
        if (part == 0.0) continue;
        int start = start_at(here.corners, here.view, number), amplitudes = start + EACH;
        for (int row = 0; row < FOURS; ++row) here.even[row] += part * listed(kept, amplitudes + row);
        for (int i = 0; i < EACH; ++i) {
            vec4 code = listed(kept, start + i);
            vec3 axis = axis_of(code.xy);
            ivec2 at = ivec2(angle_of(axis), row_of(code.z));
            vec4 low = texelFetch(prefiltered, at + ivec2(1, 0), 0), high = texelFetch(prefiltered, at + ivec2(2, 0), 0);
            bend(low, high, azimuth_of(axis), taken);
            for (int row = 0; row < FOURS; ++row) {
                vec4 amplitude = listed(kept, amplitudes + (i % KEPT_LOBES + 1) * FOURS + row);
                amplitude = part * of_set(amplitude, i / KEPT_LOBES, row);
                for (int b = 0; b < BENT; ++b) here.matt[b * FOURS + row] += taken[b] * amplitude;
            }
        }
    }
    ivec2 at = ivec2(0, textureSize(prefiltered, 0).y - 1);
    vec4 low = texelFetch(prefiltered, at + ivec2(1, 0), 0), high = texelFetch(prefiltered, at + ivec2(2, 0), 0);
    bend(low, high, vec2(1.0, 0.0), taken);
    for (int row = 0; row < FOURS; ++row) {
        for (int b = 0; b < BENT; ++b) here.matt[b * FOURS + row] += taken[b] * here.even[row];
    }
    return here;
}

mat3 frame_of(Here here) {
    return mat3(1.0);
}

vec4 lobe(Here here, int number) {
    if (number == LOBES - 1) {
        float spread = texelFetch(prefiltered, ivec2(0, textureSize(prefiltered, 0).y - 1), 0).z;
        return vec4(0.0, 0.0, 1.0, spread);
    }
    vec4 code = listed(kept, start_at(here.corners, here.view, number / EACH) + number % EACH);
    vec3 axis = axis_of(code.xy);
    vec4 gaussian = texelFetch(prefiltered, ivec2(angle_of(axis), row_of(code.z)), 0);
    float level = length(axis.xy);
    vec2 outward = level > 0.0 ? axis.xy / level : vec2(0.0);
    float farther = level * gaussian.x + axis.z * gaussian.y;
    return vec4(outward * farther, axis.z * gaussian.x - level * gaussian.y, gaussian.z);
}

vec4 value(Here here, int number, int row) {
    if (number >= LOBES) return PI * here.matt[(number - LOBES) * FOURS + row];
    if (number == LOBES - 1) {
        return texelFetch(prefiltered, ivec2(0, textureSize(prefiltered, 0).y - 1), 0).w * here.even[row];
    }
    int place = number / EACH, i = number % EACH;
    float part = counted(here.corners, here.view, place);
    if (part == 0.0) return vec4(0.0);
    int start = start_at(here.corners, here.view, place);
    vec4 code = listed(kept, start + i);
    float gaussian = texelFetch(prefiltered, ivec2(angle_of(axis_of(code.xy)), row_of(code.z)), 0).w;
    vec4 amplitude = listed(kept, start + EACH + (i % KEPT_LOBES + 1) * FOURS + row);
    return part * tallest * gaussian * of_set(amplitude, i / KEPT_LOBES, row);
}
