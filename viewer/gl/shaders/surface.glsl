// Surface at a sample: position, shading frame and direction to the viewer; twin of surfaces.py.

#include "triangles.glsl"

uniform sampler2D seen;         // triangle index + 1 at every sample, 0 for none
uniform sampler2D corners;      // of the scene's triangles: three positions, normals and tangents
uniform sampler2D pieces;       // the same of triangles that were clipped
uniform vec3 eye;               // position of a perspective camera, or direction to an orthographic one
uniform bool perspective;

const float LEAST_COSINE = 1e-3;

struct Surface {
    int face;           // triangle of the scene
    vec3 position;      // in radii about the scene's centre
    vec3 to_viewer;
    vec3 tangent, bitangent, normal;    // left-handed for mirrored textures
    float whole;        // inverse depth, up to a factor per triangle
};

vec3 corner_texel(int row, int index) {
    int number = row < 0 ? -1 - row : row;
    ivec2 place = ivec2((number % CORNERS_A_ROW) * CORNER_TEXELS + index, number / CORNERS_A_ROW);
    return row < 0 ? texelFetch(pieces, place, 0).xyz : texelFetch(corners, place, 0).xyz;
}

// Interpolate between the corners of a triangle, three texels from `first`.
vec3 mixed(int row, int first, vec3 weights) {
    return weights.x * corner_texel(row, first) + weights.y * corner_texel(row, first + 1)
        + weights.z * corner_texel(row, first + 2);
}

// a.x b.y - a.y b.x without cancellation, also for thin triangles (Kahan's use of the fused multiply-add).
float cross_product(vec2 a, vec2 b) {
    precise float product = a.y * b.x;
    precise float lost = fma(-a.y, b.x, product);
    precise float difference = fma(a.x, b.y, -product);
    return difference + lost;
}

vec3 to_local(Surface at, vec3 direction) {
    return vec3(dot(at.tangent, direction), dot(at.bitangent, direction), dot(at.normal, direction));
}

vec3 level(vec3 direction, vec3 normal) {
    return direction - dot(direction, normal) * normal;
}

// Twice the signed areas of a point, in 1/256 sample, with the sides opposite to each corner.
vec3 areas(vec2 a, vec2 b, vec2 c) {
    return vec3(cross_product(b, c), cross_product(c, a), cross_product(a, b));
}

// At a point of the image, in 1/256 sample, also beyond a triangle's edges.
Surface surface_at(int number, vec2 point) {
    vec4 first = triangle_texel(number, 0), rest = triangle_texel(number, 1), turn = triangle_texel(number, 2);
    vec3 weights = areas(first.xy - point, first.zw - point, rest.xy - point) * turn.xyz;
    Surface at;
    at.whole = weights.x + weights.y + weights.z;
    weights /= at.whole == 0.0 ? 1.0 : at.whole;
    at.face = int(rest.z);
    int row = int(rest.w);
    at.position = mixed(row, 0, weights);
    at.to_viewer = perspective ? normalize(eye - at.position) : eye;
    vec3 normal = normalize(mixed(row, 3, abs(turn.w) > 1.5 ? -weights : weights));
    normal = normalize(normal + max(LEAST_COSINE - dot(normal, at.to_viewer), 0.0) * at.to_viewer);
    vec3 tangent = mixed(row, 6, weights);
    tangent = level(tangent, normal);
    if (dot(tangent, tangent) < 1e-12) {
        tangent = length(normal.xz) < 1e-6 ? vec3(1.0, 0.0, 0.0) : vec3(normal.z, 0.0, -normal.x);
        tangent = level(tangent, normal);
    }
    // Repeated at full precision, since a rounding error along the normal would rotate sharp highlights.
    tangent = normalize(level(normalize(tangent), normal));
    at.normal = normal;
    at.tangent = tangent;
    at.bitangent = sign(turn.w) * cross(normal, tangent);
    return at;
}
