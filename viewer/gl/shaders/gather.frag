// Area, environment or indirect light gathered by one part's material at every pixel of a box: the form's terms for
// each field of the light, four per target for `fold.frag`, or folded here into images of SPECTRA spectra. Twin of
// `software/environment_light.py`. A draw call computes ROWS_A_CALL rows of four terms for each of FIELDS fields,
// compile-time constants so that sums stay in registers. An array with dynamic indices would be in memory and cost more
// than look-ups.

#include "octahedral.glsl"
#ifndef PANEL
#include "turned.glsl"
#endif
#if defined(HIDDEN) || defined(INDIRECT)
#include "located.glsl"
#endif
#ifdef PANEL
#include "panel.glsl"
#elif defined(INDIRECT)
#include "indirect.glsl"
#else
#include "environment.glsl"
#endif
#include "gathered.glsl"
#include "terms.glsl"
#ifdef HIDDEN
#include "hidden.glsl"
#ifdef PANEL
#include "panel_hidden.glsl"
#endif
#endif

uniform sampler2D seen;         // triangle index + 1 at every sample
uniform sampler2D tangent, bitangent, normal;   // with the direction to the viewer, see frames.frag
#ifdef USES_UV
uniform sampler2D uv;
uniform sampler2D footprint;
#endif
uniform mat3 map_from_world;
uniform float scale;
uniform ivec2 part;             // first and last triangle index + 1 of the part
uniform int samples;            // along a side of a pixel
uniform ivec2 some_samples;     // range of a pixel's samples: first, and one past the last
uniform ivec2 origin;           // of the box, pixels of the tile
uniform int first_row;          // of the rows of four terms of a field
uniform int lobes;              // LOBES, as a uniform to prevent unrolling
uniform int moments;            // BENT, likewise

#ifdef SPECTRA
#include "fold.glsl"
uniform int rows;               // number of a field's rows
layout(location = 0) out vec4 pictures[SPECTRA];
#else
layout(location = 0) out vec4 terms[FIELDS * ROWS_A_CALL];
#endif

// A lobe's terms are shared by all fields, so they are looked up once.
void add(Here here, int number, vec4 light, inout vec4 total[FIELDS * ROWS_A_CALL]) {
    for (int row = 0; row < ROWS_A_CALL; ++row) {
        vec4 found = value(here, number, first_row + row);
        for (int field = 0; field < FIELDS; ++field) total[field * ROWS_A_CALL + row] += light[field] * found;
    }
}

void main() {
    vec4 total[FIELDS * ROWS_A_CALL];
    for (int k = 0; k < FIELDS * ROWS_A_CALL; ++k) total[k] = vec4(0.0);
    ivec2 corner = (ivec2(gl_FragCoord.xy) + origin) * samples;
    for (int n = some_samples.x; n < some_samples.y; ++n) {
        ivec2 at = corner + ivec2(n % samples, n / samples);
        int number = int(texelFetch(seen, at, 0).x);
        if (number < part.x || number > part.y) continue;
        vec4 x = texelFetch(tangent, at, 0), y = texelFetch(bitangent, at, 0), z = texelFetch(normal, at, 0);
        Gathered s;
        s.wo = vec3(x.w, y.w, z.w);
#ifdef USES_UV
        s.uv = texelFetch(uv, at, 0).xy;
        vec4 steps = texelFetch(footprint, at, 0);
        s.footprint = mat2(steps.xy, steps.zw);
#endif
        Here here = here_at(s);
        mat3 to_world = mat3(x.xyz, y.xyz, z.xyz) * frame_of(here);
        mat3 to_map = map_from_world * to_world;
        vec4 lux[BENT], light;
        stand_at(number, at, z.xyz);
        on_surface(to_map, lux);
#ifdef HIDDEN
        Hiding hiding = hiding_at(number, at);
#ifdef PANEL
        look_at_cells(hiding);
        hide_cells(hiding, to_world, lux);
#else
        float angles[MOST_BRIGHT];
        vec4 parts[BENT], below[BENT], left[BENT];
        for (int b = 0; b < BENT; ++b) parts[b] = below[b] = vec4(0.0);
        for (int j = 0; j < bright; ++j) {
            float above = share_above(dot(hiding.facet, bright_axes[j].xyz), dot(to_world[2], bright_axes[j].xyz),
                bright_axes[j].w);
            // A wider part is needed if the triangle's own plane hides some of it, or for lobes.
            if (j >= narrow && above >= 1.0 && lobes == 0) continue;
            angles[j] = part_distance(hiding, j);
            vec4 given = bright_on(to_world[2], j) * bright_amplitudes[j];
            float free = free_share(angles[j], bright_axes[j].w), share = min(free, above);
            vec3 p = bright_axes[j].xyz * to_world;
            float bent[9] = float[9](1.0, p.x, p.y, p.z, p.x * p.y, p.y * p.z, p.x * p.z, p.x * p.x - p.y * p.y,
                3.0 * p.z * p.z - 1.0);
            if (j < narrow) for (int b = 0; b < BENT; ++b) {
                lux[b] -= bent[b] * given;
                parts[b] += share * bent[b] * given;
            } else for (int b = 0; b < BENT; ++b) below[b] += (free - share) * bent[b] * given;
        }
        left_of(lux, hiding, to_world, left);
        vec4 most = min(max(left[0], 0.0), below[0]), taken;
        for (int k = 0; k < 4; ++k) taken[k] = most[k] > 0.0 ? most[k] / below[0][k] : 0.0;
        for (int b = 0; b < BENT; ++b) lux[b] = left[b] - taken * below[b] + parts[b];
#endif
#endif
        for (int b = 0; b < moments; ++b) add(here, LOBES + b, lux[b] / PI, total);
        for (int q = 0; q < lobes; ++q) {
            vec4 lobe = lobe(here, q);
            light = under_gaussian(to_map * lobe.xyz, lobe.w);
#ifdef HIDDEN
            vec3 to = to_world * lobe.xyz;
            float lambda = 1.0 / lobe.w;
#ifdef PANEL
            light *= free_of_cells(to, lambda, signed_distance(hiding, to));
#else
            vec3 slope;
            float angle = boundary(hiding, to, slope), steep = length(slope);
            vec3 cut = cut_lobe(angle, min(steep, 1.0), lambda), middle = to;
            if (cut.y != 0.0) {
                middle = cos(cut.y) * to + sin(cut.y) * (slope / steep);
                light = under_gaussian(map_from_world * middle, 1.0 / cut.z);
            }
            light *= cut.x;
            for (int j = 0; j < bright; ++j) {
                float both = lambda + bright_axes[j].w;
                float free = free_share(mix(angle, angles[j], bright_axes[j].w / both), both);
                float own = bright_under(to, lambda, bright_axes[j]);
                float taken = cut.y == 0.0 ? own : bright_under(middle, cut.z, bright_axes[j]);
                light += (free * own - cut.x * taken) * bright_amplitudes[j];
            }
            light = max(light, vec4(0.0));
#endif
#endif
            add(here, q, light, total);
        }
    }
#ifdef SPECTRA
    for (int j = 0; j < SPECTRA; ++j) {
        vec3 found = vec3(0.0);
        for (int field = 0; field < FIELDS; ++field)
            for (int row = 0; row < ROWS_A_CALL; ++row)
                found += folded(total[field * ROWS_A_CALL + row], 0, field * rows + first_row + row, j);
        pictures[j] = vec4(scale * found, 0.0);
    }
#else
    for (int k = 0; k < FIELDS * ROWS_A_CALL; ++k) terms[k] = scale * total[k];
#endif
}
