// How much of a light reaches a point: rays against the triangles of one cell of the light's view. Twin of shadows.py,
// which says why.

uniform sampler2D occluders;    // three texels a triangle: corners in the order of their welded numbers
uniform isampler2D cells;       // where each cell's entries begin
uniform isampler2D entries;     // triangle << 4 | facing << 3 | outlines
uniform int resolution;         // cells along a side of a face of the light's view
#if DIRECTIONAL
uniform vec3 view_u, view_v;    // axes of the light's view
#endif

int cell_begin(int cell) {
    return texelFetch(cells, ivec2(cell % ROW_LENGTH, cell / ROW_LENGTH), 0).x;
}

vec3 occluder(int number, int corner) {
    return texelFetch(occluders, ivec2((number % OCCLUDERS_A_ROW) * 3 + corner, number / OCCLUDERS_A_ROW), 0).xyz;
}

// Twice the area that the ray and the edge from a to b span, signed; the same bits for both triangles of an edge.
float edge_side(vec3 a, vec3 b, vec3 point, vec3 to_light) {
    precise vec3 along = b - a;
    precise vec3 from = point - a;
    precise vec3 across = vec3(
        along.y * from.z - along.z * from.y, along.z * from.x - along.x * from.z, along.x * from.y - along.y * from.x);
    precise float side = to_light.x * across.x + to_light.y * across.y + to_light.z * across.z;
    return side;
}

float outline_ramp(float side, vec3 edge, vec3 to_light) {
    return clamp(side / (max(length(cross(to_light, edge)), 1e-12) * OUTLINE_RAMP) + 0.5, 0.0, 1.0);
}

float shade_of(int code, vec3 point, vec3 to_light, float reach) {
    int number = code >> 4;
    vec3 a = occluder(number, 0), b = occluder(number, 1), c = occluder(number, 2);
    float facing = (code & 8) != 0 ? 1.0 : -1.0;
    vec3 side = facing
        * vec3(edge_side(a, b, point, to_light), edge_side(b, c, point, to_light), -edge_side(a, c, point, to_light));
    float cover = 1.0;
    if ((code & 1) != 0) cover = min(cover, outline_ramp(side.x, b - a, to_light));
    else if (side.x < 0.0) return 0.0;
    if ((code & 2) != 0) cover = min(cover, outline_ramp(side.y, c - b, to_light));
    else if (side.y < 0.0) return 0.0;
    if ((code & 4) != 0) cover = min(cover, outline_ramp(side.z, c - a, to_light));
    else if (side.z < 0.0) return 0.0;
    if (cover == 0.0) return 0.0;
    vec3 weights = max(side.yzx, 0.0);
    vec3 ahead = vec3(dot(a - point, to_light), dot(b - point, to_light), dot(c - point, to_light));
    float distance = dot(weights, ahead) / max(weights.x + weights.y + weights.z, 1e-30);
    return distance < reach ? cover * clamp(distance / CONTACT - 1.0, 0.0, 1.0) : 0.0;
}

#if DIRECTIONAL
int cell_of(vec3 point) {
    vec2 flat_position = vec2(dot(view_u, point), dot(view_v, point));
    ivec2 cell = clamp(ivec2(floor((flat_position + 1.0) * (0.5 * resolution))), 0, resolution - 1);
    return cell.y * resolution + cell.x;
}
#else
int cell_of(vec3 offset) {
    vec3 size = abs(offset);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    vec2 flat_position = vec2(offset[(axis + 1) % 3], offset[(axis + 2) % 3]) / size[axis];
    ivec2 cell = clamp(ivec2(floor((flat_position + 1.0) * (0.5 * resolution))), 0, resolution - 1);
    int face = 2 * axis + (offset[axis] < 0.0 ? 1 : 0);
    return (face * resolution + cell.y) * resolution + cell.x;
}
#endif

// `where` is the point (directional) or its offset from the light; `own` is the triangle it lies on.
float visibility(vec3 point, vec3 where, int own, vec3 to_light, float reach) {
    int cell = cell_of(where);
    int last = cell_begin(cell + 1);
    float visible = 1.0;
    for (int entry = cell_begin(cell); entry < last && visible > 0.0; ++entry) {
        int code = texelFetch(entries, ivec2(entry % ROW_LENGTH, entry / ROW_LENGTH), 0).x;
        if ((code >> 4) != own) visible = min(visible, 1.0 - shade_of(code, point, to_light, reach));
    }
    return visible;
}
