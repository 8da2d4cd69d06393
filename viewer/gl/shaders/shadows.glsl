// Share of a light that reaches a point: shadow rays against the triangles of one cell of the light's view. Twin of
// shadows.py, which explains it.

uniform sampler2D occluders;    // three texels per triangle: sorted corners in the light's view coordinates
uniform isampler2D cells;       // offset of each cell's entries
uniform isampler2D entries;     // triangle << 4 | facing << 3 | outlines, and the bits of its start
uniform mat3 view_from_world;
uniform vec3 view_origin;
uniform float convergence;      // 1 / distance of a point light with parallel view, else 0
uniform int resolution;         // cells along a side of a face of the light's view

int cell_begin(int cell) {
    return texelFetch(cells, ivec2(cell % ROW_LENGTH, cell / ROW_LENGTH), 0).x;
}

vec3 occluder(int number, int corner) {
    return texelFetch(occluders, ivec2((number % OCCLUDERS_A_ROW) * 3 + corner, number / OCCLUDERS_A_ROW), 0).xyz;
}

// Area spanned by a and b, seen from the light, without fused operations: bit-identical for both triangles of an edge.
float area(vec3 a, vec3 b, vec3 to_light) {
    precise float z = a.x * b.y - a.y * b.x;
#if PARALLEL
    return z;
#else
    precise float x = a.y * b.z - a.z * b.y;
    precise float y = a.z * b.x - a.x * b.z;
    precise float seen_area = x * to_light.x + y * to_light.y + z * to_light.z;
    return seen_area;
#endif
}

float along(vec3 v, vec3 to_light) {
#if PARALLEL
    return v.z;
#else
    return dot(v, to_light);
#endif
}

float outline_ramp(float side, vec3 edge, vec3 to_light) {
#if PARALLEL
    float span = length(edge.xy);
#else
    float span = length(cross(edge, to_light));
#endif
    return clamp(side / (max(span, 1e-12) * OUTLINE_RAMP) + 0.5, 0.0, 1.0);
}

// Occlusion of the ray from a point to the light by one triangle.
float shade_of(int code, vec3 point, vec3 to_light, float reach, float contact) {
    int number = code >> 4;
    vec3 a = occluder(number, 0), b = occluder(number, 1), c = occluder(number, 2);
    float facing = (code & 8) != 0 ? 1.0 : -1.0;
    precise vec3 from_a = point - a;
    precise vec3 from_b = point - b;
    vec3 side = facing * vec3(area(b - a, from_a, to_light), area(c - b, from_b, to_light), -area(c - a, from_a, to_light));
    float cover = 1.0;
    if ((code & 1) != 0) cover = min(cover, outline_ramp(side.x, b - a, to_light));
    else if (side.x < 0.0) return 0.0;
    if ((code & 2) != 0) cover = min(cover, outline_ramp(side.y, c - b, to_light));
    else if (side.y < 0.0) return 0.0;
    if ((code & 4) != 0) cover = min(cover, outline_ramp(side.z, c - a, to_light));
    else if (side.z < 0.0) return 0.0;
    if (cover == 0.0) return 0.0;
    // The weight of a corner is the edge function of the opposite edge.
    vec3 weights = max(side.yzx, 0.0);
    weights /= max(weights.x + weights.y + weights.z, 1e-30);
    float ahead = along(weights.x * (a - point) + weights.y * (b - point) + weights.z * (c - point), to_light);
    return ahead < reach ? cover * clamp(ahead / contact - 1.0, 0.0, 1.0) : 0.0;
}

// Distance below which occluders cast no shadow on a point of triangle `number`.
float contact_on(int number, vec3 to_light) {
    vec3 a = occluder(number, 0), b = occluder(number, 1), c = occluder(number, 2);
    vec3 normal = cross(b - a, c - a);
    return CONTACT + ROUNDING / max(abs(along(normal, to_light)) / max(length(normal), 1e-30), 1e-6);
}

// Share of the light that reaches a point (in the scene's coordinates) on the triangle `own`.
float visibility(vec3 world, int own) {
    vec3 point = view_from_world * (world - view_origin);
#if PARALLEL
    point /= 1.0 - convergence * point.z;
    int face = 0;
    float depth = -point.z, reach = 1e30;
    vec2 flat_position = point.xy;
    vec3 to_light = vec3(0.0, 0.0, 1.0);
#else
    vec3 size = abs(point);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    int face = 2 * axis + (point[axis] < 0.0 ? 1 : 0);
    float depth = size[axis], reach = length(point);
    vec2 flat_position = vec2(point[(axis + 1) % 3], point[(axis + 2) % 3]) / depth;
    vec3 to_light = -point / reach;
#endif
    ivec2 place = clamp(ivec2(floor((flat_position + 1.0) * (0.5 * resolution))), 0, resolution - 1);
    int cell = (face * resolution + place.y) * resolution + place.x;
    int last = cell_begin(cell + 1);
    float contact = contact_on(own, to_light);
    float shade = 0.0;
    for (int number = cell_begin(cell); number < last && shade < 1.0; ++number) {
        ivec2 entry = texelFetch(entries, ivec2(number % ROW_LENGTH, number / ROW_LENGTH), 0).xy;
        if (intBitsToFloat(entry.y) >= depth) break;
        if ((entry.x >> 4) != own) shade = max(shade, shade_of(entry.x, point, to_light, reach, contact));
    }
    return 1.0 - shade;
}
